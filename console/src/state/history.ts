// SPDX-License-Identifier: Apache-2.0
/** Values of the last seconds at any rate: of each short interval the least and the greatest, so that a peak of one sample stays. */

export type Value = number | null;
/** Times, then the values of each series at them; null: no value. */
export type Columns = [number[], ...Value[][]];

interface Range {
  least: number;
  most: number;
  /** The greatest came after the least. */
  rises: boolean;
}
interface Interval {
  first: number;
  last: number;
  /** null: no value of this series. */
  ranges: (Range | null)[];
}

export class History {
  private intervals: Interval[] = [];

  /** Times in s.
   * @param window  that is kept
   * @param step  length of an interval
   * @param gap  silence after which there is no line */
  constructor(
    private readonly series: number,
    private readonly window: number,
    private readonly step: number,
    private readonly gap: number,
  ) {}

  /** @param time  not before that of the last sample; an earlier one begins anew: the clock has changed */
  add(time: number, values: readonly Value[]): void {
    let last = this.intervals.at(-1);
    if (last && time < last.last) this.intervals = [];
    last = this.intervals.at(-1);
    if (!last || Math.floor(time / this.step) !== Math.floor(last.first / this.step)) {
      last = { first: time, last: time, ranges: Array.from({ length: this.series }, () => null) };
      this.intervals.push(last);
      while (this.intervals[0]!.last < time - this.window) this.intervals.shift();
    }
    last.last = time;
    for (let k = 0; k < this.series; ++k) {
      const value = values[k] ?? null;
      if (value === null || !Number.isFinite(value)) continue;
      const range = (last.ranges[k] ??= { least: value, most: value, rises: true });
      if (value < range.least) [range.least, range.rises] = [value, false];
      if (value > range.most) [range.most, range.rises] = [value, true];
    }
  }

  /** Two points for each interval; between intervals with a gap, one without values. */
  columns(): Columns {
    const columns: Columns = [[], ...Array.from({ length: this.series }, () => [] as Value[])];
    const point = (time: number, value: (k: number) => Value): void => {
      columns[0].push(time);
      for (let k = 0; k < this.series; ++k) (columns[k + 1] as Value[]).push(value(k));
    };
    this.intervals.forEach(({ first, last, ranges }, i) => {
      const before = this.intervals[i - 1];
      if (before && first - before.last > this.gap) point((first + before.last) / 2, () => null);
      const end = (range: Range | null | undefined, late: boolean): Value =>
        range ? (range.rises === late ? range.most : range.least) : null;
      point(first, (k) => end(ranges[k], false));
      if (last > first) point(last, (k) => end(ranges[k], true));
    });
    return columns;
  }

  /** The values nearest to a time: their range; null without any within the gap. */
  at(time: number): ({ least: number; most: number } | null)[] {
    const away = ({ first, last }: Interval): number => Math.max(first - time, time - last, 0);
    const nearest = this.intervals.reduce<Interval | null>(
      (best, one) => (!best || away(one) < away(best) ? one : best),
      null,
    );
    if (!nearest || away(nearest) > this.gap) return Array.from({ length: this.series }, () => null);
    return nearest.ranges;
  }
}

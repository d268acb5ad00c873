// SPDX-License-Identifier: Apache-2.0
/** A map that keeps the newest keys: for lists that others make longer while a page is open. */

export class Recent<K, V> extends Map<K, V> {
  /** @param most  keys that are kept: the last ones that were set */
  constructor(private readonly most: number) {
    super();
  }
  override set(key: K, value: V): this {
    this.delete(key);
    super.set(key, value);
    while (this.size > this.most) this.delete(this.keys().next().value as K);
    return this;
  }
}

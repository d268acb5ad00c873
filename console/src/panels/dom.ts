// SPDX-License-Identifier: Apache-2.0
/** Creation of elements, and updates that write only changes. */

type Child = Node | string | null | undefined;
type Attributes = Record<string, string | boolean | ((event: never) => void) | undefined>;

/** Characters that order the text around them: with one of them, "\u202Egnp.exe" is shown as "exe.png". */
const kOrdering = /[\u061C\u200E\u200F\u202A-\u202E\u2066-\u2069]/g;
/** Attributes that are shown or spoken. */
const kSaid = ["title", "aria-label"];
/** A text as it is shown: others' names and messages are not reordered. */
export const readable = (text: string): string => text.replace(kOrdering, "\uFFFD");

/** h("button.big", {type: "button", onclick: f}, "text"). An output is no live region: what happens is announced by the Announcer, and values
 * that change by themselves are not. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K | `${K}.${string}`,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name as K);
  if (classes.length > 0) element.className = classes.join(" ");
  if (name === "output") element.setAttribute("aria-live", "off");
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(key.slice(2), value as EventListener);
    else if (value === true) element.setAttribute(key, "");
    else if (typeof value === "string") setAttribute(element, key, value);
  }
  for (const child of children) if (child != null) element.append(typeof child === "string" ? readable(child) : child);
  return element;
}

export function setText(element: HTMLElement, text: string): void {
  const shown = readable(text);
  if (element.textContent !== shown) element.textContent = shown;
}
export function setAttribute(element: Element, name: string, value: string): void {
  const shown = kSaid.includes(name) ? readable(value) : value;
  if (element.getAttribute(name) !== shown) element.setAttribute(name, shown);
}
export function setClass(element: Element, name: string, on: boolean): void {
  if (element.classList.contains(name) !== on) element.classList.toggle(name, on);
}
export function setShown(element: HTMLElement, shown: boolean): void {
  if (element.hidden === shown) element.hidden = !shown;
}

/** Disables a button with a reason, or enables it (`why` empty). It stays in the tab order. */
export function setUsable(button: HTMLButtonElement, why: string): void {
  setAttribute(button, "aria-disabled", why === "" ? "false" : "true");
  setAttribute(button, "title", why === "" ? (button.dataset["help"] ?? "") : why);
}
export const usable = (button: HTMLButtonElement): boolean => button.getAttribute("aria-disabled") !== "true";

/** A button without effect while it is disabled. */
export function action(label: string, help: string, act: () => void, kind = ""): HTMLButtonElement {
  const button: HTMLButtonElement = h(
    kind === "" ? "button" : `button.${kind}`,
    { type: "button", "data-help": help, title: help, onclick: () => usable(button) && act() },
    label,
  );
  return button;
}

export function card(title: string, ...children: Child[]): HTMLElement {
  return h("section.card", { "aria-label": title }, h("h2", {}, title), ...children);
}

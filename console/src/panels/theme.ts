// SPDX-License-Identifier: Apache-2.0
/** Dark or light: as the browser asks for, or as chosen here, which is kept for this address. */
import { Choice } from "./choice";

const kKey = "tandem-theme";
const kThemes = [
  { value: "system", text: "as the system" },
  { value: "dark", text: "dark" },
  { value: "light", text: "light" },
];
/** Of the window, after each change. */
const kChanged = "tandem-theme";

/** A browser that forbids storage keeps nothing, and the page follows the system. */
function kept(): string {
  try {
    return localStorage.getItem(kKey) ?? "system";
  } catch {
    return "system";
  }
}
function apply(theme: string): void {
  document.documentElement.dataset["theme"] = theme;
  window.dispatchEvent(new Event(kChanged));
}

export function themeChoice(): HTMLElement {
  const choice = new Choice("theme", "Colours of the page", kThemes, () => {
    apply(choice.value);
    try {
      localStorage.setItem(kKey, choice.value);
    } catch {
      // Chosen until the page is closed.
    }
  });
  choice.value = kThemes.some(({ value }) => value === kept()) ? kept() : "system";
  apply(choice.value);
  return choice.element;
}

/** Calls when the colours have changed: what is drawn on a canvas is drawn again. @returns what ends the calls */
export function whenThemeChanges(call: () => void): () => void {
  const system = matchMedia("(prefers-color-scheme: light)");
  window.addEventListener(kChanged, call);
  system.addEventListener("change", call);
  return () => {
    window.removeEventListener(kChanged, call);
    system.removeEventListener("change", call);
  };
}

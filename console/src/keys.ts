import { signal } from "@preact/signals";
import { useLayoutEffect } from "preact/hooks";

export interface Shortcut {
  keys: string; // "g t": one after the other; "?": one
  text: string;
  run: () => void;
}

const PAUSE_MS = 1500; // between the keys of a sequence

/** Those that count now, the page's own last. */
export const shortcuts = signal<Shortcut[]>([]);
let typed: string[] = [];
let typedAt = 0;

/** Shortcuts while a component is shown: from the moment it can be seen, which an ordinary effect comes after. */
export function useShortcuts(list: Shortcut[], dependencies: unknown[]): void {
  useLayoutEffect(() => {
    shortcuts.value = [...shortcuts.peek(), ...list];
    return () => {
      shortcuts.value = shortcuts.peek().filter((shortcut) => !list.includes(shortcut));
    };
  }, dependencies);
}

function isTyping(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  return target.isContentEditable || ["INPUT", "TEXTAREA", "SELECT"].includes(target.tagName);
}

export function startKeys(): void {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing || isTyping(event.target)) return;
    if (document.querySelector("dialog[open]")) return; // has keys of its own
    if (event.key.length > 1) return;
    // When the key was pressed: a busy page hears of it later.
    typed = event.timeStamp - typedAt > PAUSE_MS ? [event.key] : [...typed, event.key].slice(-2);
    typedAt = event.timeStamp;
    const spoken = typed.join(" ");
    const found =
      shortcuts.peek().findLast((shortcut) => shortcut.keys === spoken) ??
      shortcuts.peek().findLast((shortcut) => shortcut.keys === event.key);
    if (!found) return;
    event.preventDefault();
    typed = [];
    found.run();
  });
}

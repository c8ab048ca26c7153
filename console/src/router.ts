import { signal } from "@preact/signals";

/** The steps of the address behind "#/": ["takes", "ID"]. */
export const route = signal<string[]>([]);

function read(): void {
  route.value = location.hash.replace(/^#\/?/, "").split("/").filter(Boolean).map(decodeURIComponent);
}

export function startRouter(): void {
  addEventListener("hashchange", read);
  read();
}

export function hrefOf(...steps: string[]): string {
  return "#/" + steps.map(encodeURIComponent).join("/");
}

export function go(...steps: string[]): void {
  location.hash = hrefOf(...steps);
}

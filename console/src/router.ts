import { signal } from "@preact/signals";

/** The steps of the address behind "#/": ["takes", "ID"]. */
export const route = signal<string[]>([]);

/** A step as it was written, where it is no encoding of anything: such an address names nothing that exists. */
function decoded(step: string): string {
  try {
    return decodeURIComponent(step);
  } catch {
    return step;
  }
}

function read(): void {
  route.value = location.hash.replace(/^#\/?/, "").split("/").filter(Boolean).map(decoded);
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

import { effect, signal } from "@preact/signals";
import { Role } from "@api/access_pb";
import type { ConsoleUser } from "@api/console_pb";
import { Client } from "./api/client";
import { asApiError } from "./api/error";

export const client = new Client();

/** Whom the page works for. undefined: not known yet; null: nobody is logged in. */
export const user = signal<ConsoleUser | null | undefined>(undefined);
/** Why nobody is logged in any more; shown above the form. */
export const loggedOutBecause = signal("");
/** Version of the daemon that this page came from; another one later means that the page is old. */
let firstVersion = "";
export const isOutdated = signal(false);

export function mayAs(role: Role): boolean {
  return (user.value?.role ?? Role.UNSPECIFIED) >= role;
}

function accept(known: ConsoleUser): void {
  firstVersion ||= known.weftVersion;
  isOutdated.value = known.weftVersion !== firstVersion;
  loggedOutBecause.value = "";
  user.value = known;
  client.live.open();
}

/** Asks the daemon whom the cookie belongs to. A daemon that does not answer changes nothing. */
export async function findUser(): Promise<void> {
  try {
    accept(await client.user());
  } catch (reason) {
    const error = asApiError(reason);
    if (error.code !== "UNAUTHENTICATED") {
      if (user.peek() === undefined) setTimeout(findUser, 2000);
      return;
    }
    if (user.peek()) loggedOutBecause.value = "Your session is over: " + error.message;
    user.value = null;
    client.live.close();
  }
}

export async function logIn(token: string): Promise<void> {
  accept(await client.logIn(token));
}

export async function logOut(): Promise<void> {
  client.live.close();
  await client.logOut().catch(() => {});
  user.value = null;
}

const THEME = "weft.theme";
export const theme = signal<"dark" | "light">(localStorage.getItem(THEME) === "light" ? "light" : "dark");

export function switchTheme(): void {
  theme.value = theme.value === "dark" ? "light" : "dark";
}

export function startState(): void {
  effect(() => {
    document.documentElement.dataset.theme = theme.value;
    localStorage.setItem(THEME, theme.value);
  });
  client.live.onRefused = () => void findUser();
  addEventListener("online", () => client.live.retryNow());
  addEventListener("visibilitychange", () => {
    if (document.visibilityState === "visible") client.live.retryNow();
  });
  void findUser();
}

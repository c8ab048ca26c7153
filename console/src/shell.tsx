import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { client, isOutdated, logOut, switchTheme, theme, user } from "./app_state";
import { shortcuts, useShortcuts } from "./keys";
import { go, hrefOf, route } from "./router";
import { ServerStatus } from "./server_status";
import { Dialog } from "./ui/dialog";
import { Table } from "./ui/parts";

export const PLACES: { step: string; name: string; key: string }[] = [
  { step: "cameras", name: "Cameras", key: "c" },
  { step: "takes", name: "Takes", key: "t" },
  { step: "jobs", name: "Jobs", key: "j" },
  { step: "operations", name: "Operations", key: "o" },
  { step: "library", name: "Library", key: "l" },
  { step: "server", name: "Server", key: "s" },
];

const ROLES: Record<Role, string> = {
  [Role.UNSPECIFIED]: "no role",
  [Role.VIEWER]: "viewer",
  [Role.CLIENT]: "client",
  [Role.OPERATOR]: "operator",
  [Role.ADMIN]: "admin",
};

/** Puts the focus on the link of another row; Enter opens it. */
function stepRow(by: number): void {
  const rows = [...document.querySelectorAll<HTMLElement>("main a.row")];
  const at = rows.indexOf(document.activeElement as HTMLElement);
  rows[at < 0 ? 0 : Math.min(rows.length - 1, Math.max(0, at + by))]?.focus();
}

/** What stands around every page. */
export function Shell({ children }: { children: ComponentChildren }) {
  const [helps, setHelps] = useState(false);
  const main = useRef<HTMLElement>(null);
  const here = route.value[0] ?? "cameras";
  useShortcuts(
    [
      ...PLACES.map(({ step, name, key }) => ({ keys: `g ${key}`, text: `Go to ${name}`, run: () => go(step) })),
      { keys: "?", text: "Show the keys", run: () => setHelps(true) },
      { keys: "j", text: "The next row", run: () => stepRow(1) },
      { keys: "k", text: "The row before", run: () => stepRow(-1) },
      { keys: "d", text: "Dark or light", run: switchTheme },
    ],
    [],
  );
  const path = route.value.join("/");
  useEffect(() => {
    const title = PLACES.find(({ step }) => step === here)?.name ?? "Weft";
    document.title = `${title} – Weft`;
    main.current?.scrollTo(0, 0);
  }, [path]);
  return (
    <div class="shell">
      <a class="skip" href="#main" onClick={(event) => (event.preventDefault(), main.current?.focus())}>
        Skip to the page
      </a>
      <nav aria-label="Places">
        <span class="brand">Weft</span>
        {PLACES.map(({ step, name, key }) => (
          <a key={step} href={hrefOf(step)} aria-current={here === step ? "page" : undefined} title={`g ${key}`}>
            {name}
          </a>
        ))}
        <span class="space" />
        <button type="button" class="plain" onClick={switchTheme} title="d">
          {theme.value === "dark" ? "Light" : "Dark"}
        </button>
        <button type="button" class="plain" onClick={() => setHelps(true)} title="?">
          Keys
        </button>
        <User />
      </nav>
      <div class="status-bar">
        <ConnectionState />
        <ServerStatus />
      </div>
      <main id="main" ref={main} tabIndex={-1}>
        {children}
      </main>
      {helps && <Keys onClose={() => setHelps(false)} />}
    </div>
  );
}

function User() {
  if (!user.value) return null;
  const name = /\((.*)\)/.exec(user.value.caller)?.[1] ?? user.value.caller;
  return (
    <>
      <span class="user" title={user.value.caller}>
        {name} <small>{ROLES[user.value.role]}</small>
      </span>
      <button type="button" class="plain" onClick={() => void logOut()}>
        Log out
      </button>
    </>
  );
}

function ConnectionState() {
  const state = client.live.state.value;
  return (
    <span class="connection" role="status" data-state={state}>
      {state === "open" && <>connected</>}
      {state === "connecting" && <>connecting …</>}
      {state === "lost" && <>connection lost, trying again; what is shown may be old</>}
      {isOutdated.value && (
        <button type="button" class="plain" onClick={() => location.reload()}>
          The daemon was updated: load its pages
        </button>
      )}
    </span>
  );
}

function Keys({ onClose }: { onClose: () => void }) {
  return (
    <Dialog title="Keys" onClose={onClose}>
      <Table head={["key", "what it does"]} label="Keys">
        {shortcuts.value.map(({ keys, text }) => (
          <tr key={keys + text}>
            <td>
              {keys.split(" ").map((key) => (
                <kbd key={key}>{key}</kbd>
              ))}
            </td>
            <td>{text}</td>
          </tr>
        ))}
        <tr>
          <td>
            <kbd>Esc</kbd>
          </td>
          <td>Close what is open</td>
        </tr>
      </Table>
    </Dialog>
  );
}

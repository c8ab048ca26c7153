import type { ComponentType } from "preact";
import { user } from "./app_state";
import { Login } from "./login";
import { CamerasPage } from "./pages/cameras";
import { JobsPage } from "./pages/jobs";
import { LibraryPage } from "./pages/library";
import { OperationsPage } from "./pages/operations";
import { PlayerPage } from "./pages/player";
import { ServerPage } from "./pages/server";
import { TakesPage } from "./pages/takes";
import { hrefOf, route } from "./router";
import { Shell } from "./shell";
import { Page, Waiting } from "./ui/parts";

const PAGES: Record<string, ComponentType> = {
  cameras: CamerasPage,
  takes: TakesPage,
  jobs: JobsPage,
  operations: OperationsPage,
  library: LibraryPage,
  server: ServerPage,
};

export function App() {
  if (user.value === undefined) return <Waiting for="the daemon" />;
  if (user.value === null) return <Login />;
  const [place, id, part] = route.value;
  const Shown = place === "jobs" && id && part === "player" ? PlayerPage : (PAGES[place ?? "cameras"] ?? Nowhere);
  return (
    <Shell>
      <Shown />
    </Shell>
  );
}

function Nowhere() {
  return (
    <Page title="Nothing here">
      <p>
        There is no such page. <a href={hrefOf("server")}>Look at the server</a>
      </p>
    </Page>
  );
}

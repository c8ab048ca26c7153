import { useEffect, useRef, useState } from "preact/hooks";
import type { Client } from "../api/client";
import { client } from "../app_state";
import { route } from "../router";
import { Page, Waiting } from "../ui/parts";

/** src/player/index.ts. It shows a job's sequence in `element` and returns what ends that and frees its memory. */
interface Player {
  mountPlayer(element: HTMLElement, client: Client, jobId: string): () => void;
}

// A build without that folder has no 3D view. Its code is loaded when it is first shown.
const load = Object.values(import.meta.glob<Player>("../player/index.ts"))[0];
export const hasPlayer = load !== undefined;

export function PlayerPage() {
  const place = useRef<HTMLDivElement>(null);
  const [problem, setProblem] = useState(hasPlayer ? "" : "This build has no 3D view.");
  const [isLoading, setLoading] = useState(hasPlayer);
  const jobId = route.value[1]!;
  useEffect(() => {
    let end = () => {};
    let isGone = false;
    load?.()
      .then((player) => {
        if (isGone || !place.current) return;
        setLoading(false);
        end = player.mountPlayer(place.current, client, jobId);
      })
      .catch((reason: unknown) => setProblem(`The 3D view cannot be shown: ${String(reason)}`));
    return () => {
      isGone = true;
      end();
    };
  }, [jobId]);
  return (
    <Page title={`Job ${jobId} in 3D`}>
      {problem && <p role="alert">{problem}</p>}
      {isLoading && !problem && <Waiting for="the 3D view" />}
      <div class="player" ref={place} />
    </Page>
  );
}

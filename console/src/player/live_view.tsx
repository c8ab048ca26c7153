import { useEffect } from "preact/hooks";
import type { Client } from "../api/client";
import { hrefOf } from "../router";
import { Failure } from "../ui/parts";
import type { Coloring } from "./colors";
import { Legend } from "./legend";
import { turnByKey } from "./turn_by_key";
import { useEngine } from "./use_engine";

const COLORINGS: Coloring[] = ["coverage", "state", "sigma", "cameras", "cloth"];

/** The newest mesh of a take that is registered while it is recorded, and what of the cloth cameras have seen so far. */
export function LiveView({ client, jobId }: { client: Client; jobId: string }) {
  // A browser without 3D has the pictures.
  const { canvas, engine, error } = useEngine(client, jobId, true);
  useEffect(() => engine?.setColoring("coverage"), [engine]);
  const frame = engine?.frames.value[engine.index.value];
  return (
    <section class="live-mesh panel" aria-label="Live mesh">
      <canvas
        ref={canvas}
        tabIndex={0}
        role="img"
        aria-label="The newest mesh. Arrow keys turn it, plus and minus zoom, 0 goes back."
        onKeyDown={(event) => engine && turnByKey(engine.orbit, event)}
      />
      <div>
        <p>
          {frame ? `Frame ${frame.frame}` : "Waiting for the first mesh …"} <a href={hrefOf("jobs", jobId)}>the job</a>
        </p>
        {engine && (
          <label>
            Colours
            <select value={engine.coloring.value} onChange={(event) => engine.setColoring(event.currentTarget.value as Coloring)}>
              {COLORINGS.map((name) => (
                <option key={name}>{name}</option>
              ))}
            </select>
          </label>
        )}
        {engine && <Legend engine={engine} />}
        <Failure error={error ?? engine?.error.value ?? null} />
      </div>
    </section>
  );
}

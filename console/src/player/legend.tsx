import { useEffect, useRef } from "preact/hooks";
import { STATE_NAMES, palette } from "./colors";
import type { Coloring } from "./colors";
import type { Engine } from "./engine";

/** What the colours mean. */
export function Legend({ engine }: { engine: Engine }) {
  const coloring = engine.coloring.value;
  if (coloring === "cloth") return null;
  if (coloring === "state") {
    return (
      <ul class="player-legend">
        {STATE_NAMES.map((name, state) => (
          <li key={name}>
            <span class={`swatch state-${state}`} aria-hidden="true" /> {name}
          </li>
        ))}
      </ul>
    );
  }
  const range = engine.ranges.value[coloring] ?? 1;
  const texts: Record<Exclude<Coloring, "cloth" | "state">, [string, string, string]> = {
    sigma: ["0", `${range} mm and more`, "standard deviation of a position"],
    cameras: ["0", `${range}`, "cameras that saw it"],
    coverage: ["0 %", "100 %", `of the ${engine.counted.value} frames shown so far, in how many cameras saw it`],
    difference: ["0", `${range} mm and more`, "distance to the other job"],
  };
  const [low, high, what] = texts[coloring];
  return (
    <p class="player-legend">
      {low} <Scale /> {high}: {what}
    </p>
  );
}

function Scale() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    canvas.current?.getContext("2d")?.putImageData(new ImageData(palette(), 256, 1), 0, 0);
  }, []);
  return <canvas ref={canvas} class="scale" width={256} height={1} aria-hidden="true" />;
}

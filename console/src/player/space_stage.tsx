import { useEffect, useRef, useState } from "preact/hooks";
import { SpaceView } from "./space_view";
import { turnByKey } from "./turn_by_key";

/** A canvas with a SpaceView that lives as long as it. `show` fills it, again when `filled` is another one. */
export function SpaceStage({ label, show, filled }: { label: string; show: (view: SpaceView) => void; filled: unknown }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<SpaceView | null>(null);
  const [problem, setProblem] = useState("");
  useEffect(() => {
    try {
      view.current = new SpaceView(canvas.current!);
    } catch (reason) {
      setProblem(`This browser shows nothing in 3D: ${String(reason)}`);
    }
    return () => view.current?.dispose();
  }, []);
  useEffect(() => {
    if (view.current) show(view.current);
  }, [filled]);
  return (
    <div class="player-stage">
      {problem && <p role="alert">{problem}</p>}
      <canvas
        ref={canvas}
        tabIndex={0}
        role="img"
        aria-label={`${label} Arrow keys turn the view, plus and minus zoom, 0 goes back.`}
        onKeyDown={(event) => view.current && turnByKey(view.current.orbit, event)}
        onDblClick={() => view.current?.orbit.reset()}
      />
    </div>
  );
}

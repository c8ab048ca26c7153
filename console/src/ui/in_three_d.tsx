import { useEffect, useRef, useState } from "preact/hooks";
import { Waiting } from "./parts";

/** src/player/index.ts: views in three dimensions. Each is shown in an element; what it returns ends it. */
type Player = typeof import("../player/index");

/** A view whose code is loaded when it is first shown. A `key` tells views of different things apart. */
export function InThreeD({ mount, className }: { mount: (player: Player, element: HTMLElement) => () => void; className?: string }) {
  const place = useRef<HTMLDivElement>(null);
  const [problem, setProblem] = useState("");
  const [isLoading, setLoading] = useState(true);
  useEffect(() => {
    let end = () => {};
    let isGone = false;
    import("../player/index")
      .then((player) => {
        if (isGone || !place.current) return;
        setLoading(false);
        end = mount(player, place.current);
      })
      .catch((reason: unknown) => setProblem(`The 3D view cannot be shown: ${String(reason)}`));
    return () => {
      isGone = true;
      end();
    };
  }, []);
  return (
    <>
      {problem && <p role="alert">{problem}</p>}
      {isLoading && !problem && <Waiting for="the 3D view" />}
      <div class={className} ref={place} />
    </>
  );
}

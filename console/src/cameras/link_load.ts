import { useRef, useState } from "preact/hooks";
import type { CameraLook } from "@api/camera_pb";
import type { RecordedTake } from "@api/takes_pb";

export interface CameraLoad {
  fps: number;
  megabitsPerS: number; // 0: the size of its frames is not known
  share: number; // of its link
  lost: number; // frames, since the take began
  resent: number; // packets
}

const GIGABIT = 1e9;
const WINDOW_MS = 2000;

/** Bits of a pixel by GenICam's name of its format: "BayerRG8", "Mono12p", "RGB8"; 0: compressed, or unknown. */
export function bitsOfPixel(format: string): number {
  const bits = Number(/(\d+)/.exec(format.replace(/^YUV4\d\d_?|^YCbCr4\d\d_?/, ""))?.[1] ?? 0);
  if (/^(RGB|BGR)/.test(format)) return 3 * bits;
  if (/^(YUV|YCbCr)/.test(format)) return 16;
  if (!/^(Mono|Bayer)/.test(format)) return 0;
  return /p$|Packed$/.test(format) ? bits : Math.ceil(bits / 8) * 8;
}

interface Sample {
  at_ms: number;
  frames: Map<string, number>;
}

/** Rates by camera, from two states of the recorder that are some seconds apart. */
export function useLinkLoads(looks: Map<string, CameraLook>): [Map<string, CameraLoad>, (take: RecordedTake) => void] {
  const samples = useRef<Sample[]>([]);
  const [loads, setLoads] = useState(new Map<string, CameraLoad>());
  const known = useRef(looks);
  known.current = looks;
  const add = (take: RecordedTake) => {
    const now_ms = Number((take.state?.updatedUnixNs ?? 0n) / 1_000_000n);
    const cameras = take.state?.cameras ?? [];
    const last = samples.current.at(-1);
    if (last && now_ms < last.at_ms) samples.current = [];
    samples.current.push({ at_ms: now_ms, frames: new Map(cameras.map((one) => [one.id, Number(one.framesReceived)])) });
    while (samples.current.length > 2 && samples.current[1]!.at_ms < now_ms - WINDOW_MS) samples.current.shift();
    const first = samples.current[0]!;
    const seconds = (now_ms - first.at_ms) / 1000;
    setLoads(
      new Map(
        cameras.map((one) => {
          const fps = seconds > 0 ? Math.max(0, Number(one.framesReceived) - (first.frames.get(one.id) ?? 0)) / seconds : 0;
          const seen = known.current.get(one.id)?.camera;
          const bits = seen ? seen.widthPx * seen.heightPx * bitsOfPixel(seen.pixelFormat) : 0;
          const load = fps * bits;
          return [
            one.id,
            { fps, megabitsPerS: load / 1e6, share: load / GIGABIT, lost: Number(one.framesLost), resent: Number(one.packetsResent) },
          ];
        }),
      ),
    );
  };
  return [loads, add];
}

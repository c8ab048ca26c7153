import { useEffect, useRef, useState } from "preact/hooks";
import type { RefObject } from "preact";
import type { Job } from "@api/job_pb";
import type { Client } from "../api/client";
import type { ApiError } from "../api/error";
import { useFrames } from "../pages/job";
import { Engine } from "./engine";

export interface JobInSpace {
  canvas: RefObject<HTMLCanvasElement>;
  engine: Engine | null;
  job: Job | undefined;
  error: ApiError | null;
  /** Why there is no engine; empty while there is none yet. */
  problem: string;
}

/** An engine for a job's meshes that lives as long as the canvas; `follows` and `mesh` as Engine has them. */
export function useEngine(client: Client, jobId: string, follows = false, mesh = ""): JobInSpace {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [engine, setEngine] = useState<Engine | null>(null);
  const [problem, setProblem] = useState("");
  const { job, frames, error } = useFrames(jobId);
  useEffect(() => {
    let made: Engine;
    try {
      made = new Engine(client, jobId, canvas.current!, follows, mesh);
    } catch (reason) {
      setProblem(`This browser shows nothing in 3D: ${String(reason)}`);
      return;
    }
    const observer = new ResizeObserver(() => made.resize());
    observer.observe(canvas.current!);
    setEngine(made);
    return () => {
      observer.disconnect();
      made.close();
    };
  }, []);
  useEffect(() => engine?.setFrames(frames), [engine, frames]);
  return { canvas, engine, job, error, problem };
}

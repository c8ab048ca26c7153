import { FrameState } from "@api/report_pb";
import { JobState } from "@api/job_pb";
import type { Job } from "@api/job_pb";
import { RecorderPhase } from "@api/recorder_pb";
import type { RecordedTake } from "@api/takes_pb";
import { Badge } from "./parts";
import type { Tone } from "./parts";

const JOB_STATES: Record<JobState, [Tone, string]> = {
  [JobState.UNSPECIFIED]: ["quiet", "unknown"],
  [JobState.QUEUED]: ["quiet", "waiting"],
  [JobState.RUNNING]: ["busy", "running"],
  [JobState.DONE]: ["good", "done"],
  [JobState.FAILED]: ["bad", "failed"],
  [JobState.CANCELLED]: ["quiet", "cancelled"],
};

export function JobStateBadge({ state }: { state: JobState }) {
  const [tone, text] = JOB_STATES[state];
  return <Badge tone={tone}>{text}</Badge>;
}

export function hasEnded(job: { state: JobState }): boolean {
  return job.state === JobState.DONE || job.state === JobState.FAILED || job.state === JobState.CANCELLED;
}

const PHASES: Record<RecorderPhase, [Tone, string]> = {
  [RecorderPhase.UNSPECIFIED]: ["quiet", "unknown"],
  [RecorderPhase.STARTING]: ["busy", "starting"],
  [RecorderPhase.RECORDING]: ["bad", "recording"],
  [RecorderPhase.ENDED]: ["good", "closed"],
  [RecorderPhase.FAILED]: ["bad", "failed"],
  [RecorderPhase.RECOVERED]: ["usable", "recovered"],
};

export function TakeBadge({ take }: { take: RecordedTake }) {
  const [tone, text] = PHASES[take.state?.phase ?? RecorderPhase.UNSPECIFIED];
  return <Badge tone={tone}>{text}</Badge>;
}

export function isRecording(take: RecordedTake): boolean {
  const phase = take.state?.phase;
  return phase === RecorderPhase.STARTING || phase === RecorderPhase.RECORDING;
}

export const FRAME_STATES: Record<FrameState, string> = {
  [FrameState.UNSPECIFIED]: "unknown",
  [FrameState.WAITING]: "waiting",
  [FrameState.RUNNING]: "running",
  [FrameState.DONE]: "registered",
  [FrameState.DEGRADED]: "registered without some cameras",
  [FrameState.FAILED]: "failed",
  [FrameState.CANCELLED]: "cancelled",
};

/** Share of a job's frames that were dealt with. */
export function shareDone(job: Job): number {
  const frames = job.frames;
  if (!frames?.total) return 0;
  return (frames.done + frames.degraded + frames.failed + frames.cancelled) / frames.total;
}

/** Of a path, or of "take:ID" and "library:NAME", which stay. */
export function shortName(input: string): string {
  const take = /\/takes\/([^/]+)\/take\/?$/.exec(input)?.[1];
  if (take) return `take ${take}`;
  return input.includes("/") ? input.replace(/\/+$/, "").split("/").slice(-2).join("/") : input;
}

/** What a job is of: its recording, or its kind and what that reads first. */
export function jobName(job: Job): string {
  const work = job.spec?.work;
  return work ? `${work.kind}: ${shortName(work.inputs[0]?.value ?? "")}` : shortName(job.spec?.dump ?? "");
}

/** What happened to a frame of a job that is done. */
export function doneWord(job: Job): string {
  if (job.spec?.work) return "done";
  return job.spec?.driving ? "driven" : "registered";
}

export function takeName(take: RecordedTake): string {
  return take.keeping?.slate || take.id;
}

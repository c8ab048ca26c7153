import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import type { FrameInfo, Job } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { ItemKind } from "@api/library_item_pb";
import { FrameState } from "@api/report_pb";
import { client, mayAs } from "../app_state";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { allFrames } from "../api/frames";
import { useAction, useWatch } from "../hooks";
import { useShortcuts } from "../keys";
import { hrefOf } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { durationText, percentText, timeText } from "../ui/format";
import { Facts, Failure, Page, Progress, VerdictBox, Waiting, Warnings } from "../ui/parts";
import { FRAME_STATES, JobStateBadge, doneWord, hasEnded, jobName, shareDone } from "../ui/states";
import { FramePanel } from "./frame";
import { OfJobDialog } from "./work_dialogs";
import { cancelQuestion } from "./jobs";

/** All frames of a job, kept up to date by its stream. */
export function useFrames(id: string): { job: Job | undefined; frames: FrameInfo[]; error: ApiError | null } {
  const [frames, setFrames] = useState<FrameInfo[]>([]);
  const [listError, setListError] = useState<ApiError | null>(null);
  const connections = client.live.connections.value;
  const news = useRef(new Map<string, FrameInfo>());
  const { value, error } = useWatch(Jobs.method.watchJob, { jobId: id }, (update) => {
    for (const frame of update.frames) news.current.set(frame.frame, frame);
    setFrames((known) => merged(known, news.current));
  });
  useEffect(() => {
    allFrames(client, id).then(
      (all) => setFrames(merged(all, news.current)),
      (reason: unknown) => setListError(asApiError(reason)),
    );
  }, [id, connections]);
  return { job: value?.job, frames, error: error ?? listError };
}

function merged(known: FrameInfo[], news: Map<string, FrameInfo>): FrameInfo[] {
  const names = new Set(known.map((frame) => frame.frame));
  const added = [...news.values()].filter((frame) => !names.has(frame.frame));
  return [...known.map((frame) => news.get(frame.frame) ?? frame), ...added];
}

/** A retried job is watched anew, since its stream ended with it. */
export function JobPage({ id }: { id: string }) {
  const [round, setRound] = useState(0);
  return <WatchedJob key={round} id={id} watchAgain={() => setRound(round + 1)} />;
}

function WatchedJob({ id, watchAgain }: { id: string; watchAgain: () => void }) {
  const { job, frames, error } = useFrames(id);
  const [chosen, setChosen] = useState<string | null>(null);
  const [question, setQuestion] = useState<Question | null>(null);
  const [dialog, setDialog] = useState<"export" | "evaluate" | null>(null);
  const action = useAction();
  const failing = frames.filter((frame) => frame.state === FrameState.FAILED);
  useShortcuts(
    [
      {
        keys: "f",
        text: "The next failing frame",
        run: () => {
          const at = failing.findIndex((frame) => frame.frame === chosen);
          setChosen(failing[(at + 1) % failing.length]?.frame ?? null);
        },
      },
    ],
    [failing.length, chosen],
  );
  if (!job) return error ? <Failure error={error} /> : <Waiting for={`job ${id}`} />;
  const counts = job.frames;
  const ended = hasEnded(job);
  const retry = () =>
    void action.run(async () => {
      await client.call(Jobs.method.retryJob, { jobId: id });
      watchAgain();
    });
  const chosenFrame = frames.find((frame) => frame.frame === chosen);
  return (
    <Page
      title={job.spec?.work ? jobName(job) : `Registration of ${jobName(job)}`}
      actions={
        <>
          <a href={hrefOf("jobs", id, "player")}>View in 3D</a>
          {ended && (
            <a target="_blank" rel="noopener" href={client.fileUrl(Jobs.method.fetchResult, { job_id: id, kind: "RESULT_KIND_JOB_REPORT" })}>
              Report
            </a>
          )}
          {ended && mayAs(Role.CLIENT) && (
            <>
              <button type="button" onClick={() => setDialog("export")}>
                Export
              </button>
              <button type="button" onClick={() => setDialog("evaluate")}>
                Evaluate
              </button>
              {(counts?.failed ?? 0) + (counts?.cancelled ?? 0) + (counts?.waiting ?? 0) > 0 && (
                <button type="button" disabled={action.busy} onClick={retry}>
                  Retry
                </button>
              )}
            </>
          )}
          {!ended && mayAs(Role.CLIENT) && (
            <button type="button" onClick={() => setQuestion(cancelQuestion(job, () => {}))}>
              Cancel
            </button>
          )}
        </>
      }
    >
      <Failure error={error} />
      <Failure error={action.error} />
      {job.message && <p class="panel">{job.message}</p>}
      <Warnings texts={job.warnings} />
      <VerdictBox verdict={job.verdict} />
      <Facts
        facts={[
          ["State", <JobStateBadge state={job.state} />],
          ["Progress", <Progress share={shareDone(job)} label="Frames done" />],
          ["Left", !ended && job.remainingS >= 0 && durationText(job.remainingS)],
          ["Frames", `${(counts?.done ?? 0) + (counts?.degraded ?? 0)} of ${counts?.total ?? 0} ${doneWord(job)}`],
          ["Failed", <span class={counts?.failed ? "bad-text" : ""}>{counts?.failed ?? 0}</span>],
          ["Kept from before", counts?.reused ? `${counts.reused}` : ""],
          ["Cloth that is seen", job.live && !job.spec?.driving ? percentText(job.live.coverage) : ""],
          ["Behind by", job.live?.following ? `${job.live.backlog} frames, ${durationText(job.live.latencyS)}` : ""],
          ["Submitted", `${timeText(job.createdUnixNs)} by ${job.submittedBy}`],
          ["Ended", timeText(job.finishedUnixNs)],
          ["Processor time", job.usage?.coreS ? durationText(job.usage.coreS) : ""],
          ...[...(job.spec?.work?.inputs ?? []), ...(job.spec?.work?.options ?? [])].map(({ name, value }): [string, ComponentChildren] => [name, <code>{value || "yes"}</code>]),
          ["Rig", job.spec?.rig && <Input kind={ItemKind.RIG} value={job.spec.rig} />],
          ["Template", job.spec?.garment && <Input kind={ItemKind.TEMPLATE} value={job.spec.garment} />],
          ["Avatar", job.spec?.driving ? <Input kind={ItemKind.AVATAR} value={job.spec.driving.avatar} /> : ""],
          ["Results", <code>{job.spec?.out}</code>],
        ]}
      />
      <h2>Frames</h2>
      <FrameStrip frames={frames} chosen={chosen} onChoose={setChosen} />
      {chosenFrame && <FramePanel key={chosenFrame.frame + chosenFrame.state} job={job} frame={chosenFrame} />}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
      {(dialog === "export" || dialog === "evaluate") && <OfJobDialog name={dialog} jobId={id} onClose={() => setDialog(null)} />}
    </Page>
  );
}

/** A path, or the item of the library that lies there. */
function Input({ kind, value }: { kind: ItemKind; value: string }) {
  const id = /\/library\/[a-z]+\/([0-9a-f]{64})\//.exec(value)?.[1];
  return id ? <a href={hrefOf("library", String(kind), id)}>library, {id.slice(0, 12)}</a> : <code>{value}</code>;
}

const CLASSES: Record<FrameState, string> = {
  [FrameState.UNSPECIFIED]: "waiting",
  [FrameState.WAITING]: "waiting",
  [FrameState.RUNNING]: "running",
  [FrameState.DONE]: "done",
  [FrameState.DEGRADED]: "degraded",
  [FrameState.FAILED]: "failed",
  [FrameState.CANCELLED]: "cancelled",
};

/** A cell per frame; the arrow keys go from one to the next. */
function FrameStrip({ frames, chosen, onChoose }: { frames: FrameInfo[]; chosen: string | null; onChoose: (frame: string) => void }) {
  const entry = chosen ?? frames.find((frame) => frame.state === FrameState.FAILED)?.frame ?? frames[0]?.frame;
  const step = (event: KeyboardEvent) => {
    const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const cells = [...(event.currentTarget as HTMLElement).querySelectorAll("button")];
    const next = cells[cells.indexOf(document.activeElement as HTMLButtonElement) + by];
    if (!by || !next) return;
    event.preventDefault();
    next.focus();
    next.click();
  };
  return (
    <div class="frames" role="group" aria-label="Frames" onKeyDown={step}>
      {frames.map((frame) => (
        <button
          type="button"
          key={frame.frame}
          class={`frame ${CLASSES[frame.state]}`}
          tabIndex={frame.frame === entry ? 0 : -1}
          aria-pressed={frame.frame === chosen}
          aria-label={`Frame ${frame.frame}: ${FRAME_STATES[frame.state]}${frame.bridged ? ", bridged" : ""}`}
          title={`${frame.frame}: ${FRAME_STATES[frame.state]}`}
          onClick={() => onChoose(frame.frame)}
        />
      ))}
    </div>
  );
}

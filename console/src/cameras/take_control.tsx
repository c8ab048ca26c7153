import { useEffect, useRef, useState } from "preact/hooks";
import { Jobs } from "@api/jobs_pb";
import type { CaptureSession } from "@api/sessions_pb";
import { Takes } from "@api/takes_pb";
import type { RecordedTake } from "@api/takes_pb";
import { client } from "../app_state";
import { newKey, useAction } from "../hooks";
import { useShortcuts } from "../keys";
import { hrefOf } from "../router";
import { bytesText, clockText, countText, durationText } from "../ui/format";
import { Failure, Progress } from "../ui/parts";
import { allowSound, isMuted, soundTick, switchSound } from "./alarm";
import type { Lease } from "./leases";

const COUNTDOWNS_S = [0, 3, 5, 10];
const LIVE_EVERY = 5;

/** "12A take 3" after "12A take 2": the number at the end counts takes. */
export function nextSlate(slate: string): string {
  return slate.replace(/(\d+)(?!.*\d)/, (number) => String(Number(number) + 1).padStart(number.length, "0"));
}

/** Starts a take after a countdown, shows how it goes, and stops it. */
export function TakeControl({ lease, session, take, alarmed, onStarted }: { lease: Lease; session: CaptureSession | undefined; take: RecordedTake | undefined; alarmed: Set<string>; onStarted: (id: string) => void }) {
  const [slate, setSlate] = useState("");
  const [notes, setNotes] = useState("");
  const [countdown, setCountdown] = useState(3);
  const [left, setLeft] = useState<number | null>(null);
  const [isFollowed, setFollowed] = useState(true);
  const action = useAction();
  const [failed, setFailed] = useState<string>(); // what of a take's beginning it was
  const timer = useRef<ReturnType<typeof setTimeout>>();
  useEffect(() => () => clearTimeout(timer.current), []);
  const canFollow = Boolean(session?.rig && session.board && session.garment);

  const begin = () =>
    void action.run(async () => {
      setFailed("The take did not begin");
      const started = await client.call(Takes.method.startTake, { recording: {}, lease: lease.lease, idempotencyKey: newKey() });
      onStarted(started.id);
      setFailed("The take runs, but its slate is not written down");
      if (slate || notes) await client.call(Takes.method.describeTake, { takeId: started.id, slate, notes });
      setSlate(nextSlate(slate));
      setNotes("");
      if (!canFollow || !isFollowed || !session) return;
      const { rig, board, garment } = session;
      setFailed("The take runs, but without live meshes");
      await client.call(Jobs.method.submitJob, {
        spec: { dump: `take:${started.id}`, rig, board, garment, liveEvery: LIVE_EVERY, options: { writeObservations: true } },
        idempotencyKey: newKey(),
      });
    });
  const count = (seconds: number) => {
    if (seconds <= 0) {
      setLeft(null);
      soundTick(true);
      begin();
      return;
    }
    setLeft(seconds);
    soundTick(false);
    timer.current = setTimeout(() => count(seconds - 1), 1000);
  };
  const start = () => {
    allowSound();
    if (left === null && !action.busy) count(countdown);
  };
  const cancel = () => {
    clearTimeout(timer.current);
    setLeft(null);
  };
  const stop = () => {
    setFailed(undefined);
    if (take) void action.run(() => client.call(Takes.method.stopTake, { takeId: take.id }));
  };
  useShortcuts(
    take
      ? [{ keys: "s", text: "Stop the take", run: stop }]
      : left !== null
        ? [{ keys: "s", text: "Cancel the countdown", run: cancel }]
        : [{ keys: "s", text: "Start a take", run: start }],
    [take?.id, left, slate, notes, countdown, isFollowed, canFollow, action.busy],
  );

  return (
    <section class="panel take-control" aria-label="Take">
      {take ? (
        <Running take={take} alarmed={alarmed} stop={stop} isBusy={action.busy} />
      ) : left !== null ? (
        <div class="countdown">
          <span class="count" role="timer" aria-live="assertive">
            {left}
          </span>
          <button type="button" onClick={cancel}>
            Cancel
          </button>
        </div>
      ) : (
        <form
          onSubmit={(event) => {
            event.preventDefault();
            start();
          }}
        >
          <label>
            Slate
            <input value={slate} maxLength={255} onInput={(event) => setSlate(event.currentTarget.value)} />
          </label>
          <label>
            Notes
            <input value={notes} maxLength={4096} onInput={(event) => setNotes(event.currentTarget.value)} />
          </label>
          <label>
            Countdown
            <select value={countdown} onChange={(event) => setCountdown(Number(event.currentTarget.value))}>
              {COUNTDOWNS_S.map((seconds) => (
                <option key={seconds} value={seconds}>
                  {seconds ? `${seconds} s` : "none"}
                </option>
              ))}
            </select>
          </label>
          {canFollow && (
            <label class="check">
              <input type="checkbox" checked={isFollowed} onChange={(event) => setFollowed(event.currentTarget.checked)} />
              Live meshes
            </label>
          )}
          <button class="main" disabled={action.busy} title="s">
            Start a take
          </button>
        </form>
      )}
      <button type="button" class="plain sound" aria-pressed={!isMuted.value} onClick={() => (allowSound(), switchSound())}>
        {isMuted.value ? "Sound is off" : "Sound is on"}
      </button>
      <Failure error={action.error} what={failed} />
    </section>
  );
}

function Running({ take, alarmed, stop, isBusy }: { take: RecordedTake; alarmed: Set<string>; stop: () => void; isBusy: boolean }) {
  const state = take.state;
  const lost = Number(state?.framesMissing ?? 0n) + Number(state?.setsDropped ?? 0n);
  return (
    <div class="running">
      <button type="button" class="grave" disabled={isBusy} onClick={stop} title="s">
        Stop
      </button>
      <span class="count recording">● {clockText(state?.elapsedS ?? 0)}</span>
      <span class="number">{countText(state?.setsRecorded ?? 0n)} sets</span>
      <span class={lost ? "number bad-text" : "number"} data-lost={lost}>
        {lost ? `${countText(lost)} frames or sets lost` : "nothing lost"}
      </span>
      <span role="alert" class="bad-text">
        {alarmed.size > 0 && `${[...alarmed].sort().join(", ")} lost a frame just now`}
      </span>
      <span class="number">{bytesText(state?.bytesWritten ?? 0n)}</span>
      {(state?.queuedBytes ?? 0n) > 0n && <span class="number">{bytesText(state!.queuedBytes)} wait for the disk</span>}
      {(state?.diskMinutesLeft ?? -1) >= 0 && <span class="number">disk lasts {durationText(60 * state!.diskMinutesLeft)}</span>}
      {take.live && (
        <span class="coverage">
          {take.live.coverage > 0 && (
            <>
              cloth seen <Progress share={take.live.coverage} label="Cloth that is seen" />
            </>
          )}
          <small>{durationText(take.live.latencyS)} behind</small>
        </span>
      )}
      <a href={hrefOf("takes", take.id)}>{take.keeping?.slate || take.id}</a>
    </div>
  );
}

import { useEffect, useRef, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { CaptureSessionState, Sessions } from "@api/sessions_pb";
import type { CaptureSession } from "@api/sessions_pb";
import { Takes } from "@api/takes_pb";
import type { RecordedTake } from "@api/takes_pb";
import { client, mayAs } from "../app_state";
import { soundAlarm } from "../cameras/alarm";
import { CameraDetail } from "../cameras/camera_detail";
import { CameraTile } from "../cameras/camera_tile";
import { keepLease, leaseEnded, ownLease } from "../cameras/leases";
import { LinkBoard } from "../cameras/link_board";
import { useLinkLoads } from "../cameras/link_load";
import { detailIsOpen, useLooks } from "../cameras/looks";
import { SessionDialog } from "../cameras/session_dialog";
import { TakeControl } from "../cameras/take_control";
import { useCall, useWatch } from "../hooks";
import { useShortcuts } from "../keys";
import { hrefOf } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { durationText } from "../ui/format";
import { InThreeD } from "../ui/in_three_d";
import { Failure, Page, Table } from "../ui/parts";
import { isRecording } from "../ui/states";

const ALARM_MS = 8000; // that a camera stands in colour after it lost a frame

export function CamerasPage() {
  const { value, error } = useCall(Sessions.method.listSessions, { limit: 20 }, 2500);
  const takes = useCall(Takes.method.listTakes, { limit: 10 }, 1500);
  const [dialog, setDialog] = useState(false);
  const [question, setQuestion] = useState<Question | null>(null);
  const open = (value?.sessions ?? []).filter((session) => session.state === CaptureSessionState.OPEN);
  const lease = ownLease.value;
  const own = lease ? open.find((session) => session.id === lease.sessionId) : undefined;
  const running = (takes.value?.takes ?? []).filter(isRecording);
  const ofSession = running.find((take) => take.sessionId === lease?.sessionId);
  const mayFilm = mayAs(Role.OPERATOR);
  useShortcuts(mayFilm && !lease ? [{ keys: "n", text: "Open a session", run: () => setDialog(true) }] : [], [mayFilm, !lease]);
  const close = () =>
    setQuestion({
      title: "Close the session?",
      text: <p>Its cameras are free for others then. A take that runs goes on.</p>,
      verb: "Close the session",
      run: async () => {
        if (lease) await client.call(Sessions.method.closeSession, { lease: lease.lease });
        keepLease(null);
      },
    });
  return (
    <Page
      title="Cameras"
      actions={
        mayFilm &&
        (lease ? (
          <button type="button" onClick={close}>
            Close the session
          </button>
        ) : (
          <button type="button" class="main" title="n" onClick={() => setDialog(true)}>
            Open a session
          </button>
        ))
      }
    >
      <Failure error={error} />
      <Failure error={leaseEnded.value} what="This session has ended" />
      {!mayFilm && <p class="panel">Your role lets you look at takes, not at cameras: those need the role operator.</p>}
      {lease && mayFilm && <Filming key={lease.sessionId} session={own} take={ofSession} />}
      <OtherSessions sessions={open.filter((session) => session !== own)} />
      {!lease &&
        running.map((take) => (
          <p key={take.id} class="panel">
            <span class="recording">●</span> <a href={hrefOf("takes", take.id)}>{take.keeping?.slate || take.id}</a> is being recorded
          </p>
        ))}
      {dialog && <SessionDialog onClose={() => setDialog(false)} />}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
    </Page>
  );
}

function OtherSessions({ sessions }: { sessions: CaptureSession[] }) {
  if (!sessions.length) return null;
  return (
    <>
      <h2>Sessions of others</h2>
      <Table label="Sessions of others" head={["whose", "cameras", "lasts without them for"]}>
        {sessions.map((session) => (
          <tr key={session.id}>
            <td>{session.owner}</td>
            <td>{session.cameras?.cameras.map((camera) => camera.id).join(", ")}</td>
            <td class="number">{durationText(session.remainingS)}</td>
          </tr>
        ))}
      </Table>
    </>
  );
}

/** Which cameras lost a frame just now, by what the take's stream says. */
function useAlarms(): [Set<string>, (take: RecordedTake) => void] {
  const [alarmed, setAlarmed] = useState(new Set<string>());
  const lost = useRef<{ take: string; total: number }>({ take: "", total: 0 });
  const timers = useRef(new Set<ReturnType<typeof setTimeout>>());
  useEffect(() => () => timers.current.forEach(clearTimeout), []);
  const look = (take: RecordedTake) => {
    const total = Number(take.state?.framesMissing ?? 0n) + Number(take.state?.setsDropped ?? 0n);
    const isKnown = lost.current.take === take.id;
    const grew = total > (isKnown ? lost.current.total : 0);
    lost.current = { take: take.id, total };
    if (!grew) return;
    const cameras = new Set(take.events.filter(({ event }) => event === "missing" || event === "dropped").map(({ camera }) => camera));
    const all = cameras.has("") ? (take.state?.cameras ?? []).map(({ id }) => id) : [...cameras];
    soundAlarm();
    setAlarmed((known) => new Set([...known, ...all]));
    const timer = setTimeout(() => {
      timers.current.delete(timer);
      setAlarmed((known) => new Set([...known].filter((id) => !all.includes(id))));
    }, ALARM_MS);
    timers.current.add(timer);
  };
  return [alarmed, look];
}

function Filming({ session, take: listed }: { session: CaptureSession | undefined; take: RecordedTake | undefined }) {
  const lease = ownLease.value!;
  const [startedId, setStartedId] = useState<string | null>(null);
  const [detail, setDetail] = useState<string | null>(null);
  const [alarmed, lookForLosses] = useAlarms();
  const takeId = listed?.id ?? startedId;
  const told = (take: RecordedTake) => {
    lookForLosses(take);
    addLoad(take);
  };
  const { value: watched, error } = useWatch(Takes.method.watchTake, takeId ? { takeId } : null, (take) => told(take));
  const take = watched && isRecording(watched) ? watched : undefined;
  const hasBegun = Boolean(take?.state?.setsRecorded);
  // Cameras of a take that begins are busy; afterwards its newest frame set is what they see.
  const request = take ? (hasBegun ? { takeId: take.id } : null) : takeId && !watched ? null : { lease: lease.lease };
  const { looks, error: lookError } = useLooks(request, detailIsOpen.value);
  const [loads, addLoad] = useLinkLoads(looks);
  const ids = session?.cameras?.cameras.map((camera) => camera.id) ?? [...looks.keys()];
  return (
    <>
      <TakeControl lease={lease} session={session} take={take} alarmed={alarmed} onStarted={setStartedId} />
      <Failure error={error} />
      {!take && <Failure error={lookError} what="The cameras cannot be looked at" />}
      {watched && !take && watched.state?.message && <p class="panel">The take ended: {watched.state.message}</p>}
      <div class={take?.liveJobId ? "beside" : ""}>
        <div class="cameras">
          {ids.map((id) => (
            <CameraTile key={id} id={id} look={looks.get(id)} load={take ? loads.get(id) : undefined} isAlarmed={alarmed.has(id)} isOld={!take && lookError !== null} onOpen={() => setDetail(id)} />
          ))}
        </div>
        {take?.liveJobId && <InThreeD key={take.liveJobId} mount={(player, element) => player.mountLive(element, client, take.liveJobId)} />}
      </div>
      {take && <LinkBoard take={take} loads={loads} looks={looks} />}
      {detail && request && <CameraDetail id={detail} request={request} session={session} isFilming={Boolean(take)} onClose={() => setDetail(null)} />}
    </>
  );
}

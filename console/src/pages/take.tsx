import { useEffect, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import type { RecorderCamera } from "@api/recorder_pb";
import { Takes } from "@api/takes_pb";
import type { RecordedTake, TakeEvent } from "@api/takes_pb";
import { client, mayAs } from "../app_state";
import { useAction, useWatch } from "../hooks";
import { useShortcuts } from "../keys";
import { go, hrefOf } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { bytesText, clockText, countText, durationText, percentText, timeText } from "../ui/format";
import { Facts, Failure, Page, Table, Waiting, Warnings } from "../ui/parts";
import { TakeBadge, isRecording, takeName } from "../ui/states";
import { deleteQuestion } from "./takes";
import { RegisterDialog } from "./register";
import { TakeLedger } from "./take_ledger";

const MOST_EVENTS = 500; // that a page keeps of a take that runs overnight

/** A take, live while it is recorded. */
export function TakePage({ id }: { id: string }) {
  const [events, setEvents] = useState<TakeEvent[]>([]);
  const [changed, setChanged] = useState<RecordedTake>();
  const [question, setQuestion] = useState<Question | null>(null);
  const [registers, setRegisters] = useState(false);
  const action = useAction();
  const connections = client.live.connections.value;
  // A new connection tells the newest events again.
  useEffect(() => setEvents([]), [id, connections]);
  const { value, error } = useWatch(Takes.method.watchTake, { takeId: id }, (take) => {
    setChanged(undefined);
    if (take.events.length) setEvents((known) => [...known, ...take.events].slice(-MOST_EVENTS));
  });
  const take = changed && value ? { ...value, keeping: changed.keeping, state: changed.state ?? value.state } : value;
  const isLive = take ? isRecording(take) : false;
  const stop = () => void action.run(() => client.call(Takes.method.stopTake, { takeId: id }));
  const pin = () =>
    void action.run(async () =>
      setChanged(await client.call(Takes.method.pinTake, { takeId: id, pinned: !take?.keeping?.pinned })),
    );
  useShortcuts(
    [
      ...(mayAs(Role.OPERATOR) && isLive ? [{ keys: "s", text: "Stop the take", run: stop }] : []),
      ...(mayAs(Role.CLIENT) ? [{ keys: "r", text: "Register the take", run: () => setRegisters(true) }] : []),
      ...(mayAs(Role.OPERATOR) ? [{ keys: "p", text: "Pin or unpin the take", run: pin }] : []),
    ],
    [isLive, take?.keeping?.pinned],
  );
  if (!take) return error ? <Failure error={error} /> : <Waiting for={`take ${id}`} />;
  const state = take.state;
  return (
    <Page
      title={takeName(take)}
      actions={
        <>
          {mayAs(Role.CLIENT) && (
            <button type="button" class="main" onClick={() => setRegisters(true)}>
              Register
            </button>
          )}
          {mayAs(Role.OPERATOR) && (
            <>
              {isLive && (
                <button type="button" class="grave" disabled={action.busy} onClick={stop}>
                  Stop
                </button>
              )}
              <button type="button" aria-pressed={take.keeping?.pinned ?? false} onClick={pin}>
                {take.keeping?.pinned ? "Unpin" : "Pin"}
              </button>
              {!isLive && (
                <button type="button" disabled={take.keeping?.pinned} onClick={() => setQuestion(deleteQuestion(take, () => go("takes")))}>
                  Delete
                </button>
              )}
            </>
          )}
        </>
      }
    >
      <Failure error={action.error} />
      <Failure error={error} />
      <Warnings texts={state?.warnings} />
      {state?.message && <p class="panel">{state.message}</p>}
      <Facts
        facts={[
          ["State", <TakeBadge take={take} />],
          ["Timecode", take.timecode],
          ["Length", clockText(state?.elapsedS ?? 0)],
          ["Frame sets", countText(state?.setsRecorded ?? 0n)],
          ["Sets dropped", <Count of={state?.setsDropped ?? 0n} />],
          ["Frames missing", <Count of={state?.framesMissing ?? 0n} />],
          ["Size", bytesText(state?.bytesWritten ?? 0n)],
          ["Waits for the disk", isLive && bytesText(state?.queuedBytes ?? 0n)],
          ["Disk lasts", isLive && (state?.diskMinutesLeft ?? -1) >= 0 && durationText(60 * (state?.diskMinutesLeft ?? 0))],
          ["Live registration", take.liveJobId && <a href={hrefOf("jobs", take.liveJobId)}>{take.liveJobId}</a>],
          ["Cloth that is seen", take.live?.coverage ? percentText(take.live.coverage) : ""],
          ["Behind by", take.live ? `${take.live.backlog} frames, ${durationText(take.live.latencyS)}` : ""],
          ["Folder", <code>{take.folder}</code>],
        ]}
      />
      <Notes take={take} onSaved={setChanged} />
      <CameraCounts cameras={state?.cameras ?? []} />
      <h2>Ledger</h2>
      <Events events={events} />
      {!isLive && <TakeLedger id={id} />}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
      {registers && <RegisterDialog take={take} onClose={() => setRegisters(false)} />}
    </Page>
  );
}

function Count({ of: count }: { of: bigint }) {
  return <span class={count > 0n ? "bad-text" : ""}>{countText(count)}</span>;
}

function CameraCounts({ cameras }: { cameras: RecorderCamera[] }) {
  if (!cameras.length) return null;
  return (
    <Table label="Cameras" head={["camera", "frames", "lost", "packets asked for again", "packets missing", "disconnected", "came back"]}>
      {cameras.map((camera) => (
        <tr key={camera.id}>
          <td>{camera.id}</td>
          <td class="number">{countText(camera.framesReceived)}</td>
          {[camera.framesLost, camera.packetsResent, camera.packetsMissing, camera.disconnections, camera.reconnections].map((count, i) => (
            <td key={i} class={count > 0n && i !== 1 && i !== 4 ? "number bad-text" : "number"}>
              {countText(count)}
            </td>
          ))}
        </tr>
      ))}
    </Table>
  );
}

const EVENTS: Record<string, string> = { missing: "frame missing", dropped: "set dropped", note: "note", end: "end" };

export function Events({ events }: { events: TakeEvent[] }) {
  if (!events.length) return <p class="empty">Nothing but recorded frame sets.</p>;
  return (
    <Table label="Ledger" head={["when", "what", "camera", "sets", "why"]}>
      {events.toReversed().map((event, i) => (
        <tr key={events.length - i} class={event.event === "missing" || event.event === "dropped" ? "bad" : ""}>
          <td class="number">{timeText(event.noticedUnixNs)}</td>
          <td>{EVENTS[event.event] ?? event.event}</td>
          <td>{event.camera}</td>
          <td class="number">
            {event.firstSet === event.lastSet ? countText(event.firstSet) : `${countText(event.firstSet)} to ${countText(event.lastSet)}`}
          </td>
          <td>{event.cause}</td>
        </tr>
      ))}
    </Table>
  );
}

function Notes({ take, onSaved }: { take: RecordedTake; onSaved: (take: RecordedTake) => void }) {
  const [slate, setSlate] = useState(take.keeping?.slate ?? "");
  const [name, setName] = useState(take.keeping?.name ?? "");
  const [notes, setNotes] = useState(take.keeping?.notes ?? "");
  const action = useAction();
  const said = take.keeping;
  const isChanged = slate !== (said?.slate ?? "") || name !== (said?.name ?? "") || notes !== (said?.notes ?? "");
  if (!mayAs(Role.OPERATOR)) return take.keeping?.notes ? <p class="notes">{take.keeping.notes}</p> : null;
  return (
    <form
      class="panel"
      onSubmit={(event) => {
        event.preventDefault();
        void action.run(async () => onSaved(await client.call(Takes.method.describeTake, { takeId: take.id, slate, name, notes })));
      }}
    >
      <label>
        Slate
        <input value={slate} maxLength={255} onInput={(event) => setSlate(event.currentTarget.value)} />
      </label>
      <label>
        Name
        <input value={name} maxLength={255} onInput={(event) => setName(event.currentTarget.value)} />
      </label>
      <label>
        Notes
        <textarea rows={3} maxLength={4096} value={notes} onInput={(event) => setNotes(event.currentTarget.value)} />
      </label>
      <Failure error={action.error} />
      <button disabled={!isChanged || action.busy}>Save</button>
    </form>
  );
}

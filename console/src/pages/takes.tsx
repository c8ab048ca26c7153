import { useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { Takes } from "@api/takes_pb";
import type { RecordedTake } from "@api/takes_pb";
import { client, mayAs } from "../app_state";
import { useCall } from "../hooks";
import { useShortcuts } from "../keys";
import { hrefOf, route } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { bytesText, countText, clockText, timeText } from "../ui/format";
import { Badge, Failure, Page, Table, Waiting, Warnings } from "../ui/parts";
import { TakeBadge, isRecording, takeName } from "../ui/states";
import { TakePage } from "./take";

export function TakesPage() {
  const [, id] = route.value;
  if (id === "trash") return <TakeList trash />;
  return id ? <TakePage key={id} id={id} /> : <TakeList trash={false} />;
}

/** What deletes a take asks first, and says how it comes back. */
export function deleteQuestion(take: RecordedTake, then: () => void): Question {
  return {
    title: `Delete ${takeName(take)}?`,
    text: (
      <p>
        {bytesText(take.state?.bytesWritten ?? 0n)} go to the trash. From there the take can be brought back until the trash is emptied
        or the daemon's retention clears it away.
      </p>
    ),
    verb: "Move to the trash",
    isGrave: true,
    run: async () => {
      await client.call(Takes.method.deleteTake, { takeId: take.id });
      then();
    },
  };
}

function TakeList({ trash }: { trash: boolean }) {
  const [words, setWords] = useState("");
  const { value, error, reload } = useCall(Takes.method.listTakes, { trash, limit: 200, words }, 2000);
  const [question, setQuestion] = useState<Question | null>(null);
  useShortcuts([{ keys: "T", text: "Takes or their trash", run: () => (location.hash = hrefOf("takes", ...(trash ? [] : ["trash"]))) }], [trash]);
  const takes = value?.takes ?? [];
  return (
    <Page
      title={trash ? "Trash" : "Takes"}
      actions={
        <>
          {trash && mayAs(Role.ADMIN) && takes.length > 0 && (
            <button type="button" class="grave" onClick={() => setQuestion(emptyQuestion(takes, reload))}>
              Empty the trash
            </button>
          )}
          <a href={trash ? hrefOf("takes") : hrefOf("takes", "trash")}>{trash ? "Takes" : "Trash"}</a>
        </>
      }
    >
      <Failure error={error} />
      <Warnings texts={value?.warnings} />
      <input
        type="search"
        aria-label="Search takes"
        placeholder="Slate, name, notes, timecode"
        maxLength={255}
        value={words}
        onInput={(event) => setWords(event.currentTarget.value)}
      />
      {!value && !error && <Waiting for="the takes" />}
      {value && takes.length === 0 && words && <p class="empty">No take has these words.</p>}
      {value && takes.length === 0 && !words && <p class="empty">{trash ? "The trash is empty." : "No take yet. Start one on the page Cameras."}</p>}
      {takes.length > 0 && (
        <Table label="Takes" head={["take", "state", "began", "length", "frame sets", "frames missing", "size", ""]}>
          {takes.map((take) => (
            <TakeRow key={take.id} take={take} trash={trash} ask={setQuestion} reload={reload} />
          ))}
        </Table>
      )}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
    </Page>
  );
}

function TakeRow({ take, trash, ask, reload }: { take: RecordedTake; trash: boolean; ask: (q: Question) => void; reload: () => void }) {
  const state = take.state;
  const missing = Number(state?.framesMissing ?? 0n) + Number(state?.setsDropped ?? 0n);
  const began = state && state.updatedUnixNs > 0n ? state.updatedUnixNs - BigInt(Math.round(state.elapsedS * 1e9)) : 0n;
  return (
    <tr>
      <td>
        {trash ? takeName(take) : <a class="row" href={hrefOf("takes", take.id)}>{takeName(take)}</a>}
        {take.keeping?.slate && <small> {take.id}</small>} {take.keeping?.name} {take.timecode && <small>{take.timecode}</small>} {take.keeping?.pinned && <Badge tone="busy">pinned</Badge>}
      </td>
      <td>
        <TakeBadge take={take} />
      </td>
      <td class="number">{timeText(began)}</td>
      <td class="number">{clockText(state?.elapsedS ?? 0)}</td>
      <td class="number">{countText(state?.setsRecorded ?? 0n)}</td>
      <td class={missing ? "number bad-text" : "number"}>{countText(missing)}</td>
      <td class="number">{bytesText(state?.bytesWritten ?? 0n)}</td>
      <td class="actions end">
        {mayAs(Role.OPERATOR) && trash && (
          <button
            type="button"
            onClick={() =>
              ask({
                title: `Bring ${takeName(take)} back?`,
                text: <p>It was deleted {timeText(take.keeping?.deletedUnixNs ?? 0n)}: {take.keeping?.deletedBecause}.</p>,
                verb: "Bring it back",
                run: () => client.call(Takes.method.restoreTake, { takeId: take.id }).then(reload),
              })
            }
          >
            Restore
          </button>
        )}
        {mayAs(Role.OPERATOR) && !trash && !isRecording(take) && (
          <button type="button" disabled={take.keeping?.pinned} aria-label={`Delete ${takeName(take)}`} onClick={() => ask(deleteQuestion(take, reload))}>
            Delete
          </button>
        )}
      </td>
    </tr>
  );
}

function emptyQuestion(takes: RecordedTake[], reload: () => void): Question {
  return {
    title: "Empty the trash?",
    text: <p>{takes.length} takes are removed for good. Nothing brings them back.</p>,
    verb: "Remove for good",
    isGrave: true,
    run: () => client.call(Takes.method.emptyTrash, {}).then(reload),
  };
}

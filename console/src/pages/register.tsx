import { useEffect, useState } from "preact/hooks";
import { Jobs } from "@api/jobs_pb";
import { ItemKind } from "@api/library_item_pb";
import { Sessions } from "@api/sessions_pb";
import type { RecordedTake } from "@api/takes_pb";
import { client } from "../app_state";
import { newKey, useAction } from "../hooks";
import { go } from "../router";
import { Dialog, FormEnd } from "../ui/dialog";
import { InputField } from "../ui/inputs";
import { isRecording, takeName } from "../ui/states";

const LAST = "weft.inputs"; // of the browser's last registration; paths and names alone

export interface JobInputs {
  rig: string;
  board: string;
  garment: string;
}

export function lastInputs(): JobInputs {
  const none = { rig: "", board: "", garment: "" };
  try {
    return { ...none, ...JSON.parse(localStorage.getItem(LAST) ?? "{}") };
  } catch {
    return none;
  }
}

export function keepInputs(inputs: JobInputs): void {
  localStorage.setItem(LAST, JSON.stringify(inputs));
}

/** Submits a job for a take; one that is still recorded is followed. */
export function RegisterDialog({ take, onClose }: { take: RecordedTake; onClose: () => void }) {
  const [inputs, setInputs] = useState(lastInputs);
  const [frames, setFrames] = useState("");
  const [every, setEvery] = useState("5");
  const [keepsCells, setKeepsCells] = useState(true);
  const [priority, setPriority] = useState("0");
  const [key] = useState(newKey);
  const action = useAction();
  const isLive = isRecording(take);
  useEffect(() => {
    if (!take.sessionId) return;
    client.call(Sessions.method.getSession, { sessionId: take.sessionId }).then(
      ({ rig, board, garment }) => setInputs((known) => ({ rig: rig || known.rig, board: board || known.board, garment: garment || known.garment })),
      () => {},
    );
  }, [take.sessionId]);

  const submit = async () => {
    keepInputs(inputs);
    const job = await client.call(Jobs.method.submitJob, {
      spec: {
        dump: `take:${take.id}`,
        ...inputs,
        frames: isLive ? "" : frames.trim(),
        liveEvery: isLive ? Number(every) : 0,
        options: { writeObservations: keepsCells },
      },
      priority: Number(priority),
      idempotencyKey: key,
    });
    go("jobs", job.id);
  };
  const field = (name: keyof JobInputs) => (value: string) => setInputs({ ...inputs, [name]: value });
  return (
    <Dialog title={`Register ${takeName(take)}`} onClose={onClose}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void action.run(submit);
        }}
      >
        <InputField label="Rig" kind={ItemKind.RIG} value={inputs.rig} onChange={field("rig")} required />
        <InputField label="Board" kind={ItemKind.BOARD} value={inputs.board} onChange={field("board")} required />
        <InputField label="Template" kind={ItemKind.TEMPLATE} value={inputs.garment} onChange={field("garment")} required />
        {isLive ? (
          <label>
            Of the frame sets, while they are recorded, register one in
            <input type="number" min={1} required value={every} onInput={(event) => setEvery(event.currentTarget.value)} />
          </label>
        ) : (
          <label>
            Frames, “0003:0010”; empty: all
            <input value={frames} spellcheck={false} onInput={(event) => setFrames(event.currentTarget.value)} />
          </label>
        )}
        <label>
          Priority, −100 to 100
          <input type="number" min={-100} max={100} required value={priority} onInput={(event) => setPriority(event.currentTarget.value)} />
        </label>
        <label class="check">
          <input type="checkbox" checked={keepsCells} onChange={(event) => setKeepsCells(event.currentTarget.checked)} />
          Keep the decoded cells, to draw them over pictures
        </label>
        <FormEnd action={action} verb={isLive ? "Follow the take" : "Register"} onClose={onClose} />
      </form>
    </Dialog>
  );
}

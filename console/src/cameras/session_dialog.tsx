import { clone, create, fromJsonString } from "@bufbuild/protobuf";
import { useEffect, useState } from "preact/hooks";
import type { ListedCamera } from "@api/camera_pb";
import { Cameras } from "@api/cameras_pb";
import { ItemKind } from "@api/library_item_pb";
import { SessionCameraSchema, SessionSchema } from "@api/session_pb";
import type { Session, SessionCamera } from "@api/session_pb";
import { Sessions } from "@api/sessions_pb";
import { client, user } from "../app_state";
import { ApiError } from "../api/error";
import { newKey, useAction, useCall } from "../hooks";
import { Dialog, FormEnd } from "../ui/dialog";
import { InputField } from "../ui/inputs";
import { Failure, Table, Waiting } from "../ui/parts";
import { keepInputs, lastInputs } from "../pages/register";
import { keepLease, lastCameras } from "./leases";

const LEASE_S = 120;
const FPS = 30;

function deviceOf(camera: SessionCamera): string {
  return camera.gige?.device ?? camera.v4l2?.device ?? camera.replay?.take ?? "";
}

function asSessionCamera(listed: ListedCamera, id: string): SessionCamera {
  const device = { device: listed.device };
  return create(SessionCameraSchema, listed.kind === "v4l2" ? { id, v4l2: device } : { id, gige: device });
}

export function openSession(cameras: Session, inputs: { rig: string; board: string; garment: string }, takeOver: boolean) {
  const owner = /\((.*)\)/.exec(user.value?.caller ?? "")?.[1] ?? user.value?.caller ?? "";
  return client
    .call(Sessions.method.openSession, { cameras, ...inputs, owner: `${owner} at the console`, leaseS: LEASE_S, takeOver, idempotencyKey: newKey() })
    .then(keepLease);
}

/** Which cameras, and for what registrations. The last choice of this browser, or a session.json, is where it begins. */
export function SessionDialog({ onClose }: { onClose: () => void }) {
  const listed = useCall(Cameras.method.listCameras, {});
  const [session, setSession] = useState<Session>(() => lastCameras() ?? create(SessionSchema, { fps: FPS }));
  const [inputs, setInputs] = useState(lastInputs);
  const [takeOver, setTakeOver] = useState(false);
  const action = useAction();
  const chosen = new Set(session.cameras.map(deviceOf));
  // A browser that never had a session begins with all cameras.
  useEffect(() => {
    const cameras = listed.value?.cameras ?? [];
    if (session.cameras.length || !cameras.length) return;
    const free = cameras.filter((camera) => !camera.problem && !camera.usedBy);
    change({ cameras: free.map((camera, i) => asSessionCamera(camera, `c${String(i).padStart(2, "0")}`)) });
  }, [listed.value]);

  const change = (fields: Partial<Session>) => setSession((known) => Object.assign(clone(SessionSchema, known), fields));
  const toggle = (camera: ListedCamera, on: boolean) => {
    const others = session.cameras.filter((one) => deviceOf(one) !== camera.device);
    const ids = new Set(others.map((one) => one.id));
    let number = others.length;
    while (ids.has(`c${String(number).padStart(2, "0")}`)) ++number;
    change({ cameras: on ? [...others, asSessionCamera(camera, `c${String(number).padStart(2, "0")}`)] : others });
  };
  const rename = (camera: SessionCamera, id: string) =>
    change({ cameras: session.cameras.map((one) => (one === camera ? { ...one, id } : one)) });
  const readFile = (file: File | undefined) =>
    void action.run(async () => {
      if (!file) return;
      try {
        setSession(fromJsonString(SessionSchema, await file.text(), { ignoreUnknownFields: true }));
      } catch (reason) {
        throw new ApiError("INVALID_ARGUMENT", `${file.name}: ${String(reason)}`, "", "choose a session.json");
      }
    });
  const open = () =>
    void action.run(async () => {
      keepInputs(inputs);
      await openSession(session, inputs, takeOver);
      onClose();
    });
  const input = (name: keyof typeof inputs) => (value: string) => setInputs({ ...inputs, [name]: value });
  const unlisted = session.cameras.filter((camera) => !listed.value?.cameras.some((one) => one.device === deviceOf(camera)));

  return (
    <Dialog title="Open a session" onClose={onClose} wide>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          open();
        }}
      >
        <Failure error={listed.error} what="The cameras cannot be listed" />
        {!listed.value && !listed.error && <Waiting for="the cameras" />}
        {listed.value?.cameras.length === 0 && <p class="empty">No camera answers on the daemon's machine and network.</p>}
        <Table label="Cameras" head={["film with it", "name in the rig", "device", "model", "used by"]}>
          {(listed.value?.cameras ?? []).map((camera) => {
            const ours = session.cameras.find((one) => deviceOf(one) === camera.device);
            return (
              <tr key={camera.device}>
                <td>
                  <input type="checkbox" aria-label={`Film with ${camera.device}`} checked={chosen.has(camera.device)} onChange={(event) => toggle(camera, event.currentTarget.checked)} />
                </td>
                <td>{ours && <input required aria-label={`Name of ${camera.device} in the rig`} value={ours.id} onInput={(event) => rename(ours, event.currentTarget.value)} />}</td>
                <td>{camera.device}</td>
                <td>
                  {camera.model} {camera.problem && <span class="bad-text">{camera.problem}</span>}
                </td>
                <td>{camera.usedBy}</td>
              </tr>
            );
          })}
          {listed.value &&
            unlisted.map((camera) => (
              <tr key={deviceOf(camera)}>
                <td>
                  <input type="checkbox" checked aria-label={`Film with ${deviceOf(camera)}`} onChange={() => change({ cameras: session.cameras.filter((one) => one !== camera) })} />
                </td>
                <td>{camera.id}</td>
                <td>{deviceOf(camera)}</td>
                <td class="bad-text">{camera.replay ? "a recorded take" : "does not answer by this name"}</td>
                <td />
              </tr>
            ))}
        </Table>
        <div class="columns">
          <label>
            Frame sets per second; 0: as the cameras are set
            <input type="number" min={0} step="any" required value={session.fps} onInput={(event) => change({ fps: Number(event.currentTarget.value) })} />
          </label>
          <label>
            From a file instead (session.json)
            <input type="file" accept=".json,application/json" onChange={(event) => readFile(event.currentTarget.files?.[0])} />
          </label>
          <InputField label="Rig" kind={ItemKind.RIG} value={inputs.rig} onChange={input("rig")} />
          <InputField label="Board" kind={ItemKind.BOARD} value={inputs.board} onChange={input("board")} />
          <InputField label="Template" kind={ItemKind.TEMPLATE} value={inputs.garment} onChange={input("garment")} />
        </div>
        <label class="check">
          <input type="checkbox" checked={takeOver} onChange={(event) => setTakeOver(event.currentTarget.checked)} />
          Take the cameras over from other sessions; takes that run go on
        </label>
        <FormEnd action={action} verb="Open the session" onClose={onClose} disabled={session.cameras.length === 0} />
      </form>
    </Dialog>
  );
}

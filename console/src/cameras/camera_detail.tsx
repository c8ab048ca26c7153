import { clone } from "@bufbuild/protobuf";
import { useEffect, useState } from "preact/hooks";
import { SessionSchema } from "@api/session_pb";
import type { CaptureSession } from "@api/sessions_pb";
import { useAction } from "../hooks";
import { Dialog } from "../ui/dialog";
import { percentText } from "../ui/format";
import { Failure, Table, Waiting } from "../ui/parts";
import { usePicture } from "./camera_tile";
import { Histogram } from "./histogram";
import { detailIsOpen, useLooks } from "./looks";
import type { LookRequest } from "./looks";
import { openSession } from "./session_dialog";

const WHOLE_WIDTH_PX = 4096; // what the daemon gives at most
// Of GenICam's standard features and of V4L2's controls; what a camera has of them can be set here.
const SETTINGS = ["ExposureTime", "ExposureTimeAbs", "Gain", "GainRaw", "Width", "Height", "OffsetX", "OffsetY", "Exposure Time, Absolute"];

/** One camera at full size, its settings, and what changes them. */
export function CameraDetail({ id, request, session, isFilming, onClose }: { id: string; request: LookRequest; session: CaptureSession | undefined; isFilming: boolean; onClose: () => void }) {
  const [isWhole, setWhole] = useState(false);
  const { looks, error } = useLooks({ ...request, cameraId: id, widthPx: WHOLE_WIDTH_PX });
  const look = looks.get(id);
  const { canvas, bins } = usePicture(look);
  useEffect(() => {
    detailIsOpen.value = true;
    return () => {
      detailIsOpen.value = false;
    };
  }, []);
  const settings = Object.entries(look?.camera?.settings ?? {}).sort();
  return (
    <Dialog title={`Camera ${id}`} onClose={onClose} wide>
      <Failure error={error} />
      {look?.problem && <p class="bad-text">{look.problem}</p>}
      {!look && !error && <Waiting for="a picture" />}
      <div class="actions">
        <button type="button" aria-pressed={!isWhole} onClick={() => setWhole(!isWhole)}>
          {isWhole ? "100 %: pixel by pixel" : "Show all of it"}
        </button>
        {look && !look.problem && (
          <span class="measures number">
            <span>focus {look.focus.toFixed(1)}</span>
            <span>median {look.medianValue}</span>
            <span>clipped {percentText(look.clippedShare)}</span>
            <span>dark {percentText(look.darkShare)}</span>
          </span>
        )}
      </div>
      <div class={isWhole ? "crop whole" : "crop"} tabIndex={0} role="group" aria-label="Picture; the arrow keys move it">
        <canvas ref={canvas} role="img" aria-label={`Picture of camera ${id}`} />
      </div>
      {bins.length > 0 && <Histogram bins={bins} />}
      {session && !isFilming && settings.length > 0 && <SettingsForm key={session.id} id={id} session={session} settings={look!.camera!.settings} />}
      {settings.length > 0 && (
        <details>
          <summary>All settings</summary>
          <Table label="Settings" head={["setting", "value"]}>
            {settings.map(([name, value]) => (
              <tr key={name}>
                <td>{name}</td>
                <td>{value}</td>
              </tr>
            ))}
          </Table>
        </details>
      )}
    </Dialog>
  );
}

/** A session's cameras are set when it opens, so it is opened anew with what was changed. */
function SettingsForm({ id, session, settings }: { id: string; session: CaptureSession; settings: Record<string, string> }) {
  const offered = SETTINGS.filter((name) => name in settings);
  const [changed, setChanged] = useState<Record<string, string>>({});
  const [forAll, setForAll] = useState(false);
  const action = useAction();
  if (!offered.length) return null;
  const apply = async () => {
    const cameras = clone(SessionSchema, session.cameras!);
    for (const camera of cameras.cameras) {
      if (camera.id !== id && !forAll) continue;
      const list = camera.gige?.features ?? camera.v4l2?.controls;
      if (!list) continue;
      for (const [name, value] of Object.entries(changed)) {
        const line = `${name}=${value}`;
        const at = list.findIndex((feature) => feature.startsWith(`${name}=`));
        if (at >= 0) list[at] = line;
        else list.push(line);
      }
    }
    const { rig, board, garment } = session;
    await openSession(cameras, { rig, board, garment }, true);
    setChanged({});
  };
  return (
    <form
      class="panel"
      onSubmit={(event) => {
        event.preventDefault();
        void action.run(apply);
      }}
    >
      <div class="columns">
        {offered.map((name) => (
          <label key={name}>
            {name}
            <input value={changed[name] ?? settings[name]} onInput={(event) => setChanged({ ...changed, [name]: event.currentTarget.value })} />
          </label>
        ))}
      </div>
      <label class="check">
        <input type="checkbox" checked={forAll} onChange={(event) => setForAll(event.currentTarget.checked)} />
        For all cameras
      </label>
      <Failure error={action.error} />
      <button class="main" disabled={action.busy || Object.keys(changed).length === 0}>
        Set
      </button>
    </form>
  );
}

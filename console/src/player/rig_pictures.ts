import { fromJsonString } from "@bufbuild/protobuf";
import { Cameras } from "@api/cameras_pb";
import type { Job } from "@api/job_pb";
import { ItemKind } from "@api/library_item_pb";
import { Library } from "@api/library_pb";
import { RigSchema } from "@api/rig_pb";
import type { Rig } from "@api/rig_pb";
import type { Client } from "../api/client";
import { ApiError } from "../api/error";
import { pictureUrl } from "../ui/picture";

const PICTURE_PX = 1600;

/** The rig of a job whose inputs are in the library. */
export async function rigOf(client: Client, job: Job): Promise<Rig> {
  const item = job.items?.rig;
  if (!item) throw new ApiError("NOT_FOUND", "the rig of this job is not in the library", "", "register with “library:NAME” as rig");
  return readRig(client, item);
}

export async function readRig(client: Client, item: string): Promise<Rig> {
  const found = await client.call(Library.method.getItem, { kind: ItemKind.RIG, item: `sha256:${item}` });
  const path = found.manifest?.files.find((file) => file.path.endsWith(".json"))?.path ?? "rig.json";
  const bytes = await client.file(Library.method.fetchFile, { kind: "ITEM_KIND_RIG", item: `sha256:${item}`, path });
  return fromJsonString(RigSchema, new TextDecoder().decode(bytes), { ignoreUnknownFields: true });
}

/** Against the directions in which the cameras' pictures go down: up, where nobody turned the cameras over. */
export function upOf(rig: Rig): [number, number, number] {
  const sum: [number, number, number] = [0, 0, 0];
  for (const { rotation } of rig.cameras) for (let axis = 0; axis < 3; ++axis) sum[axis]! -= rotation[3 + axis] ?? 0;
  const length = Math.hypot(...sum);
  return length > 0 ? (sum.map((value) => value / length) as [number, number, number]) : [0, -1, 0];
}

/** Of the job's recording; none where it is no take of this daemon. */
export function takeOf(job: Job): string | undefined {
  const dump = job.spec?.dump ?? "";
  return /^take:(.*)$/.exec(dump)?.[1] ?? /\/takes\/([^/]+)\/take\/?$/.exec(dump)?.[1];
}

/** What a camera saw in a frame of a take. Returns what cancels that. */
export function watchPicture(
  client: Client,
  ask: { takeId: string; frame: string; cameraId: string },
  onPicture: (picture: HTMLCanvasElement | null, problem: string) => void,
): () => void {
  return client.watch(
    Cameras.method.lookAtCameras,
    { ...ask, widthPx: PICTURE_PX },
    (look) => {
      if (look.problem) return onPicture(null, look.problem);
      const image = new Image();
      const url = pictureUrl(look.jpeg);
      image.onload = () => {
        URL.revokeObjectURL(url);
        const canvas = document.createElement("canvas");
        [canvas.width, canvas.height] = [image.width, image.height];
        canvas.getContext("2d")?.drawImage(image, 0, 0);
        onPicture(canvas, "");
      };
      image.src = url;
    },
    (error) => error && onPicture(null, error.message),
  );
}

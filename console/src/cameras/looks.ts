import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import type { MessageInitShape } from "@bufbuild/protobuf";
import type { CameraLook } from "@api/camera_pb";
import { Cameras } from "@api/cameras_pb";
import type { LookAtCamerasRequestSchema } from "@api/cameras_pb";
import type { ApiError } from "../api/error";
import { client } from "../app_state";

export type LookRequest = MessageInitShape<typeof LookAtCamerasRequestSchema>;

const PAUSE_MS = 250; // between two looks
const AFTER_ERROR_MS = 2000;

/** While a picture is looked at in full, the grid leaves the cameras to it. */
export const detailIsOpen = signal(false);

/** The newest picture of each camera, asked for again and again while the page is shown. */
export function useLooks(request: LookRequest | null, isPaused = false): { looks: Map<string, CameraLook>; error: ApiError | null } {
  const [looks, setLooks] = useState(new Map<string, CameraLook>());
  const [error, setError] = useState<ApiError | null>(null);
  const key = JSON.stringify(request);
  useEffect(() => {
    if (!request || isPaused) return;
    let cancel = () => {};
    let pause: ReturnType<typeof setTimeout>;
    let isGone = false;
    const later = (ms: number) => {
      pause = setTimeout(look, ms);
    };
    const look = () => {
      if (document.hidden) {
        later(PAUSE_MS);
        return;
      }
      cancel = client.watch(
        Cameras.method.lookAtCameras,
        request,
        (one) => setLooks((known) => new Map(known).set(one.camera?.id ?? "", one)),
        (problem) => {
          if (isGone) return;
          setError(problem);
          later(problem ? AFTER_ERROR_MS : PAUSE_MS);
        },
      );
    };
    look();
    return () => {
      isGone = true;
      clearTimeout(pause);
      cancel();
    };
  }, [key, isPaused]);
  return { looks, error };
}

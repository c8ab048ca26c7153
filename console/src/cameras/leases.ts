import { fromJsonString, toJsonString } from "@bufbuild/protobuf";
import { signal } from "@preact/signals";
import { SessionSchema } from "@api/session_pb";
import type { Session } from "@api/session_pb";
import { Sessions } from "@api/sessions_pb";
import type { CaptureSession } from "@api/sessions_pb";
import { ApiError, UNREACHABLE, asApiError } from "../api/error";
import { client } from "../app_state";

// What proves to the daemon that this browser opened a session. It is no token: it ends with the session, and is worth
// nothing without the cookie.
const KEY = "weft.lease";
const CAMERAS = "weft.cameras"; // of the last session, to open the next one with

export interface Lease {
  sessionId: string;
  lease: string;
  leaseS: number;
}

function read(): Lease | null {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? "null") as Lease | null;
  } catch {
    return null;
  }
}

/** Of this browser's session. */
export const ownLease = signal<Lease | null>(read());
/** Why this browser's session ended. */
export const leaseEnded = signal<ApiError | null>(null);
let timer: ReturnType<typeof setInterval> | undefined;

export function keepLease(session: CaptureSession | null): void {
  ownLease.value = session && { sessionId: session.id, lease: session.lease, leaseS: session.leaseS };
  if (session) {
    leaseEnded.value = null;
    localStorage.setItem(KEY, JSON.stringify(ownLease.value));
    if (session.cameras) keepCameras(session.cameras);
  } else {
    localStorage.removeItem(KEY);
  }
  renewFromNowOn();
}

/** The session lasts as long as a page is open; a daemon that does not answer for a while changes nothing. */
export function renewFromNowOn(): void {
  clearInterval(timer);
  const own = ownLease.value;
  if (!own) return;
  const renew = () =>
    client.call(Sessions.method.renewSession, { lease: own.lease }).catch((reason: unknown) => {
      const error = asApiError(reason);
      if (ownLease.value !== own || [UNREACHABLE, "UNAVAILABLE", "UNAUTHENTICATED", "UNKNOWN"].includes(error.code)) return;
      leaseEnded.value = error;
      keepLease(null);
    });
  void renew();
  timer = setInterval(() => void renew(), Math.min(own.leaseS / 3, 15) * 1000);
}

function keepCameras(cameras: Session): void {
  localStorage.setItem(CAMERAS, toJsonString(SessionSchema, cameras));
}

export function lastCameras(): Session | null {
  try {
    return fromJsonString(SessionSchema, localStorage.getItem(CAMERAS) ?? "", { ignoreUnknownFields: true });
  } catch {
    return null;
  }
}

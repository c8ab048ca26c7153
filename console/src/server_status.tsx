import { RecorderPhase } from "@api/recorder_pb";
import { Server } from "@api/server_pb";
import type { ServerInfo } from "@api/server_pb";
import { Takes } from "@api/takes_pb";
import type { RecordedTake } from "@api/takes_pb";
import { useCall } from "./hooks";
import { hrefOf } from "./router";
import { bytesText, countOf, durationText } from "./ui/format";

const EVERY_MS = 3000;
const SCARCE_MIN = 10;

/** How long the disk lasts, in minutes: as the recorder says, or at the newest take's rate. */
export interface DiskOutlook {
  minutes: number | null; // null: nothing was recorded yet
  byRunningTake: boolean;
}

export function diskOutlook(info: ServerInfo, takes: RecordedTake[]): DiskOutlook {
  const running = takes.filter((take) => take.state?.phase === RecorderPhase.RECORDING);
  const said = running.map((take) => take.state?.diskMinutesLeft ?? -1).filter((minutes) => minutes >= 0);
  if (said.length) return { minutes: Math.min(...said), byRunningTake: true };
  const last = takes.find((take) => take.state && take.state.elapsedS > 0 && take.state.bytesWritten > 0n);
  if (!last?.state) return { minutes: null, byRunningTake: false };
  const bytesPerS = Number(last.state.bytesWritten) / last.state.elapsedS;
  return { minutes: Number(info.diskFreeBytes) / bytesPerS / 60, byRunningTake: false };
}

export function ServerStatus() {
  const info = useCall(Server.method.getServerInfo, {}, EVERY_MS).value;
  const takes = useCall(Takes.method.listTakes, { limit: 10 }, EVERY_MS).value?.takes ?? [];
  if (!info) return null;
  const { minutes, byRunningTake } = diskOutlook(info, takes);
  const recording = takes.filter((take) => take.state?.phase === RecorderPhase.RECORDING);
  const isScarce = minutes !== null && minutes < SCARCE_MIN;
  return (
    <span class="server-status">
      {recording.map((take) => (
        <a key={take.id} class="recording" href={hrefOf("takes", take.id)}>
          ● recording
        </a>
      ))}
      {info.warnings.length > 0 && (
        <a class="bad-text" href={hrefOf("server")}>
          {countOf(info.warnings.length, "warning")}
        </a>
      )}
      <a href={hrefOf("jobs")}>
        {info.jobsRunning} running, {info.jobsQueued} waiting
      </a>
      <a href={hrefOf("server")} class={isScarce ? "bad-text" : ""} data-disk={minutes === null ? "" : minutes.toFixed(1)}>
        disk: {bytesText(info.diskFreeBytes)} free
        {minutes !== null && (
          <>
            , {durationText(minutes * 60)} {byRunningTake ? "left" : "at the last take's rate"}
          </>
        )}
      </a>
    </span>
  );
}

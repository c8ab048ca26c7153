import { Server } from "@api/server_pb";
import { Takes } from "@api/takes_pb";
import { useCall } from "../hooks";
import { diskOutlook } from "../server_status";
import { bytesText, durationText, secondsBetween, timeText } from "../ui/format";
import { Facts, Failure, Page, Waiting, Warnings } from "../ui/parts";

export function ServerPage() {
  const { value: info, error } = useCall(Server.method.getServerInfo, {}, 2000);
  const takes = useCall(Takes.method.listTakes, { limit: 10 }, 5000);
  if (!info) return error ? <Failure error={error} /> : <Waiting for="the daemon" />;
  const { minutes, byRunningTake } = diskOutlook(info, takes.value?.takes ?? []);
  return (
    <Page title="Server">
      <Failure error={error} />
      <Warnings texts={info.warnings} />
      <Facts
        facts={[
          ["Version", info.version],
          ["Runs since", `${timeText(info.startedUnixNs)} (${durationText(secondsBetween(info.startedUnixNs, info.unixNs))})`],
          ["Workers", `${info.workers}, ${info.threadsPerWorker} threads each`],
          ["Jobs", `${info.jobsRunning} running, ${info.jobsQueued} waiting`],
          ["Disk of the takes", `${bytesText(info.diskFreeBytes)} of ${bytesText(info.diskTotalBytes)} free`],
          [
            "Recording time left",
            minutes === null
              ? "known after the first take"
              : `${durationText(60 * minutes)} ${byRunningTake ? "at the rate of the take that runs" : "at the newest take's rate"}`,
          ],
          ["State folder", <code>{info.stateFolder}</code>],
          ["Folders of jobs", info.allowedPaths.map((path) => <code key={path}>{path} </code>)],
        ]}
      />
    </Page>
  );
}

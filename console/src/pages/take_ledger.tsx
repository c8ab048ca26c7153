import { fromJsonString } from "@bufbuild/protobuf";
import { useEffect, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { Operations } from "@api/operations_pb";
import type { Operation } from "@api/operations_pb";
import { TakeInfoSchema } from "@api/take_pb";
import type { TakeInfo } from "@api/take_pb";
import { JobState } from "@api/job_pb";
import { client, mayAs } from "../app_state";
import { ApiError, asApiError } from "../api/error";
import { countText, durationText } from "../ui/format";
import { Facts, Failure, Progress, Table, VerdictBox, Warnings } from "../ui/parts";

/** `weft take info` of an ended take, which the daemon computes once. */
export function TakeLedger({ id }: { id: string }) {
  const [operation, setOperation] = useState<Operation>();
  const [error, setError] = useState<ApiError | null>(null);
  const connections = client.live.connections.value;
  useEffect(() => {
    let cancel = () => {};
    let isGone = false;
    // Its key is its id, so that everyone gets the same one.
    const key = `info-${id}`;
    const request = { spec: { command: "take info", inputs: [{ name: "take", value: `take:${id}` }], json: true }, idempotencyKey: key };
    const begun = mayAs(Role.CLIENT)
      ? client.call(Operations.method.startOperation, request)
      : client.call(Operations.method.getOperation, { operationId: key });
    begun.then(
      (first) => {
        if (isGone) return;
        setOperation(first);
        cancel = client.watch(Operations.method.watchOperation, { operationId: first.id }, setOperation, setError);
      },
      (reason: unknown) => setError(asApiError(reason)),
    );
    return () => {
      isGone = true;
      cancel();
    };
  }, [id, connections]);
  if (error?.code === "NOT_FOUND") return <p class="empty">Nobody had this take checked yet; that takes the role client.</p>;
  if (error) return <Failure error={error} what="The take could not be looked through" />;
  if (operation?.state === JobState.FAILED) return <Failure error={new ApiError("", operation.message)} what="The take could not be looked through" />;
  if (operation?.state !== JobState.DONE) return <Progress share={operation?.shareDone ?? 0} label="Looking through the take" />;
  return <Info info={fromJsonString(TakeInfoSchema, operation.output, { ignoreUnknownFields: true })} />;
}

function Info({ info }: { info: TakeInfo }) {
  return (
    <>
      <VerdictBox verdict={info.verdict} />
      <Warnings texts={[...info.warnings, ...info.notes]} />
      <Facts
        facts={[
          ["Sets with all cameras", `${countText(info.setsComplete)} of ${countText(info.sets)}`],
          ["Sets dropped", countText(info.setsDropped)],
          ["Length", durationText(info.durationS)],
          ["Synchronization", info.take?.sync ?? ""],
        ]}
      />
      {info.causes.length > 0 && (
        <Table label="Causes" head={["camera", "why frames are missing", "how many"]}>
          {info.causes.map((cause) => (
            <tr key={cause.camera + cause.cause}>
              <td>{cause.camera || "all"}</td>
              <td>{cause.cause}</td>
              <td class="number">{countText(cause.count)}</td>
            </tr>
          ))}
        </Table>
      )}
      <Table label="Times" head={["camera", "frames", "missing", "interval", "jitter", "offset", "worst offset"]}>
        {info.timing.map((timing) => (
          <tr key={timing.camera}>
            <td>{timing.camera}</td>
            <td class="number">{countText(timing.frames)}</td>
            <td class={timing.missing > 0n ? "number bad-text" : "number"}>{countText(timing.missing)}</td>
            {[timing.intervalMeanMs, timing.intervalJitterMs, timing.offsetMeanMs, timing.offsetWorstMs].map((ms, i) => (
              <td key={i} class="number">
                {ms.toFixed(3)} ms
              </td>
            ))}
          </tr>
        ))}
      </Table>
    </>
  );
}

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { JobState } from "@api/job_pb";
import { Operations } from "@api/operations_pb";
import type { Operation } from "@api/operations_pb";
import { WorkStart } from "@api/work_pb";
import { client, mayAs } from "../app_state";
import { useCall, useWatch } from "../hooks";
import { go, hrefOf, route } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { FileTable } from "../ui/file_table";
import { durationText, secondsBetween, timeText } from "../ui/format";
import { Badge, Facts, Failure, Page, Progress, Table, Waiting, Warnings } from "../ui/parts";
import { JobStateBadge, hasEnded, shortName } from "../ui/states";
import { StartWork } from "./work_dialogs";

export function OperationsPage() {
  const [, id] = route.value;
  return id ? <OperationPage key={id} id={id} /> : <OperationList />;
}

function cancelQuestion(operation: Operation): Question {
  return {
    title: `Cancel “${operation.spec?.command}”?`,
    text: <p>What it has written so far is lost.</p>,
    verb: "Cancel it",
    isGrave: true,
    run: () => client.call(Operations.method.cancelOperation, { operationId: operation.id }),
  };
}

function deleteQuestion(operation: Operation): Question {
  return {
    title: `Delete “${operation.spec?.command}”?`,
    text: <p>The files that it wrote are removed for good. A take that it made stays.</p>,
    verb: "Delete it",
    isGrave: true,
    run: async () => {
      await client.call(Operations.method.deleteOperation, { operationId: operation.id });
      go("operations");
    },
  };
}

function OperationList() {
  const { value, error } = useCall(Operations.method.listOperations, { limit: 100 }, 2000);
  return (
    <Page title="Operations">
      <StartWork start={WorkStart.OPERATION} />
      <Failure error={error} />
      <Warnings texts={value?.warnings} />
      {!value && !error && <Waiting for="the operations" />}
      {value && value.operations.length === 0 && <p class="empty">Nothing was asked for yet.</p>}
      {value && value.operations.length > 0 && (
        <Table label="Operations" head={["what", "of", "state", "began", "took"]}>
          {value.operations.toSorted((a, b) => Number(b.createdUnixNs - a.createdUnixNs)).map((operation) => (
            <tr key={operation.id}>
              <td>
                <a class="row" href={hrefOf("operations", operation.id)}>
                  {operation.spec?.command}
                </a>
              </td>
              <td>{shortName(operation.about)}</td>
              <td>{operation.state === JobState.RUNNING ? <Progress share={operation.shareDone} label="Done" /> : <OperationState operation={operation} />}</td>
              <td class="number">{timeText(operation.startedUnixNs)}</td>
              <td class="number">
                {operation.finishedUnixNs > 0n && operation.startedUnixNs > 0n && durationText(secondsBetween(operation.startedUnixNs, operation.finishedUnixNs))}
              </td>
            </tr>
          ))}
        </Table>
      )}
    </Page>
  );
}

function OperationState({ operation }: { operation: Operation }) {
  return (
    <>
      <JobStateBadge state={operation.state} />
      {operation.state === JobState.DONE && operation.exitStatus === 1 && <Badge tone="bad">verdict: bad</Badge>}
    </>
  );
}

function OperationPage({ id }: { id: string }) {
  const { value: operation, error } = useWatch(Operations.method.watchOperation, { operationId: id });
  const [question, setQuestion] = useState<Question | null>(null);
  if (!operation) return error ? <Failure error={error} /> : <Waiting for="the operation" />;
  const spec = operation.spec;
  return (
    <Page
      title={spec?.command ?? ""}
      actions={
        mayAs(Role.CLIENT) &&
        (hasEnded(operation) ? (
          <button type="button" onClick={() => setQuestion(deleteQuestion(operation))}>
            Delete
          </button>
        ) : (
          <button type="button" onClick={() => setQuestion(cancelQuestion(operation))}>
            Cancel
          </button>
        ))
      }
    >
      <Failure error={error} />
      {operation.message && <p class={operation.state === JobState.FAILED ? "failure" : "panel"}>{operation.message}</p>}
      <Warnings texts={operation.notes} />
      <Facts
        facts={[
          ["State", <OperationState operation={operation} />],
          ["Progress", !hasEnded(operation) && <Progress share={operation.shareDone} label="Done" />],
          ["Step", !hasEnded(operation) && operation.step],
          ...(spec?.inputs ?? []).map((input): [string, ComponentChildren] => [input.name, <code>{input.value}</code>]),
          ...(spec?.options ?? []).map((option): [string, ComponentChildren] => [option.name, option.value || "yes"]),
          ["Began", timeText(operation.startedUnixNs)],
          ["Ended", timeText(operation.finishedUnixNs)],
          ["Take", operation.takeId && <a href={hrefOf("takes", operation.takeId)}>{operation.takeId}</a>],
        ]}
      />
      {operation.state === JobState.DONE && spec?.outName && <Files id={id} />}
      {operation.output && (
        <>
          <h2>Output</h2>
          <pre class="output" tabIndex={0}>
            {operation.output}
          </pre>
        </>
      )}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
    </Page>
  );
}

function Files({ id }: { id: string }) {
  const { value, error } = useCall(Operations.method.listOperationFiles, { operationId: id });
  const url = (path: string, more: Record<string, string> = {}) =>
    client.fileUrl(Operations.method.fetchOperationFile, { operation_id: id, path, ...more });
  return (
    <>
      <h2>Files</h2>
      <Failure error={error} />
      <FileTable files={value?.files ?? []} url={url} opens />
      {value?.nextPageToken && <p class="empty">There are more files: `weft` and the Python client list all of them.</p>}
    </>
  );
}

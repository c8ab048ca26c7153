import { useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { JobState } from "@api/job_pb";
import type { Job } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { WorkStart } from "@api/work_pb";
import { client, mayAs } from "../app_state";
import { useAction, useCall } from "../hooks";
import { hrefOf, route } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { countOf, durationText, timeText } from "../ui/format";
import { Failure, GradeBadge, Page, Progress, Table, Waiting, Warnings } from "../ui/parts";
import { JobStateBadge, hasEnded, jobName, shareDone } from "../ui/states";
import { JobPage } from "./job";
import { StartWork } from "./work_dialogs";

const MOST_PRIORITY = 100;

export function JobsPage() {
  const [, id] = route.value;
  return id ? <JobPage key={id} id={id} /> : <JobList />;
}

/** In the order in which workers take them: by priority, then by age. */
function queueOrder(jobs: Job[]): Job[] {
  return jobs
    .filter((job) => !hasEnded(job))
    .sort((a, b) => b.priority - a.priority || Number(a.createdUnixNs - b.createdUnixNs));
}

export function cancelQuestion(job: Job, then: () => void): Question {
  return {
    title: "Cancel this job?",
    text: <p>{countOf(job.frames?.done ?? 0, "finished frame")} stay; the others are registered when the job is retried.</p>,
    verb: "Cancel the job",
    isGrave: true,
    run: () => client.call(Jobs.method.cancelJob, { jobId: job.id }).then(then),
  };
}

function JobList() {
  const { value, error, reload } = useCall(Jobs.method.listJobs, { limit: 200 }, 1500);
  const [question, setQuestion] = useState<Question | null>(null);
  const action = useAction();
  const jobs = value?.jobs ?? [];
  const queue = queueOrder(jobs);
  const ended = jobs.filter(hasEnded);
  // Before the one above it: of its priority if that one is younger, or of the next higher.
  const moveUp = (i: number) =>
    void action.run(async () => {
      const [above, job] = [queue[i - 1]!, queue[i]!];
      const priority = Math.min(MOST_PRIORITY, above.priority + 1);
      await client.call(Jobs.method.setJobPriority, { jobId: job.id, priority });
      reload();
    });
  return (
    <Page title="Jobs">
      <StartWork start={WorkStart.JOB} />
      <Failure error={error} />
      <Failure error={action.error} />
      <Warnings texts={value?.warnings} />
      {!value && !error && <Waiting for="the jobs" />}
      {value && jobs.length === 0 && <p class="empty">No job yet. Register a take on its page.</p>}
      {queue.length > 0 && (
        <>
          <h2>Queue</h2>
          <Table label="Queue" head={["", "of", "state", "progress", "left", "failed", "priority", ""]}>
            {queue.map((job, i) => (
              <tr key={job.id}>
                <td class="number">{i + 1}</td>
                <td>
                  <a class="row" href={hrefOf("jobs", job.id)}>
                    {jobName(job)}
                  </a>
                  {job.live?.following && <small> follows the take</small>}
                </td>
                <td>
                  <JobStateBadge state={job.state} />
                </td>
                <td>
                  <Progress share={shareDone(job)} label="Frames done" />
                </td>
                <td class="number">{job.state === JobState.RUNNING && job.remainingS >= 0 ? durationText(job.remainingS) : ""}</td>
                <td class={job.frames?.failed ? "number bad-text" : "number"}>{job.frames?.failed ?? 0}</td>
                <td class="number">{job.priority}</td>
                <td class="actions end">
                  {mayAs(Role.CLIENT) && (
                    <>
                      <button type="button" disabled={i === 0 || action.busy} aria-label={`Move job ${job.id} up`} onClick={() => moveUp(i)}>
                        ↑
                      </button>
                      <button type="button" onClick={() => setQuestion(cancelQuestion(job, reload))}>
                        Cancel
                      </button>
                    </>
                  )}
                </td>
              </tr>
            ))}
          </Table>
        </>
      )}
      {ended.length > 0 && (
        <>
          <h2>Ended</h2>
          <Table label="Ended jobs" head={["of", "state", "verdict", "ended", "frames", "failed", "by"]}>
            {ended.map((job) => (
              <tr key={job.id}>
                <td>
                  <a class="row" href={hrefOf("jobs", job.id)}>
                    {jobName(job)}
                  </a>
                </td>
                <td>
                  <JobStateBadge state={job.state} />
                </td>
                <td>{job.verdict && <GradeBadge grade={job.verdict.grade} />}</td>
                <td class="number">{timeText(job.finishedUnixNs)}</td>
                <td class="number">{job.frames?.total ?? 0}</td>
                <td class={job.frames?.failed ? "number bad-text" : "number"}>{job.frames?.failed ?? 0}</td>
                <td>{/\((.*)\)/.exec(job.submittedBy)?.[1] ?? job.submittedBy}</td>
              </tr>
            ))}
          </Table>
        </>
      )}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
    </Page>
  );
}

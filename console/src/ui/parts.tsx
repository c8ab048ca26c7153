import type { ComponentChildren } from "preact";
import { Grade } from "@api/verdict_pb";
import type { Verdict } from "@api/verdict_pb";
import type { ApiError } from "../api/error";

/** What went wrong, in the daemon's words. Its message names field and remedy already. */
export function Failure({ error, what }: { error: ApiError | null; what?: string }) {
  if (!error) return null;
  const remedy = error.remedy && !error.message.includes(error.remedy) ? error.remedy : "";
  return (
    <div class="failure" role="alert">
      <strong>{what ?? HEADLINES[error.code] ?? "That did not work"}</strong>
      <p>
        {error.message}
        {remedy && <>: {remedy}</>}
      </p>
    </div>
  );
}

const HEADLINES: Record<string, string> = {
  PERMISSION_DENIED: "Your role does not allow this",
  UNAUTHENTICATED: "You are not logged in",
  UNREACHABLE: "No connection to the daemon",
  UNAVAILABLE: "The daemon takes nothing now",
  NOT_FOUND: "It is not there any more",
  FAILED_PRECONDITION: "Not possible now",
  RESOURCE_EXHAUSTED: "There is no room for it now",
  INVALID_ARGUMENT: "The input cannot be used",
};

export function Warnings({ texts }: { texts: string[] | undefined }) {
  if (!texts?.length) return null;
  return (
    <div role="status">
      <ul class="warnings">
        {texts.map((text) => (
          <li key={text}>{text}</li>
        ))}
      </ul>
    </div>
  );
}

export type Tone = "good" | "usable" | "bad" | "busy" | "quiet";

export function Badge({ tone, children }: { tone: Tone; children: ComponentChildren }) {
  return <span class={`badge ${tone}`}>{children}</span>;
}

const GRADES: Record<Grade, [Tone, string]> = {
  [Grade.UNSPECIFIED]: ["quiet", "no verdict"],
  [Grade.GOOD]: ["good", "good"],
  [Grade.USABLE]: ["usable", "usable"],
  [Grade.BAD]: ["bad", "bad"],
};

export function GradeBadge({ grade }: { grade: Grade }) {
  const [tone, text] = GRADES[grade];
  return <Badge tone={tone}>{text}</Badge>;
}

export function VerdictBox({ verdict }: { verdict: Verdict | undefined }) {
  if (!verdict || verdict.grade === Grade.UNSPECIFIED) return null;
  return (
    <section class={`verdict ${GRADES[verdict.grade][0]}`} aria-label="Verdict">
      <p class="verdict-line">
        <GradeBadge grade={verdict.grade} /> <strong>{verdict.reason}</strong>
      </p>
      {verdict.remedy && <p>{verdict.remedy}</p>}
      {verdict.others.map((other) => (
        <p key={other.reason}>
          <GradeBadge grade={other.grade} /> {other.reason}
        </p>
      ))}
      {verdict.checks.length > 0 && (
        <details>
          <summary>What was checked</summary>
          <Table head={["", "check", "value", "limits"]}>
            {verdict.checks.map((check) => (
              <tr key={check.id}>
                <td>
                  <GradeBadge grade={check.grade} />
                </td>
                <td>{check.name}</td>
                <td class="number">{check.value}</td>
                <td>{check.limits}</td>
              </tr>
            ))}
          </Table>
        </details>
      )}
    </section>
  );
}

export function Table({ head, children, label }: { head: string[]; children: ComponentChildren; label?: string }) {
  return (
    <div class="table" tabIndex={0} role="region" aria-label={label ?? "Table"}>
      <table>
        <thead>
          <tr>
            {head.map((text, i) => (text ? <th key={i}>{text}</th> : <td key={i} />))}
          </tr>
        </thead>
        <tbody>{children}</tbody>
      </table>
    </div>
  );
}

export function Facts({ facts }: { facts: [string, ComponentChildren][] }) {
  return (
    <dl class="facts">
      {facts
        .filter(([, value]) => value !== "" && value !== null && value !== undefined && value !== false)
        .map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </div>
        ))}
    </dl>
  );
}

export function Progress({ share, label }: { share: number; label: string }) {
  return (
    <span class="progress">
      <progress max={1} value={Math.min(1, Math.max(0, share))} aria-label={label} />
      <span class="number">{Math.round(100 * share)} %</span>
    </span>
  );
}

export function Page({ title, actions, children }: { title: string; actions?: ComponentChildren; children: ComponentChildren }) {
  return (
    <>
      <header class="page-head">
        <h1>{title}</h1>
        <div class="actions">{actions}</div>
      </header>
      {children}
    </>
  );
}

export function Waiting({ for: what }: { for: string }) {
  return (
    <p class="waiting" role="status">
      Waiting for {what} …
    </p>
  );
}

import { useEffect, useRef, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import type { CameraLook } from "@api/camera_pb";
import { Cameras } from "@api/cameras_pb";
import type { FrameInfo, Job } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { FrameState } from "@api/report_pb";
import type { FrameReport } from "@api/report_pb";
import { client, mayAs } from "../app_state";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { frameReport } from "../api/frames";
import { durationText, percentText } from "../ui/format";
import { Facts, Failure, Table } from "../ui/parts";
import { FRAME_STATES } from "../ui/states";
import { pictureUrl } from "../ui/picture";

const text = new TextDecoder();

function fetchText(jobId: string, frame: string, kind: string, signal: AbortSignal): Promise<string> {
  return client.file(Jobs.method.fetchResult, { job_id: jobId, frame, kind }, signal).then((bytes) => text.decode(bytes));
}

/** What became of a frame, step by step, with the pictures that it was registered from. */
export function FramePanel({ job, frame }: { job: Job; frame: FrameInfo }) {
  const [report, setReport] = useState<FrameReport>();
  const [error, setError] = useState<ApiError | null>(null);
  const hasReport = [FrameState.DONE, FrameState.DEGRADED, FrameState.FAILED].includes(frame.state);
  useEffect(() => {
    if (!hasReport) return;
    const abort = new AbortController();
    frameReport(client, job.id, frame.frame, abort.signal).then(setReport, (reason: unknown) => {
      if (!abort.signal.aborted) setError(asApiError(reason));
    });
    return () => abort.abort();
  }, []);
  const take = /^take:(.*)$/.exec(job.spec?.dump ?? "")?.[1] ?? /\/takes\/([^/]+)\/take\/?$/.exec(job.spec?.dump ?? "")?.[1];
  const file = (kind: string, name: string, more = {}) =>
    client.fileUrl(Jobs.method.fetchResult, { job_id: job.id, frame: frame.frame, kind, save_as: `${frame.frame}-${name}`, ...more });
  // Reports of earlier versions name none.
  const named = report?.meshes.map((mesh) => ({ file: mesh.file, query: { mesh: mesh.name } })) ?? [];
  const meshes = named.length ? named : [{ file: "mesh.ply", query: {} }];
  return (
    <section class="panel" aria-label={`Frame ${frame.frame}`}>
      <h2>
        Frame {frame.frame}: {FRAME_STATES[frame.state]}
        {frame.bridged && ", its mesh comes from the frames around it"}
      </h2>
      {frame.reason && <p class="bad-text">{frame.reason}</p>}
      <Facts
        facts={[
          ["Cloth that is seen", frame.coverage ? percentText(frame.coverage) : ""],
          ["Time", frame.totalMs ? durationText(frame.totalMs / 1000) : ""],
          ["Attempts", frame.attempts > 1 && frame.attempts],
          ["Done", frame.state === FrameState.RUNNING && percentText(frame.shareDone)],
          ["Computed again from", frame.redoneFrom && `${frame.redoneFrom}: ${frame.redoneBecause}`],
          ["Cells without a point", report?.cloud?.rejected.map((r) => `${r.count} ${r.reason}`).join("; ") ?? ""],
          ["Self-intersections", report?.mesh?.selfIntersections || ""],
        ]}
      />
      {report && report.stages.length > 0 && (
        <Table label="Stages" head={["stage", "time"]}>
          {report.stages.map((stage) => (
            <tr key={stage.stage}>
              <td>{stage.stage}</td>
              <td class="number">{durationText(stage.timeMs / 1000)}</td>
            </tr>
          ))}
        </Table>
      )}
      {report && report.views.length > 0 && (
        <Table label="Cameras" head={["camera", "cells", "corners", "what was rejected"]}>
          {report.views.map((view) => (
            <tr key={view.camera}>
              <td>{view.camera}</td>
              <td class="number">{view.centers}</td>
              <td class="number">{view.corners}</td>
              <td>
                {view.missingReason ? (
                  <span class="bad-text">{view.missingReason}</span>
                ) : (
                  view.patchesRejected.map((r) => `${r.count} ${r.reason}`).join("; ")
                )}
              </td>
            </tr>
          ))}
        </Table>
      )}
      {(frame.state === FrameState.DONE || frame.state === FrameState.DEGRADED) && (
        <p class="actions">
          {meshes.map((mesh) => (
            <a key={mesh.file} href={file("RESULT_KIND_MESH", mesh.file, mesh.query)}>
              {mesh.file}
            </a>
          ))}
          <a href={file("RESULT_KIND_CLOUD", "cloud.ply")}>cloud.ply</a>
        </p>
      )}
      <Failure error={error?.code === "NOT_FOUND" ? null : error} />
      {take && mayAs(Role.OPERATOR) && <FramePictures job={job} frame={frame} takeId={take} />}
    </section>
  );
}

interface Cell {
  x: number;
  y: number;
  column: number;
}

/** Centres of decoded cells by camera, from observations.csv. */
function readCells(csv: string): Map<string, Cell[]> {
  const [head, ...lines] = csv.trim().split("\n").map((line) => line.split(","));
  const column = (name: string) => head?.indexOf(name) ?? -1;
  const [image, kind, x, y, col] = [column("image"), column("kind"), column("x_px"), column("y_px"), column("board_col")];
  const cells = new Map<string, Cell[]>();
  for (const line of lines) {
    if (line[kind] !== "center") continue;
    const camera = line[image] ?? "";
    if (!cells.has(camera)) cells.set(camera, []);
    cells.get(camera)!.push({ x: Number(line[x]), y: Number(line[y]), column: Number(line[col]) });
  }
  return cells;
}

function FramePictures({ job, frame, takeId }: { job: Job; frame: FrameInfo; takeId: string }) {
  const [looks, setLooks] = useState<CameraLook[]>([]);
  const [error, setError] = useState<ApiError | null>(null);
  const [cells, setCells] = useState(new Map<string, Cell[]>());
  useEffect(() => {
    const abort = new AbortController();
    const cancel = client.watch(
      Cameras.method.lookAtCameras,
      { takeId, frame: frame.frame, widthPx: 960 },
      (look) => setLooks((known) => [...known.filter((one) => one.camera?.id !== look.camera?.id), look]),
      setError,
    );
    if (job.spec?.options?.writeObservations) {
      fetchText(job.id, frame.frame, "RESULT_KIND_OBSERVATIONS", abort.signal).then(
        (csv) => setCells(readCells(csv)),
        () => {}, // a frame that failed before its cells were decoded has none
      );
    }
    return () => {
      cancel();
      abort.abort();
    };
  }, []);
  return (
    <>
      <h3>Pictures{cells.size > 0 && " with the decoded cells"}</h3>
      <Failure error={error} />
      <div class="pictures">
        {looks.map((look) => (
          <figure key={look.camera?.id}>
            {look.problem ? <p class="bad-text">{look.problem}</p> : <Overlay look={look} cells={cells.get(look.camera?.id ?? "") ?? []} />}
            <figcaption>
              {look.camera?.id} {cells.size > 0 && <small>{cells.get(look.camera?.id ?? "")?.length ?? 0} cells</small>}
            </figcaption>
          </figure>
        ))}
      </div>
    </>
  );
}

function Overlay({ look, cells }: { look: CameraLook; cells: Cell[] }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const image = new Image();
    const url = pictureUrl(look.jpeg);
    image.onload = () => {
      URL.revokeObjectURL(url);
      const context = canvas.current?.getContext("2d");
      if (!canvas.current || !context) return;
      canvas.current.width = image.width;
      canvas.current.height = image.height;
      context.drawImage(image, 0, 0);
      const scale = image.width / (look.camera?.widthPx || image.width);
      for (const { x, y, column } of cells) {
        context.fillStyle = `hsl(${(column * 47) % 360} 90% 60%)`;
        context.beginPath();
        context.arc((x + 0.5) * scale, (y + 0.5) * scale, 1.6, 0, 7);
        context.fill();
      }
    };
    image.src = url;
  }, [look, cells]);
  return <canvas ref={canvas} role="img" aria-label={`Camera ${look.camera?.id}, ${cells.length} decoded cells`} />;
}

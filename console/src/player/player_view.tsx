import { useEffect, useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import type { Job } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { FrameState } from "@api/report_pb";
import type { Camera, Rig } from "@api/rig_pb";
import type { Client } from "../api/client";
import { frameReport } from "../api/frames";
import { mayAs } from "../app_state";
import { useAction, useCall } from "../hooks";
import { useShortcuts } from "../keys";
import { bytesText, countOf, durationText } from "../ui/format";
import { Failure } from "../ui/parts";
import { hasEnded, jobName } from "../ui/states";
import { COLORINGS } from "./colors";
import type { Coloring } from "./colors";
import type { Engine } from "./engine";
import { Legend } from "./legend";
import { rigOf, takeOf, upOf, watchPicture } from "./rig_pictures";
import { turnByKey } from "./turn_by_key";
import { useEngine } from "./use_engine";

const RATES = [5, 10, 15, 25, 30, 50, 60, 0];

export function PlayerView({ client, jobId }: { client: Client; jobId: string }) {
  const [mesh, setMesh] = useState("");
  return <MeshPlayer key={mesh} client={client} jobId={jobId} mesh={mesh} choose={setMesh} />;
}

interface MeshChoice {
  mesh: string;
  choose: (mesh: string) => void;
}

function MeshPlayer({ client, jobId, mesh, choose }: { client: Client; jobId: string } & MeshChoice) {
  const { canvas, engine, job, error, problem } = useEngine(client, jobId, false, mesh);
  const isEmpty = engine !== null && job !== undefined && engine.frames.value.length === 0;
  return (
    <>
      <Failure error={error} />
      {problem && <p role="alert">{problem}</p>}
      {isEmpty && <p class="empty">{emptyText(job)}</p>}
      {engine && job && <Bar engine={engine} job={job} client={client} mesh={mesh} choose={choose} />}
      <div class="player-stage">
        <canvas
          ref={canvas}
          tabIndex={0}
          role="img"
          aria-label="The garment in three dimensions. Arrow keys turn it, plus and minus zoom, 0 goes back."
          onKeyDown={(event) => engine && turnByKey(engine.orbit, event)}
          onDblClick={() => engine?.orbit.reset()}
        />
        {engine?.waiting.value && !isEmpty && <p class="player-waiting" role="status">Waiting for the first mesh …</p>}
      </div>
      {engine && <Scrub engine={engine} />}
      {engine && <Numbers engine={engine} />}
    </>
  );
}

function emptyText(job: Job): string {
  if (!hasEnded(job)) return "No frame is registered yet; the first one appears here by itself.";
  return "This job has no registered frame, so there is nothing to show. The job’s page says what became of each frame.";
}

function Bar({ engine, job, client, mesh, choose }: { engine: Engine; job: Job; client: Client } & MeshChoice) {
  const compare = useAction();
  const other = engine.other.value;
  const colorings = COLORINGS.filter((one) => one !== "difference" || other);
  useShortcuts(
    [
      { keys: "p", text: "Play or pause", run: () => engine.play(!engine.playing.value) },
      { keys: ",", text: "The frame before", run: () => engine.step(-1) },
      { keys: ".", text: "The next frame", run: () => engine.step(1) },
      { keys: "w", text: "Edges of the mesh", run: () => engine.setWireframe(!engine.wireframe.value) },
    ],
    [engine],
  );
  return (
    <>
      <div class="player-bar">
        <label>
          Colours
          <select value={engine.coloring.value} onChange={(event) => engine.setColoring(event.currentTarget.value as Coloring)}>
            {colorings.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        <Meshes engine={engine} job={job} client={client} mesh={mesh} choose={choose} />
        <Garments engine={engine} />
        <Compared engine={engine} job={job} choose={(id) => void compare.run(() => engine.compareWith(id, job))} />
        <Overlaid engine={engine} job={job} client={client} />
        <label class="check">
          <input type="checkbox" checked={engine.wireframe.value} onChange={(event) => engine.setWireframe(event.currentTarget.checked)} />
          Edges
        </label>
        {other && (
          <label class="check">
            <input type="checkbox" checked={engine.beside.value} onChange={(event) => engine.setBeside(event.currentTarget.checked)} />
            Side by side
          </label>
        )}
        <button type="button" onClick={() => engine.orbit.reset()}>
          Reset the view
        </button>
      </div>
      <Failure error={compare.error} />
      <Failure error={engine.error.value} />
    </>
  );
}

/** Where frames have more than one, by the report of the first. */
function Meshes({ engine, job, client, mesh, choose }: { engine: Engine; job: Job; client: Client } & MeshChoice) {
  const [names, setNames] = useState<string[]>([]);
  const first = engine.frames.value[0]?.frame;
  useEffect(() => {
    if (!first) return;
    const abort = new AbortController();
    frameReport(client, job.id, first, abort.signal).then(
      (report) => setNames(report.meshes.map((one) => one.name)),
      () => {}, // the player says what cannot be read
    );
    return () => abort.abort();
  }, [first]);
  if (names.length < 2) return null;
  return (
    <label>
      Mesh
      <select value={mesh || (names.includes("garment") ? "garment" : "")} onChange={(event) => choose(event.currentTarget.value)}>
        {!mesh && !names.includes("garment") && <option value="">choose one</option>}
        {names.map((name) => (
          <option key={name}>{name}</option>
        ))}
      </select>
    </label>
  );
}

/** One of the garments that were registered together. */
function Garments({ engine }: { engine: Engine }) {
  const parts = engine.garments.value;
  if (parts.length === 0) return null;
  return (
    <label>
      Garments
      <select
        value={engine.garment.value?.id ?? ""}
        onChange={(event) => engine.showGarment(parts.find((part) => part.id === event.currentTarget.value) ?? null)}
      >
        <option value="">all</option>
        {parts.map((part) => (
          <option key={part.id}>{part.id}</option>
        ))}
      </select>
    </label>
  );
}

function Compared({ engine, job, choose }: { engine: Engine; job: Job; choose: (id: string | null) => void }) {
  const { value } = useCall(Jobs.method.listJobs, { limit: 100 });
  const others = (value?.jobs ?? []).filter((one) => one.id !== job.id && one.inputs?.garment === job.inputs?.garment && hasEnded(one));
  return (
    <label>
      Compare with
      <select value={engine.other.value?.job.id ?? ""} onChange={(event) => choose(event.currentTarget.value || null)}>
        <option value="">no other job</option>
        {others.map((one) => (
          <option key={one.id} value={one.id}>
            {jobName(one)}, {one.id}
          </option>
        ))}
      </select>
    </label>
  );
}

/** The mesh over what a camera saw. Pictures are for those who may see the cameras. */
function Overlaid({ engine, job, client }: { engine: Engine; job: Job; client: Client }) {
  const [rig, setRig] = useState<Rig | null>(null);
  const [camera, setCamera] = useState<Camera | null>(null);
  const [told, setTold] = useState("");
  useEffect(() => {
    rigOf(client, job).then(
      (known) => {
        setRig(known);
        engine.orbit.setUp(upOf(known));
      },
      () => {}, // the view then has no cameras, and another up
    );
  }, [engine, job.items?.rig]);
  const frame = engine.frames.value[engine.index.value]?.frame;
  const take = takeOf(job);
  const isPlaying = engine.playing.value;
  useEffect(() => {
    engine.setPicture(camera, null);
    setTold(camera && !take ? "its pictures are not here" : camera && !mayAs(Role.OPERATOR) ? "pictures need the role operator" : "");
    if (!camera || !frame || !take || isPlaying || !mayAs(Role.OPERATOR)) return;
    return watchPicture(client, { takeId: take, frame, cameraId: camera.id }, (picture, trouble) => {
      setTold(trouble || `over its picture of frame ${frame}`);
      engine.setPicture(camera, picture);
    });
  }, [engine, camera, frame, take, isPlaying]);
  if (!rig) return null;
  return (
    <label>
      Seen from
      <select value={camera?.id ?? ""} onChange={(event) => setCamera(rig.cameras.find((one) => one.id === event.currentTarget.value) ?? null)}>
        <option value="">anywhere</option>
        {rig.cameras.map((one) => (
          <option key={one.id} value={one.id}>
            camera {one.id}
          </option>
        ))}
      </select>
      {told && <small role="status">{told}</small>}
    </label>
  );
}

function Scrub({ engine }: { engine: Engine }) {
  const frames = engine.frames.value;
  const frame = frames[engine.index.value];
  if (!frame) return null;
  const note = frame.bridged ? ", bridged" : frame.state === FrameState.DEGRADED ? ", without some cameras" : "";
  const isAlone = engine.other.value && !engine.other.value.frames.some((one) => one.frame === frame.frame);
  return (
    <div class="player-scrub">
      <button type="button" class="main" onClick={() => engine.play(!engine.playing.value)} disabled={frames.length < 2}>
        {engine.playing.value ? "Pause" : "Play"}
      </button>
      <label>
        <span>
          Frame <output>{frame.frame}</output>
          {note}, {engine.index.value + 1} of {frames.length}
          {isAlone && <span class="bad-text">; the other job has no such frame</span>}
        </span>
        <input
          type="range"
          min={0}
          max={frames.length - 1}
          value={engine.index.value}
          onInput={(event) => {
            engine.play(false);
            engine.goTo(Number(event.currentTarget.value));
          }}
        />
      </label>
      <label>
        Speed
        <select value={engine.rate.value} onChange={(event) => engine.setRate(Number(event.currentTarget.value))}>
          {RATES.map((rate) => (
            <option key={rate} value={rate}>
              {rate ? `${rate} frames/s` : "as fast as it draws"}
            </option>
          ))}
        </select>
      </label>
    </div>
  );
}

function Numbers({ engine }: { engine: Engine }) {
  const stats = engine.stats.value;
  const difference = engine.difference.value;
  const mm = (value: number) => `${value.toFixed(value < 0.1 ? 3 : 2)} mm`;
  return (
    <>
      <Legend engine={engine} />
      {difference && (
        <p class="player-difference" role="status">
          To the other job, in this frame:{" "}
          {difference.most_mm > 0
            ? `median ${mm(difference.median_mm)}, 95 % below ${mm(difference.p95_mm)}, at most ${mm(difference.most_mm)}`
            : "no difference"}
        </p>
      )}
      {stats && stats.first_ms > 0 && (
        <p
          class="player-stats"
          data-first-ms={stats.first_ms.toFixed(0)}
          data-drawn={stats.drawnPerSecond.toFixed(1)}
          data-decode-ms={stats.decode_ms.toFixed(3)}
          data-frame-bytes={stats.frameBytes}
          data-error-mm={stats.error_mm.toFixed(5)}
          data-held-bytes={stats.heldBytes}
        >
          first frame after {durationText(stats.first_ms / 1000)}
          {engine.playing.value && <> · {stats.drawnPerSecond.toFixed(0)} drawn each second</>} · decoding {stats.decode_ms.toFixed(1)} ms a frame ·{" "}
          {bytesText(stats.frameBytes)} a frame, {bytesText(stats.rawBytes)} before compression · positions to {mm(stats.error_mm)} ·{" "}
          {countOf(stats.heldFrames, "frame")} held, {bytesText(stats.heldBytes)}
        </p>
      )}
    </>
  );
}

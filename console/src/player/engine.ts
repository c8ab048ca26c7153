import { signal } from "@preact/signals";
import type { FrameInfo, Job } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { FrameState } from "@api/report_pb";
import type { Camera as RigCamera } from "@api/rig_pb";
import type { Client } from "../api/client";
import { ApiError, asApiError } from "../api/error";
import { allFrames } from "../api/frames";
import { roundRange } from "./colors";
import type { Coloring } from "./colors";
import { Coverage } from "./coverage";
import { garmentsOf, spansOf } from "./garments";
import type { GarmentSpan } from "./garments";
import { MeshScene } from "./mesh_scene";
import { MeshStore } from "./mesh_store";
import type { Orbit } from "./orbit";
import { WORDS_OF_A_VERTEX, decodeFaces, decoderIsReady, readMesh, sigmaOf, viewsOf } from "./quantized_mesh";
import type { EncodedMesh } from "./quantized_mesh";

const SAMPLES = 4000; // of vertices, for ranges and differences
const SECOND_MS = 1000;
const STATS_MS = 400; // between two of them

export interface Stats {
  drawnPerSecond: number;
  decode_ms: number; // of a frame, the mean of the last ones
  frameBytes: number;
  rawBytes: number; // of the same frame without compression
  error_mm: number;
  first_ms: number; // until the first frame was drawn
  heldFrames: number;
  heldBytes: number;
}

export interface Difference {
  median_mm: number;
  p95_mm: number;
  most_mm: number;
}

export function hasMesh(frame: FrameInfo): boolean {
  return frame.state === FrameState.DONE || frame.state === FrameState.DEGRADED || frame.bridged;
}

/** Plays the meshes of a job, and beside it those of another one. Its signals are what the page shows. */
export class Engine {
  readonly frames = signal<FrameInfo[]>([]);
  readonly index = signal(0);
  readonly playing = signal(false);
  /** Frames a second; 0: as many as can be drawn. */
  readonly rate = signal(30);
  readonly coloring = signal<Coloring>("state");
  readonly ranges = signal<Record<string, number>>({ sigma: 1, cameras: 1, difference: 1, coverage: 1 });
  readonly wireframe = signal(false);
  readonly beside = signal(false);
  /** Of a joint template: its garments, and the one that is shown alone. */
  readonly garments = signal<GarmentSpan[]>([]);
  readonly garment = signal<GarmentSpan | null>(null);
  readonly other = signal<{ job: Job; frames: FrameInfo[] } | null>(null);
  readonly difference = signal<Difference | null>(null);
  readonly counted = signal(0); // frames that the coverage is of
  readonly stats = signal<Stats | null>(null);
  readonly error = signal<ApiError | null>(null);
  readonly waiting = signal(true);

  private readonly scene: MeshScene;
  private readonly store: MeshStore;
  private otherStore: MeshStore | null = null;
  private otherPlaces = new Map<string, number>();
  private coverage = new Coverage(0);
  private readonly began_ms = performance.now();
  private first_ms = 0;
  private decode_ms = 0;
  private vertices = 0;
  private shown = ""; // the frame whose mesh is drawn
  private shownOther: EncodedMesh | undefined;
  private compared = ""; // frame that it was compared with
  private clock = { index: 0, time_ms: 0 };
  private readonly drawnAt: number[] = [];
  private told_ms = 0;
  private request = 0;
  private closed = false;

  constructor(
    private readonly client: Client,
    private readonly jobId: string,
    canvas: HTMLCanvasElement,
    /** The newest frame is gone to when there is one. */
    private readonly follows = false,
    mesh = "",
  ) {
    this.scene = new MeshScene(canvas, () => this.draw());
    this.store = new MeshStore(client, jobId, (frame) => this.arrived(frame), mesh);
  }

  close(): void {
    this.closed = true;
    cancelAnimationFrame(this.request);
    this.store.close();
    this.otherStore?.close();
    this.scene.dispose();
  }

  get orbit(): Orbit {
    return this.scene.orbit;
  }
  resize(): void {
    this.scene.resize();
  }
  setPicture(camera: RigCamera | null, picture: HTMLCanvasElement | null): void {
    this.scene.setPicture(camera, picture);
    this.draw();
  }

  /** Frames of the job as they are now; those with meshes are played, and the newest one where that is followed. */
  setFrames(all: FrameInfo[]): void {
    const frames = all.filter(hasMesh).sort((a, b) => a.frame.localeCompare(b.frame, "en", { numeric: true }));
    if (frames.length === this.frames.value.length) return;
    const [isFirst, here] = [this.frames.value.length === 0, this.frame];
    this.frames.value = frames;
    if (isFirst) void this.begin(frames);
    else if (this.vertices) this.takeFrames(here);
  }

  private takeFrames(here: string): void {
    this.store.setNames(this.frames.value.map((frame) => frame.frame));
    const place = this.frames.value.findIndex((frame) => frame.frame === here);
    if (this.follows) this.goTo(this.frames.value.length - 1);
    else if (place !== this.index.value) this.goTo(place);
  }

  /** Name of the frame that is looked at. */
  private get frame(): string {
    return this.frames.value[this.index.value]?.frame ?? "";
  }

  /** The first mesh brings the faces of all. */
  private async begin(frames: FrameInfo[]): Promise<void> {
    const first = frames[0]!.frame;
    try {
      await decoderIsReady;
      const mesh = readMesh(await this.client.mesh(this.jobId, first, this.store.mesh, true));
      if (this.closed) return;
      this.vertices = mesh.vertices;
      this.coverage = new Coverage(mesh.vertices);
      const faces = decodeFaces(mesh);
      this.scene.setTopology(mesh.vertices, faces);
      this.display(first, mesh);
      this.findRanges();
      this.waiting.value = false;
      this.takeFrames(first);
      if (!this.follows) this.garments.value = spansOf(await garmentsOf(this.client, this.jobId, first), faces);
    } catch (reason) {
      this.error.value = asApiError(reason);
      this.waiting.value = false;
    }
  }

  private arrived(frame: string): void {
    const error = this.store.errorOf(frame);
    if (error && frame === this.frame) this.error.value = error;
    if (frame === this.frame || this.playing.value) this.draw();
    this.updateStats();
  }

  goTo(index: number): void {
    const last = this.frames.value.length - 1;
    this.index.value = Math.max(0, Math.min(last, index));
    this.error.value = null;
    this.restartClock();
    this.store.moveTo(this.index.value);
    this.followOther();
    this.draw();
  }

  step(by: number): void {
    this.playing.value = false;
    const count = this.frames.value.length;
    if (count) this.goTo((this.index.value + by + count) % count);
  }

  play(plays: boolean): void {
    this.playing.value = plays && this.frames.value.length > 1;
    this.restartClock();
    this.draw();
  }

  setRate(rate: number): void {
    this.rate.value = rate;
    this.restartClock();
  }

  private restartClock(): void {
    this.clock = { index: this.index.value, time_ms: performance.now() };
  }

  setColoring(coloring: Coloring): void {
    this.coloring.value = coloring;
    this.draw();
  }
  showGarment(garment: GarmentSpan | null): void {
    this.garment.value = garment;
    this.scene.setSpan(garment);
    this.draw();
  }
  setWireframe(on: boolean): void {
    this.wireframe.value = on;
    this.draw();
  }
  setBeside(on: boolean): void {
    this.beside.value = on;
    this.draw();
  }

  /** Of the same template; null: none. */
  async compareWith(jobId: string | null, own: Job): Promise<void> {
    this.otherStore?.close();
    this.otherStore = null;
    this.other.value = null;
    this.difference.value = null;
    this.shownOther = undefined;
    this.scene.show(1, null);
    if (jobId) {
      const [job, frames] = await Promise.all([
        this.client.call(Jobs.method.getJob, { jobId }),
        allFrames(this.client, jobId),
      ]);
      const shared = this.sharedFrames(own, job, frames.filter(hasMesh));
      this.otherPlaces = new Map(shared.map((frame, i) => [frame.frame, i]));
      this.otherStore = new MeshStore(this.client, jobId, () => this.draw(), this.store.mesh);
      this.otherStore.setNames(shared.map((frame) => frame.frame));
      this.other.value = { job, frames: shared };
      this.setColoring("difference");
      this.followOther();
    } else if (this.coloring.value === "difference") this.setColoring("state");
    this.beside.value &&= jobId !== null;
    this.draw();
  }

  private sharedFrames(own: Job, job: Job, frames: FrameInfo[]): FrameInfo[] {
    const refusal = (message: string, remedy: string) => new ApiError("FAILED_PRECONDITION", message, "", remedy);
    if (job.inputs?.garment !== own.inputs?.garment)
      throw refusal(`job ${job.id} has another template`, "compare jobs of one template");
    const names = new Set(this.frames.value.map((frame) => frame.frame));
    const shared = frames.filter((frame) => names.has(frame.frame));
    if (shared.length === 0) throw refusal(`job ${job.id} has no frame that this job has, too`, "compare jobs of one take");
    return shared;
  }

  private followOther(): void {
    const at = this.otherPlaces.get(this.frame);
    if (at !== undefined) this.otherStore?.moveTo(at);
  }

  /** Draws once, and again and again while it plays. */
  private draw(): void {
    if (this.request || this.closed) return;
    this.request = requestAnimationFrame((now) => {
      this.request = 0;
      this.tick(now);
      if (this.playing.value) this.draw();
    });
  }

  private tick(now: number): void {
    if (this.playing.value) this.advance();
    const frame = this.frame;
    const mesh = this.store.get(frame);
    if (mesh && frame !== this.shown && this.vertices) this.display(frame, mesh);
    if (this.vertices) this.showOther();
    this.scene.look = {
      coloring: this.coloring.value,
      range: this.ranges.value[this.coloring.value] ?? 1,
      wireframe: this.wireframe.value,
      beside: this.beside.value,
    };
    if (this.coloring.value === "coverage") this.scene.setCoverage(this.coverage.shares());
    this.scene.draw();
    this.count(now);
  }

  /** To the frame that the clock has come to; the clock waits for meshes that are not there. */
  private advance(): void {
    const count = this.frames.value.length;
    const passed = this.rate.value ? Math.floor(((performance.now() - this.clock.time_ms) * this.rate.value) / SECOND_MS) : 1;
    const wanted = (this.clock.index + passed) % count;
    if (wanted === this.index.value) return;
    const { frame } = this.frames.value[wanted]!;
    if (!this.store.get(frame) && !this.store.errorOf(frame)) {
      this.restartClock();
      this.store.moveTo(this.index.value);
      return;
    }
    this.index.value = wanted;
    if (!this.rate.value) this.clock.index = wanted;
    this.store.moveTo(wanted);
    this.followOther();
  }

  private display(frame: string, mesh: EncodedMesh): void {
    if (mesh.vertices !== this.vertices) {
      this.error.value = new ApiError("DATA_LOSS", `frame ${frame} has another number of vertices`);
      return;
    }
    const begin = performance.now();
    this.scene.show(0, mesh);
    const took = performance.now() - begin;
    this.decode_ms = this.decode_ms ? 0.9 * this.decode_ms + 0.1 * took : took;
    this.shown = frame;
    this.coverage.add(frame, this.scene.wordsOf(0)!);
    this.counted.value = this.coverage.frames;
    if (!this.first_ms) this.drawFirst();
  }

  private drawFirst(): void {
    requestAnimationFrame(() => {
      this.first_ms = performance.now() - this.began_ms;
      this.updateStats();
    });
    this.draw();
  }

  private showOther(): void {
    if (!this.otherStore) return;
    const mesh = this.otherStore.get(this.frame);
    if (mesh === this.shownOther && this.compared === this.shown) return;
    this.scene.show(1, mesh?.vertices === this.vertices ? mesh : null);
    this.shownOther = mesh;
    this.compared = this.shown;
    this.compare();
  }

  private compare(): void {
    const sorted = this.scene.differences(Math.max(1, Math.floor(this.vertices / SAMPLES))).sort((a, b) => a - b);
    if (sorted.length === 0 || this.shown !== this.frame) {
      this.difference.value = null;
      return;
    }
    const at = (share: number) => sorted[Math.floor(share * (sorted.length - 1))]!;
    const isFirst = !this.difference.value && this.ranges.value.difference === 1;
    this.difference.value = { median_mm: at(0.5), p95_mm: at(0.95), most_mm: at(1) };
    if (isFirst) this.ranges.value = { ...this.ranges.value, difference: roundRange(sorted) };
  }

  private findRanges(): void {
    const words = this.scene.wordsOf(0);
    if (!words) return;
    const sigmas: number[] = [];
    const cameras: number[] = [];
    const every = Math.max(1, Math.floor(this.vertices / SAMPLES));
    for (let v = 0; v < this.vertices; v += every) {
      const traits = words[WORDS_OF_A_VERTEX * v + 3]!;
      sigmas.push(sigmaOf(traits));
      cameras.push(viewsOf(traits));
    }
    this.ranges.value = { ...this.ranges.value, sigma: roundRange(sigmas), cameras: Math.max(1, ...cameras) };
  }

  private count(now: number): void {
    this.drawnAt.push(now);
    while (this.drawnAt.length > 2 && now - this.drawnAt[0]! > 2 * SECOND_MS) this.drawnAt.shift();
    if (this.playing.value && now - this.told_ms > STATS_MS) {
      this.told_ms = now;
      this.updateStats();
    }
  }

  private updateStats(): void {
    const mesh = this.store.get(this.shown);
    const span = (this.drawnAt.at(-1) ?? 0) - (this.drawnAt[0] ?? 0);
    this.stats.value = {
      drawnPerSecond: span > 0 ? ((this.drawnAt.length - 1) * SECOND_MS) / span : 0,
      decode_ms: this.decode_ms,
      frameBytes: mesh?.bytes ?? this.stats.value?.frameBytes ?? 0,
      rawBytes: 8 * this.vertices,
      error_mm: mesh?.error_mm ?? this.stats.value?.error_mm ?? 0,
      first_ms: this.first_ms,
      heldFrames: this.store.heldFrames,
      heldBytes: this.store.heldBytes + (this.otherStore?.heldBytes ?? 0),
    };
  }
}

import type { Client } from "../api/client";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { readMesh } from "./quantized_mesh";
import type { EncodedMesh } from "./quantized_mesh";

const MOST_BYTES = 192 << 20; // of encoded meshes, for each job
const AT_ONCE = 3; // a browser has six connections to a server
const PAUSE_MS = 1000; // before a mesh is asked for again that could not be sent

/** Meshes of a job: fetched ahead of where they are looked at, and dropped behind it when they are too many. */
export class MeshStore {
  private names: string[] = [];
  private readonly meshes = new Map<string, EncodedMesh>();
  private readonly failed = new Map<string, ApiError>();
  private readonly fetching = new Set<string>();
  private readonly abort = new AbortController();
  private position = 0;
  private held = 0;
  private pauses = false;

  constructor(
    private readonly client: Client,
    private readonly jobId: string,
    private readonly onArrival: (frame: string) => void,
    /** Of each frame's meshes; empty: the garment, or the only one. */
    readonly mesh = "",
  ) {}

  /** Names of the frames that have a mesh, in their order. */
  setNames(names: string[]): void {
    this.names = names;
    this.fill();
  }

  get heldBytes(): number {
    return this.held;
  }
  get heldFrames(): number {
    return this.meshes.size;
  }
  get(frame: string): EncodedMesh | undefined {
    return this.meshes.get(frame);
  }
  errorOf(frame: string): ApiError | undefined {
    return this.failed.get(frame);
  }

  /** Where the sequence is looked at: from here on it is fetched, and round to its beginning. */
  moveTo(index: number): void {
    this.position = Math.max(0, index); // a frame that is gone has none
    this.fill();
  }

  close(): void {
    this.abort.abort();
    this.meshes.clear();
    this.held = 0;
  }

  private get meanBytes(): number {
    return this.meshes.size ? this.held / this.meshes.size : 0;
  }

  /** Fetches what comes next and has room. */
  private fill(): void {
    const count = this.names.length;
    const ahead = Math.min(count, this.meanBytes ? Math.floor(MOST_BYTES / this.meanBytes) : AT_ONCE);
    for (let k = 0; k < ahead && this.fetching.size < AT_ONCE && !this.pauses; ++k) {
      const frame = this.names[(this.position + k) % count]!;
      if (!this.meshes.has(frame) && !this.fetching.has(frame) && !this.failed.has(frame)) void this.fetch(frame);
    }
  }

  private async fetch(frame: string): Promise<void> {
    this.fetching.add(frame);
    try {
      const bytes = await this.client.mesh(this.jobId, frame, this.mesh, false, this.abort.signal);
      if (!this.abort.signal.aborted) this.keep(frame, readMesh(bytes));
    } catch (reason) {
      if (!this.abort.signal.aborted) this.fail(frame, asApiError(reason));
    }
    this.fetching.delete(frame);
    if (this.abort.signal.aborted) return;
    this.onArrival(frame);
    this.fill();
  }

  private keep(frame: string, mesh: EncodedMesh): void {
    this.meshes.set(frame, mesh);
    this.held += mesh.bytes;
    const places = new Map(this.names.map((name, i) => [name, i]));
    const distance = (name: string) => ((places.get(name) ?? -1) - this.position + this.names.length) % this.names.length;
    while (this.held > MOST_BYTES && this.meshes.size > 1) {
      const farthest = [...this.meshes.keys()].reduce((a, b) => (distance(a) > distance(b) ? a : b));
      this.held -= this.meshes.get(farthest)!.bytes;
      this.meshes.delete(farthest);
    }
  }

  private fail(frame: string, error: ApiError): void {
    // These pass.
    if (["RESOURCE_EXHAUSTED", "UNAVAILABLE", "UNREACHABLE"].includes(error.code)) {
      this.pauses = true;
      setTimeout(() => {
        this.pauses = false;
        if (!this.abort.signal.aborted) this.fill();
      }, PAUSE_MS);
    } else {
      this.failed.set(frame, error);
    }
  }
}

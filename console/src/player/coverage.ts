import { WORDS_OF_A_VERTEX, stateOf } from "./quantized_mesh";

/** In how many of the frames that were shown each vertex was seen by cameras. */
export class Coverage {
  private readonly seen: Uint16Array;
  private readonly known = new Set<string>();
  private readonly result: Uint8Array;

  constructor(vertices: number) {
    this.seen = new Uint16Array(vertices);
    this.result = new Uint8Array(vertices);
  }

  get frames(): number {
    return this.known.size;
  }

  /** `words` as decodeVertices has them; a frame counts once. */
  add(frame: string, words: Uint16Array): void {
    if (this.known.has(frame)) return;
    this.known.add(frame);
    for (let v = 0; v < this.seen.length; ++v) {
      const state = stateOf(words[WORDS_OF_A_VERTEX * v + 3]!);
      if (state === 1 || state === 2) ++this.seen[v]!;
    }
  }

  /** 255: in all. */
  shares(): Uint8Array {
    const factor = 255 / Math.max(1, this.known.size);
    for (let v = 0; v < this.seen.length; ++v) this.result[v] = factor * this.seen[v]!;
    return this.result;
  }
}

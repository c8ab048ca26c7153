import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";

/** A mesh as the daemon sends it (services/server/console/quantized_mesh.h), its vertices and faces still encoded. */
export interface EncodedMesh {
  vertices: number;
  faces: number;
  /** A position is low_mm + step_mm * its three numbers. */
  step_mm: [number, number, number];
  low_mm: [number, number, number];
  /** The largest distance of a vertex from where it was before it was quantised. */
  error_mm: number;
  bytes: number;
  encodedVertices: Uint8Array;
  encodedFaces: Uint8Array;
}

export const WORDS_OF_A_VERTEX = 4; // x, y, z, traits; 16 bits each
const BYTES_OF_A_VERTEX = 2 * WORDS_OF_A_VERTEX;
const HEAD_BYTES = 88;
const MAGIC = "weftmsh1";

/** Throws where that is no such mesh. */
export function readMesh(bytes: ArrayBuffer): EncodedMesh {
  const magic = new TextDecoder().decode(bytes.slice(0, MAGIC.length));
  if (bytes.byteLength < HEAD_BYTES || magic !== MAGIC) throw new Error("the daemon's mesh cannot be read: load the page again");
  const head = new DataView(bytes);
  const count = (k: number) => head.getUint32(8 + 4 * k, true);
  const number = (k: number) => head.getFloat64(24 + 8 * k, true);
  const facesBegin = HEAD_BYTES + count(2);
  return {
    vertices: count(0),
    faces: count(1),
    step_mm: [number(0), number(1), number(2)],
    low_mm: [number(3), number(4), number(5)],
    error_mm: number(7),
    bytes: bytes.byteLength,
    encodedVertices: new Uint8Array(bytes, HEAD_BYTES, count(2)),
    encodedFaces: new Uint8Array(bytes, facesBegin, count(3)),
  };
}

export const decoderIsReady: Promise<void> = MeshoptDecoder.ready;

/** Into `words` [vertices][4]. */
export function decodeVertices(mesh: EncodedMesh, words: Uint16Array): void {
  const target = new Uint8Array(words.buffer, words.byteOffset, words.byteLength);
  MeshoptDecoder.decodeVertexBuffer(target, mesh.vertices, BYTES_OF_A_VERTEX, mesh.encodedVertices);
}

/** Vertices of the faces, [faces][3]. */
export function decodeFaces(mesh: EncodedMesh): Uint32Array {
  const indices = new Uint32Array(3 * mesh.faces);
  MeshoptDecoder.decodeIndexBuffer(new Uint8Array(indices.buffer), indices.length, 4, mesh.encodedFaces);
  return indices;
}

const viewsField = (traits: number): number => (traits >> 2) & 63;
/** Bridged vertices have no views; one that has is driven, and has one view less. */
const isDriven = (traits: number): boolean => (traits & 3) === 3 && viewsField(traits) > 0;
/** How a vertex is known, as VertexState. */
export const stateOf = (traits: number): number => (isDriven(traits) ? 4 : traits & 3);
export const viewsOf = (traits: number): number => viewsField(traits) - (isDriven(traits) ? 1 : 0);
/** NaN: not known. */
export function sigmaOf(traits: number): number {
  const byte = traits >> 8;
  return byte === 255 ? NaN : 0.001 * 2 ** (byte / 16);
}

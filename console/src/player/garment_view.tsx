import { useEffect, useState } from "preact/hooks";
import { BufferAttribute, BufferGeometry, DoubleSide, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial } from "three";
import type { Object3D } from "three";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { Library } from "@api/library_pb";
import type { Client } from "../api/client";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { countOf } from "../ui/format";
import { Failure, Waiting } from "../ui/parts";
import { CLOTH_COLOR } from "./colors";
import { SpaceStage } from "./space_stage";
import { colorOf } from "./space_view";

const SEAM_COLOR = 0xff5c5c;

/** A mesh of another program, every corner of its triangles apart. */
interface Corners {
  places: Float32Array; // [corners][3]
  texture: Float32Array | null; // [corners][2]
}

/** The pieces of the cloth that lie flat in its texture, as the daemon's ChartsOfTexture finds them. */
interface Charts {
  ofFace: Int32Array;
  count: number;
  seams: Float32Array; // ends of edges, [seams][2][3]
}

/** Numbers for what is equal. */
class Numbers {
  private readonly known = new Map<string, number>();
  of(key: string): number {
    const found = this.known.get(key);
    if (found !== undefined) return found;
    this.known.set(key, this.known.size);
    return this.known.size - 1;
  }
}

export function findCharts({ places, texture }: Corners): Charts {
  const corners = places.length / 3;
  const faces = corners / 3;
  const [vertexNumbers, placeNumbers] = [new Numbers(), new Numbers()];
  const vertex = Int32Array.from({ length: corners }, (_, c) => vertexNumbers.of(places.subarray(3 * c, 3 * c + 3).join()));
  const place = Int32Array.from({ length: corners }, (_, c) =>
    texture ? placeNumbers.of(`${vertex[c]} ${texture[2 * c]} ${texture[2 * c + 1]}`) : vertex[c]!,
  );
  const parent = Int32Array.from({ length: faces }, (_, f) => f);
  const root = (f: number): number => {
    while (parent[f] !== f) f = parent[f] = parent[parent[f]!]!;
    return f;
  };
  const edges = new Map<string, { face: number; places: string }>();
  const seams: number[] = [];
  for (let c = 0; c < corners; ++c) {
    const face = Math.floor(c / 3);
    const next = c % 3 === 2 ? c - 2 : c + 1;
    const [low, high] = vertex[c]! < vertex[next]! ? [c, next] : [next, c];
    const key = `${vertex[low]} ${vertex[high]}`;
    const ends = `${place[low]} ${place[high]}`;
    const other = edges.get(key);
    if (!other) edges.set(key, { face, places: ends });
    else if (other.places === ends) parent[root(face)] = root(other.face);
    else seams.push(...places.subarray(3 * c, 3 * c + 3), ...places.subarray(3 * next, 3 * next + 3));
  }
  const numbers = new Numbers();
  const ofFace = Int32Array.from({ length: faces }, (_, f) => numbers.of(String(root(f))));
  return { ofFace, count: new Set(ofFace).size, seams: Float32Array.from(seams) };
}

function readCorners(bytes: ArrayBuffer, file: string): Corners {
  const geometries: BufferGeometry[] = [];
  if (file.toLowerCase().endsWith(".ply")) {
    geometries.push(new PLYLoader().parse(bytes));
  } else {
    new OBJLoader().parse(new TextDecoder().decode(bytes)).traverse((thing: Object3D) => {
      if (thing instanceof Mesh) geometries.push(thing.geometry as BufferGeometry);
    });
  }
  const places: number[] = [];
  const texture: number[] = [];
  let isPlaced = true;
  for (const geometry of geometries.map((one) => (one.getIndex() ? one.toNonIndexed() : one))) {
    const [position, uv] = [geometry.getAttribute("position"), geometry.getAttribute("uv")];
    for (let c = 0; c < position.count; ++c) {
      places.push(position.getX(c), position.getY(c), position.getZ(c));
      if (uv) texture.push(uv.getX(c), uv.getY(c));
    }
    isPlaced &&= Boolean(uv);
  }
  return { places: Float32Array.from(places), texture: isPlaced ? Float32Array.from(texture) : null };
}

function drawingOf({ places, texture }: Corners, charts: Charts): Group {
  const shown = new BufferGeometry();
  shown.setAttribute("position", new BufferAttribute(places, 3));
  const colors = new Float32Array(places.length);
  for (let c = 0; c < places.length / 3; ++c) {
    const chart = charts.ofFace[Math.floor(c / 3)]!;
    colors.set(texture ? colorOf(chart).toArray() : CLOTH_COLOR.map((value) => value / 255), 3 * c);
  }
  shown.setAttribute("color", new Float32BufferAttribute(colors, 3));
  shown.computeVertexNormals();
  const all = new Group();
  const cloth = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
  [cloth.polygonOffset, cloth.polygonOffsetFactor, cloth.polygonOffsetUnits] = [true, 1, 1];
  all.add(new Mesh(shown, cloth));
  const seams = new BufferGeometry();
  seams.setAttribute("position", new BufferAttribute(charts.seams, 3));
  all.add(new LineSegments(seams, new LineBasicMaterial({ color: SEAM_COLOR })));
  return all;
}

/** A garment of the library that no board was printed on: its charts and the seams between them, frame by frame. */
export function GarmentView({ client, item, files }: { client: Client; item: string; files: string[] }) {
  const [frame, setFrame] = useState(0);
  const [mesh, setMesh] = useState<{ file: string; corners: Corners; charts: Charts } | null>(null);
  const [error, setError] = useState<ApiError | null>(null);
  const file = files[frame] ?? "";
  useEffect(() => {
    let isGone = false;
    client
      .file(Library.method.fetchFile, { kind: "ITEM_KIND_GARMENT", item: `sha256:${item}`, path: file })
      .then((bytes) => {
        const corners = readCorners(bytes, file);
        if (!isGone) setMesh({ file, corners, charts: findCharts(corners) });
      })
      .catch((reason: unknown) => !isGone && setError(asApiError(reason)));
    return () => {
      isGone = true;
    };
  }, [item, file]);
  if (!mesh) return error ? <Failure error={error} /> : <Waiting for="the garment" />;
  const { corners, charts } = mesh;
  return (
    <section aria-label="The garment in space">
      <h2>
        {mesh.file}: {countOf(charts.ofFace.length, "triangle")}
      </h2>
      <Failure error={error} />
      <SpaceStage label="The garment, in the colours of its charts." filled={mesh} show={(view) => view.show([drawingOf(corners, charts)], [0, 1, 0])} />
      {files.length > 1 && (
        <label>
          Frame {frame + 1} of {files.length}
          <input type="range" min={0} max={files.length - 1} value={frame} onInput={(event) => setFrame(event.currentTarget.valueAsNumber)} />
        </label>
      )}
      <p class="player-legend">
        {corners.texture
          ? `${countOf(charts.count, "chart")} of its texture, each in a colour of its own. Seams are red.`
          : "It has no texture coordinates, so charts and seams are not known."}
      </p>
    </section>
  );
}

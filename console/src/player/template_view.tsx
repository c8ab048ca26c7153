import { fromJsonString } from "@bufbuild/protobuf";
import { useEffect, useState } from "preact/hooks";
import {
  BufferGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  LineLoop,
  Mesh,
  MeshLambertMaterial,
  Vector3,
} from "three";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { Library } from "@api/library_pb";
import { TemplateSchema } from "@api/template_pb";
import type { Template } from "@api/template_pb";
import type { Client } from "../api/client";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { countOf } from "../ui/format";
import { Failure, Table, Waiting } from "../ui/parts";
import { CLOTH_COLOR } from "./colors";
import { SpaceStage } from "./space_stage";
import { colorOf } from "./space_view";

const SEAM_COLOR = 0xff5c5c;
const OPENING_COLOR = 0xffe066;

interface Sewn {
  template: Template;
  mesh: BufferGeometry; // indexed, with positions in mm
  panelOf: Int32Array; // of each vertex; -1: none
  panels: number;
}

/** Which vertices hang together by the faces of panels; the others close seams and holes. */
function findPanels(mesh: BufferGeometry, panelFaces: number): { panelOf: Int32Array; panels: number } {
  const index = mesh.getIndex()!.array;
  const vertices = mesh.getAttribute("position").count;
  const parent = Int32Array.from({ length: vertices }, (_, v) => v);
  const root = (v: number): number => {
    while (parent[v] !== v) v = parent[v] = parent[parent[v]!]!;
    return v;
  };
  const inPanel = new Uint8Array(vertices);
  for (let f = 0; f < 3 * panelFaces; f += 3) {
    const [a, b, c] = [index[f]!, index[f + 1]!, index[f + 2]!];
    parent[root(b)] = root(a);
    parent[root(c)] = root(a);
    inPanel[a] = inPanel[b] = inPanel[c] = 1;
  }
  const numbers = new Map<number, number>();
  const panelOf = Int32Array.from({ length: vertices }, (_, v) => {
    if (!inPanel[v]) return -1;
    const top = root(v);
    if (!numbers.has(top)) numbers.set(top, numbers.size);
    return numbers.get(top)!;
  });
  return { panelOf, panels: numbers.size };
}

/** Hides texture coordinates of faces: PLYLoader would take vertices apart for them, but seams name vertices. */
function withoutTexture(ply: ArrayBuffer): ArrayBuffer {
  const bytes = new Uint8Array(ply);
  const header = new TextDecoder("latin1").decode(bytes.subarray(0, 4096));
  const at = header.indexOf(" texcoord\n");
  if (at >= 0 && at < header.indexOf("end_header")) bytes[at + 1] = "_".charCodeAt(0);
  return ply;
}

async function readTemplate(client: Client, item: string): Promise<Sewn> {
  const file = (path: string) => client.file(Library.method.fetchFile, { kind: "ITEM_KIND_TEMPLATE", item: `sha256:${item}`, path });
  const template = fromJsonString(TemplateSchema, new TextDecoder().decode(await file("template.json")), { ignoreUnknownFields: true });
  const mesh = new PLYLoader().parse(withoutTexture(await file(template.mesh || "mesh.ply")));
  mesh.setAttribute("position", new Float32BufferAttribute(mesh.getAttribute("position").array, 3)); // doubles are none of WebGL's
  return { template, mesh, ...findPanels(mesh, template.panelFaces) };
}

function drawingOf({ template, mesh, panelOf }: Sewn): Group {
  const positions = mesh.getAttribute("position");
  const shown = new BufferGeometry();
  shown.setIndex(mesh.getIndex());
  shown.setAttribute("position", positions);
  const colors = new Float32Array(3 * positions.count);
  for (let v = 0; v < positions.count; ++v) {
    const panel = panelOf[v]!;
    const color = panel < 0 ? CLOTH_COLOR.map((value) => (0.6 * value) / 255) : colorOf(panel).toArray();
    colors.set(color, 3 * v);
  }
  shown.setAttribute("color", new Float32BufferAttribute(colors, 3));
  shown.computeVertexNormals();
  const all = new Group();
  const cloth = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide, flatShading: true });
  // Behind the lines that lie on it.
  [cloth.polygonOffset, cloth.polygonOffsetFactor, cloth.polygonOffsetUnits] = [true, 1, 1];
  all.add(new Mesh(shown, cloth));
  const along = (vertices: number[]) => new BufferGeometry().setFromPoints(vertices.map((v) => new Vector3().fromBufferAttribute(positions, v)));
  for (const seam of template.seams)
    for (const side of [seam.sideA, seam.sideB, seam.middle])
      if (side.length) all.add(new Line(along(side), new LineBasicMaterial({ color: SEAM_COLOR })));
  for (const opening of template.openings) all.add(new LineLoop(along(opening.vertices), new LineBasicMaterial({ color: OPENING_COLOR })));
  return all;
}

/** A template of the library: its panels, the seams between them, and what is open. */
export function TemplateView({ client, item }: { client: Client; item: string }) {
  const [sewn, setSewn] = useState<Sewn | null>(null);
  const [error, setError] = useState<ApiError | null>(null);
  useEffect(() => {
    readTemplate(client, item).then(setSewn, (reason: unknown) => setError(asApiError(reason)));
  }, [item]);
  if (!sewn) return error ? <Failure error={error} /> : <Waiting for="the template" />;
  const { template, mesh, panels } = sewn;
  const faces = (mesh.getIndex()?.count ?? 0) / 3;
  return (
    <section aria-label="The template in space">
      <h2>
        {countOf(mesh.getAttribute("position").count, "vertex", "vertices")}, {countOf(faces, "face")}
      </h2>
      <SpaceStage label="The template at rest, in the colours of its panels." filled={template.hash} show={(view) => view.show([drawingOf(sewn)], [0, -1, 0])} />
      <p class="player-legend">
        {panels > 0 ? `${countOf(panels, "panel")}, each in a colour of its own. Seams are red, openings yellow.` : "It was imported, so panels and seams are not known."}
      </p>
      {template.seams.length > 0 && (
        <Table label="Seams" head={["seam", "panels", "length, mm", "gap, mm", "widest, mm"]}>
          {template.seams.map((seam, k) => (
            <tr key={k}>
              <td>{k + 1}</td>
              <td>
                {seam.panelA + 1} and {seam.panelB + 1}
              </td>
              <td class="number">{seam.lengthMm.toFixed(0)}</td>
              <td class="number">{seam.gapMm.toFixed(1)}</td>
              <td class="number">{seam.maxGapMm.toFixed(1)}</td>
            </tr>
          ))}
        </Table>
      )}
      {template.openings.length > 0 && (
        <Table label="Openings" head={["opening", "panels", "length, mm"]}>
          {template.openings.map((opening, k) => (
            <tr key={k}>
              <td>{k + 1}</td>
              <td>{opening.panels.map((panel) => panel + 1).join(", ")}</td>
              <td class="number">{opening.lengthMm.toFixed(0)}</td>
            </tr>
          ))}
        </Table>
      )}
    </section>
  );
}

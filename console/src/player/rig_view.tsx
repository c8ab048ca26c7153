import { useEffect, useState } from "preact/hooks";
import {
  BoxGeometry,
  BufferGeometry,
  CanvasTexture,
  EdgesGeometry,
  Float32BufferAttribute,
  Group,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  Sprite,
  SpriteMaterial,
  Vector3,
} from "three";
import type { Camera, Rig } from "@api/rig_pb";
import type { Client } from "../api/client";
import { asApiError } from "../api/error";
import type { ApiError } from "../api/error";
import { Failure, Table, Waiting } from "../ui/parts";
import { readRig, upOf } from "./rig_pictures";
import { SpaceStage } from "./space_stage";
import { colorOf } from "./space_view";

const SIGMA_SCALE = 50; // how much larger uncertainties are drawn
const STAGE_COLOR = 0xffc552;

/** The camera's axes and centre in the world. */
function poseOf(camera: Camera): Matrix4 {
  const r = camera.rotation;
  const [x, y, z] = camera.translationMm as [number, number, number];
  return new Matrix4().set(r[0]!, r[1]!, r[2]!, x, r[3]!, r[4]!, r[5]!, y, r[6]!, r[7]!, r[8]!, z, 0, 0, 0, 1).invert();
}

function centerOf(camera: Camera): Vector3 {
  return new Vector3().setFromMatrixPosition(poseOf(camera));
}

/** What a camera sees, to a depth. */
function frustum(camera: Camera, depth_mm: number, color: ReturnType<typeof colorOf>): LineSegments {
  const corner = (u: number, v: number) =>
    new Vector3(((u - (camera.cxPx ?? 0)) / (camera.fxPx ?? 1)) * depth_mm, ((v - (camera.cyPx ?? 0)) / (camera.fyPx ?? 1)) * depth_mm, depth_mm);
  const [width, height] = [camera.widthPx ?? 1, camera.heightPx ?? 1];
  const corners = [corner(0, 0), corner(width, 0), corner(width, height), corner(0, height)];
  const lines = corners.flatMap((here, k) => [new Vector3(), here, here, corners[(k + 1) % 4]!]);
  // A tick tells which side of the picture is up.
  lines.push(corners[0]!, corner(width / 2, -height / 5), corner(width / 2, -height / 5), corners[1]!);
  const geometry = new BufferGeometry().setFromPoints(lines.map((point) => point.clone().applyMatrix4(poseOf(camera))));
  return new LineSegments(geometry, new LineBasicMaterial({ color }));
}

function nameOf(text: string, size_mm: number): Sprite {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [256, 64];
  const context = canvas.getContext("2d");
  if (context) {
    context.font = "bold 40px sans-serif";
    context.textAlign = "center";
    context.lineWidth = 8;
    context.strokeStyle = "#000";
    context.fillStyle = "#fff";
    context.strokeText(text, 128, 46);
    context.fillText(text, 128, 46);
  }
  const sprite = new Sprite(new SpriteMaterial({ map: new CanvasTexture(canvas), depthTest: false }));
  sprite.scale.set(4 * size_mm, size_mm, 1);
  return sprite;
}

function drawingOf(rig: Rig, chosen: string): Group {
  const all = new Group();
  const centers = rig.cameras.map(centerOf);
  const middle = centers.reduce((sum, center) => sum.add(center), new Vector3()).divideScalar(Math.max(1, centers.length));
  const reach = Math.max(100, ...centers.map((center) => center.distanceTo(middle)));
  rig.cameras.forEach((camera, k) => {
    const isChosen = camera.id === chosen;
    all.add(frustum(camera, isChosen ? reach : 0.22 * reach, colorOf(k)));
    const name = nameOf(camera.id, 0.09 * reach);
    name.position.copy(centers[k]!);
    all.add(name);
    const [x, y, z] = camera.sigmas?.centerMm ?? [];
    if (x === undefined) return;
    const sphere = new Mesh(new SphereGeometry(1, 16, 10), new MeshBasicMaterial({ color: colorOf(k), transparent: true, opacity: 0.55 }));
    sphere.scale.set(x, y ?? x, z ?? x).multiplyScalar(SIGMA_SCALE);
    sphere.position.copy(centers[k]!);
    all.add(sphere);
  });
  const [low, high] = [rig.calibration?.stageLowMm ?? [], rig.calibration?.stageHighMm ?? []];
  if (low.length === 3 && high.length === 3) {
    const [from, to] = [new Vector3(...(low as [number, number, number])), new Vector3(...(high as [number, number, number]))];
    const size = to.clone().sub(from);
    const box = new LineSegments(new EdgesGeometry(new BoxGeometry(size.x, size.y, size.z)), new LineBasicMaterial({ color: STAGE_COLOR }));
    box.position.copy(from.add(to).divideScalar(2));
    all.add(box);
  }
  all.add(axes(0.15 * reach));
  return all;
}

/** Of the world: x red, y green, z blue. */
function axes(length_mm: number): LineSegments {
  const geometry = new BufferGeometry();
  const l = length_mm;
  geometry.setAttribute("position", new Float32BufferAttribute([0, 0, 0, l, 0, 0, 0, 0, 0, 0, l, 0, 0, 0, 0, 0, 0, l], 3));
  geometry.setAttribute("color", new Float32BufferAttribute([1, 0.3, 0.3, 1, 0.3, 0.3, 0.3, 1, 0.3, 0.3, 1, 0.3, 0.4, 0.6, 1, 0.4, 0.6, 1], 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
}

/** A rig of the library: its cameras in space, and how well they are known. */
export function RigView({ client, item }: { client: Client; item: string }) {
  const [rig, setRig] = useState<Rig | null>(null);
  const [error, setError] = useState<ApiError | null>(null);
  const [chosen, setChosen] = useState("");
  useEffect(() => {
    readRig(client, item).then(setRig, (reason: unknown) => setError(asApiError(reason)));
  }, [item]);
  if (!rig) return error ? <Failure error={error} /> : <Waiting for="the rig" />;
  const hasSigmas = rig.cameras.some((camera) => camera.sigmas);
  const mm = (values: number[] | undefined) => (values?.length ? Math.hypot(...values).toFixed(3) : "");
  return (
    <section aria-label="Cameras in space">
      <h2>{rig.cameras.length} cameras in space</h2>
      <SpaceStage
        label="The rig's cameras in space."
        filled={rig.hash + chosen}
        show={(view) => {
          view.show([drawingOf(rig, chosen)], upOf(rig), 0.62);
          view.orbit.turn(25, 25); // a little from above, so that cameras do not hide each other
        }}
      />
      <p class="player-legend">
        Axes of the world: x red, y green, z blue.
        {rig.calibration && " The yellow box is where the boards were moved."}
        {hasSigmas && ` Balls at the cameras are the standard deviations of their centres, ${SIGMA_SCALE} times enlarged.`}
      </p>
      <Table label="Cameras" head={["camera", "picture", "focal length, px", "centre, mm", "its sigma, mm", "projection to, px", "residual, px", ""]}>
        {rig.cameras.map((camera) => (
          <tr key={camera.id}>
            <td>{camera.id}</td>
            <td class="number">
              {camera.widthPx} × {camera.heightPx}
            </td>
            <td class="number">{camera.fxPx?.toFixed(1)}</td>
            <td class="number">{centerOf(camera).toArray().map((value) => value.toFixed(0)).join(", ")}</td>
            <td class="number">{mm(camera.sigmas?.centerMm)}</td>
            <td class="number">{camera.sigmas?.projectionPx ? camera.sigmas.projectionPx.toFixed(3) : ""}</td>
            <td class="number">{camera.sigmas?.rmsPx ? camera.sigmas.rmsPx.toFixed(3) : ""}</td>
            <td>
              <button
                type="button"
                aria-pressed={camera.id === chosen}
                aria-label={`Show what camera ${camera.id} sees`}
                onClick={() => setChosen(camera.id === chosen ? "" : camera.id)}
              >
                Show
              </button>
            </td>
          </tr>
        ))}
      </Table>
    </section>
  );
}

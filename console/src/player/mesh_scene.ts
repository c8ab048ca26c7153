import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  DataTexture,
  DynamicDrawUsage,
  GLSL3,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  LinearFilter,
  Matrix3,
  Mesh,
  OrthographicCamera,
  PerspectiveCamera,
  PlaneGeometry,
  MeshBasicMaterial,
  Points,
  RawShaderMaterial,
  Scene,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderer,
  DoubleSide,
} from "three";
import type { Texture } from "three";
import type { Camera as RigCamera } from "@api/rig_pb";
import { CLOTH_COLOR, STATE_COLORS, palette } from "./colors";
import type { Coloring } from "./colors";
import type { GarmentSpan } from "./garments";
import { Orbit } from "./orbit";
import { WORDS_OF_A_VERTEX, decodeVertices } from "./quantized_mesh";
import type { EncodedMesh } from "./quantized_mesh";
import { COLORING_NUMBERS, FRAGMENT_SHADER, VERTEX_SHADER } from "./shaders";

const NEAR_MM = 10;
const FAR_MM = 50_000;
const COLOR_STEPS = 255;

export interface Look {
  coloring: Coloring;
  range: number; // the value of the palette's high end
  wireframe: boolean;
  /** Of the two jobs: the first, both beside each other, or the first. */
  beside: boolean;
}

/** A mesh of one job on the graphics card. */
class Garment {
  readonly geometry = new BufferGeometry();
  readonly words: Uint16Array;
  readonly places: InterleavedBuffer;
  low_mm = new Vector3();
  step_mm = new Vector3(1, 1, 1);
  isShown = false;

  constructor(vertices: number, faces: BufferAttribute, coverage: BufferAttribute) {
    this.words = new Uint16Array(WORDS_OF_A_VERTEX * vertices);
    this.places = new InterleavedBuffer(this.words, WORDS_OF_A_VERTEX);
    this.places.setUsage(DynamicDrawUsage);
    this.geometry.setIndex(faces);
    this.geometry.setAttribute("position", new InterleavedBufferAttribute(this.places, 3, 0));
    this.geometry.setAttribute("traits", new InterleavedBufferAttribute(this.places, 1, 3));
    this.geometry.setAttribute("coverage", coverage);
  }

  compareWith(other: Garment): void {
    this.geometry.setAttribute("other", new InterleavedBufferAttribute(other.places, 3, 0));
  }

  show(mesh: EncodedMesh): void {
    decodeVertices(mesh, this.words);
    this.places.needsUpdate = true;
    this.low_mm.set(...mesh.low_mm);
    this.step_mm.set(...mesh.step_mm);
    this.isShown = true;
  }
}

function material(): RawShaderMaterial {
  const texture = new DataTexture(palette(), 256, 1);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  const color = (rgb: number[]) => new Vector3(...rgb).divideScalar(COLOR_STEPS);
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX_SHADER,
    fragmentShader: FRAGMENT_SHADER,
    side: DoubleSide,
    uniforms: {
      low: { value: new Vector3() },
      otherLow: { value: new Vector3() },
      unit: { value: new Vector3(1, 1, 1) },
      otherUnit: { value: new Vector3(1, 1, 1) },
      range: { value: 1 },
      pointSize: { value: 1 },
      coloring: { value: 0 },
      cloth: { value: color(CLOTH_COLOR) },
      states: { value: STATE_COLORS.map(color) },
      palette: { value: texture },
      isLit: { value: true },
      dim: { value: 1 },
      overlays: { value: false },
      turn: { value: new Matrix3() },
      shift: { value: new Vector3() },
      pinhole: { value: new Vector4() },
      pictureSize: { value: new Vector2(1, 1) },
      lens: { value: new Array(8).fill(0) },
      depths: { value: new Vector2(NEAR_MM, FAR_MM) },
    },
  });
}

/** A garment, or two, in three dimensions or over the picture of a camera. Throws where there is no WebGL. */
export class MeshScene {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  readonly orbit: Orbit;
  private readonly material = material();
  private readonly mesh = new Mesh(new BufferGeometry(), this.material);
  private readonly cells = new Points(new BufferGeometry(), this.material);
  private readonly garments: Garment[] = [];
  private readonly center_mm = new Vector3();
  private coverage = new BufferAttribute(new Uint8Array(0), 1, true);
  private readonly backdrop = new Scene();
  private readonly backdropMaterial = new MeshBasicMaterial({ depthTest: false, depthWrite: false });
  private rigCamera: RigCamera | null = null;
  look: Look = { coloring: "state", range: 1, wireframe: false, beside: false };

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onMove: () => void,
  ) {
    this.orbit = new Orbit(canvas, onMove);
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.mesh.frustumCulled = this.cells.frustumCulled = false;
    this.orbit.world.add(this.mesh, this.cells);
    this.scene.add(this.orbit.world);
    this.backdrop.add(new Mesh(new PlaneGeometry(2, 2), this.backdropMaterial));
    this.resize();
  }

  dispose(): void {
    this.orbit.dispose();
    for (const garment of this.garments) garment.geometry.dispose();
    (this.material.uniforms.palette!.value as Texture).dispose();
    this.setPicture(null, null);
    this.backdropMaterial.dispose();
    this.material.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Of both jobs: what all frames have in common. */
  setTopology(vertices: number, faces: Uint32Array): void {
    for (const garment of this.garments.splice(0)) garment.geometry.dispose();
    const index = new BufferAttribute(faces, 1);
    this.coverage = new BufferAttribute(new Uint8Array(vertices), 1, true);
    for (let slot = 0; slot < 2; ++slot) this.garments.push(new Garment(vertices, index, this.coverage));
    this.garments[0]!.compareWith(this.garments[1]!);
    this.garments[1]!.compareWith(this.garments[0]!);
  }

  /** These faces alone; null: all. */
  setSpan(span: GarmentSpan | null): void {
    for (const { geometry } of this.garments) geometry.setDrawRange(span ? 3 * span.firstFace : 0, span ? 3 * span.faces : Infinity);
  }

  /** Decodes a mesh for the first or the second job; null: it has none of this frame. */
  show(slot: 0 | 1, mesh: EncodedMesh | null): void {
    const garment = this.garments[slot];
    if (!garment) return;
    if (mesh) garment.show(mesh);
    else garment.isShown = false;
    if (mesh && !this.orbit.isPlaced) this.frame(garment);
  }

  /** Quantised vertices of what is shown. */
  wordsOf(slot: 0 | 1): Uint16Array | null {
    const garment = this.garments[slot];
    return garment?.isShown ? garment.words : null;
  }

  /** Shares of frames, 255 for all. */
  setCoverage(shares: Uint8Array): void {
    (this.coverage.array as Uint8Array).set(shares);
    this.coverage.needsUpdate = true;
  }

  /** Distances in mm between the vertices of both jobs, of every so-manieth vertex. */
  differences(every: number): number[] {
    const [a, b] = this.garments;
    if (!a?.isShown || !b?.isShown) return [];
    const found: number[] = [];
    for (let at = 0; at < a.words.length; at += WORDS_OF_A_VERTEX * every) {
      const along = (axis: 0 | 1 | 2) => {
        const place = (of: Garment) => of.low_mm.getComponent(axis) + of.step_mm.getComponent(axis) * of.words[at + axis]!;
        return place(a) - place(b);
      };
      found.push(Math.hypot(along(0), along(1), along(2)));
    }
    return found;
  }

  /** From this camera, over its picture; null: from where the user looks. */
  setPicture(camera: RigCamera | null, picture: ImageBitmap | HTMLCanvasElement | null): void {
    this.backdropMaterial.map?.dispose();
    this.backdropMaterial.map = picture ? new CanvasTexture(picture as HTMLCanvasElement) : null;
    this.backdropMaterial.needsUpdate = true;
    this.rigCamera = camera;
    this.orbit.enabled = !camera;
    if (camera) this.lookThrough(camera);
  }

  private lookThrough(camera: RigCamera): void {
    const uniforms = this.material.uniforms;
    const [rotation, center] = [camera.rotation, this.center_mm];
    uniforms.turn!.value.set(...(rotation as [number, number, number, number, number, number, number, number, number]));
    const shift = new Vector3(center.x, center.y, center.z).applyMatrix3(uniforms.turn!.value as Matrix3);
    uniforms.shift!.value.copy(shift).add(new Vector3(...(camera.translationMm as [number, number, number])));
    uniforms.pinhole!.value.set(camera.fxPx, camera.fyPx, camera.cxPx, camera.cyPx);
    uniforms.pictureSize!.value.set(camera.widthPx, camera.heightPx);
    uniforms.lens!.value = Array.from({ length: 8 }, (_, i) => camera.distortion[i] ?? 0);
  }

  private frame(garment: Garment): void {
    const low = garment.low_mm;
    const high = new Vector3();
    for (let at = 0; at < garment.words.length; at += WORDS_OF_A_VERTEX)
      for (let axis = 0; axis < 3; ++axis) high.setComponent(axis, Math.max(high.getComponent(axis), garment.words[at + axis]!));
    high.multiply(garment.step_mm);
    this.center_mm.copy(low).addScaledVector(high, 0.5);
    this.orbit.place(high.length() / 2);
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setSize(Math.max(1, clientWidth), Math.max(1, clientHeight), false);
    this.onMove();
  }

  draw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.renderer.setScissorTest(true);
    this.renderer.autoClear = false;
    this.clear(0, 0, width, height);
    if (this.rigCamera) this.drawOverPicture(this.rigCamera, width, height);
    else if (this.look.beside) {
      this.drawGarment(0, 0, width / 2, height);
      this.drawGarment(1, width / 2, width / 2, height);
    } else this.drawGarment(0, 0, width, height);
  }

  private clear(x: number, y: number, width: number, height: number): void {
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    this.renderer.clear();
  }

  private drawGarment(slot: number, x: number, width: number, height: number): void {
    const garment = this.garments[slot];
    if (!garment?.isShown) return;
    this.renderer.setViewport(x, 0, width, height);
    this.renderer.setScissor(x, 0, width, height);
    this.orbit.eye.aspect = width / height;
    this.orbit.eye.updateProjectionMatrix();
    this.cells.visible = false;
    this.drawWith(garment, this.orbit.eye, { wireframe: false, isLit: true, dim: this.look.wireframe ? 0.45 : 1 });
    if (this.look.wireframe) this.drawWith(garment, this.orbit.eye, { wireframe: true, isLit: false, dim: 1 });
  }

  /** The picture in the middle; the cloth's cells and their edges over it, without those behind it. */
  private drawOverPicture(camera: RigCamera, width: number, height: number): void {
    const picture = { width: camera.widthPx ?? 1, height: camera.heightPx ?? 1 };
    const scale = Math.min(width / picture.width, height / picture.height);
    const [shownWidth, shownHeight] = [scale * picture.width, scale * picture.height];
    const [x, y] = [(width - shownWidth) / 2, (height - shownHeight) / 2];
    this.renderer.setViewport(x, y, shownWidth, shownHeight);
    this.renderer.setScissor(x, y, shownWidth, shownHeight);
    if (this.backdropMaterial.map) this.renderer.render(this.backdrop, new OrthographicCamera(-1, 1, 1, -1, -1, 1));
    const garment = this.garments[0];
    if (!garment?.isShown) return;
    const uniforms = this.material.uniforms;
    uniforms.overlays!.value = true;
    this.material.colorWrite = false;
    this.material.polygonOffset = true;
    this.material.polygonOffsetFactor = this.material.polygonOffsetUnits = 2;
    this.drawWith(garment, this.orbit.eye, { wireframe: false, isLit: false, dim: 1 });
    this.material.colorWrite = true;
    this.material.polygonOffset = false;
    if (this.look.wireframe) this.drawWith(garment, this.orbit.eye, { wireframe: true, isLit: false, dim: 0.6 });
    uniforms.pointSize!.value = 2 * this.renderer.getPixelRatio();
    [this.mesh.visible, this.cells.visible] = [false, true];
    this.drawWith(garment, this.orbit.eye, { wireframe: false, isLit: false, dim: 1 });
    this.mesh.visible = true;
    uniforms.overlays!.value = false;
  }

  private drawWith(garment: Garment, eye: PerspectiveCamera, how: { wireframe: boolean; isLit: boolean; dim: number }): void {
    const uniforms = this.material.uniforms;
    const other = this.garments[1 - this.garments.indexOf(garment)]!;
    uniforms.low!.value.copy(garment.low_mm).sub(this.center_mm);
    uniforms.unit!.value.copy(garment.step_mm);
    uniforms.otherLow!.value.copy(other.low_mm).sub(this.center_mm);
    uniforms.otherUnit!.value.copy(other.step_mm);
    const differs = this.look.coloring === "difference" && !other.isShown;
    uniforms.coloring!.value = COLORING_NUMBERS[differs ? "cloth" : this.look.coloring];
    uniforms.range!.value = this.look.range;
    uniforms.isLit!.value = how.isLit;
    uniforms.dim!.value = how.dim;
    this.material.wireframe = how.wireframe;
    this.material.uniformsNeedUpdate = true;
    this.mesh.geometry = this.cells.geometry = garment.geometry;
    this.renderer.render(this.scene, eye);
  }
}

import { Box3, Color, DirectionalLight, HemisphereLight, Scene, Vector3, WebGLRenderer } from "three";
import type { BufferGeometry, Material, Object3D } from "three";
import { Orbit } from "./orbit";

/** Things in space that stand still, drawn when the eye moves. Throws where there is no WebGL. */
export class SpaceView {
  readonly orbit: Orbit;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly observer: ResizeObserver;
  private request = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.orbit = new Orbit(canvas, () => this.draw());
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    const light = new DirectionalLight(0xffffff, 2);
    this.orbit.eye.add(light);
    this.scene.add(this.orbit.world, this.orbit.eye, new HemisphereLight(0xffffff, 0x888888, 1));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas);
  }

  /** Shows this alone, in the middle; a smaller share of its extent fills the view. */
  show(things: Object3D[], up: [number, number, number], share = 1): void {
    this.clear();
    this.orbit.world.add(...things);
    const box = new Box3();
    for (const thing of things) box.expandByObject(thing);
    const center = box.getCenter(new Vector3());
    for (const thing of things) thing.position.sub(center);
    this.orbit.setUp(up);
    this.orbit.place((share * box.getSize(new Vector3()).length()) / 2);
  }

  dispose(): void {
    cancelAnimationFrame(this.request);
    this.observer.disconnect();
    this.clear();
    this.orbit.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  draw(): void {
    this.request ||= requestAnimationFrame(() => {
      this.request = 0;
      this.renderer.render(this.scene, this.orbit.eye);
    });
  }

  private clear(): void {
    this.orbit.world.traverse((thing) => {
      const drawn = thing as Object3D & { geometry?: BufferGeometry; material?: Material & { map?: { dispose(): void } } };
      drawn.geometry?.dispose();
      drawn.material?.map?.dispose();
      drawn.material?.dispose();
    });
    this.orbit.world.clear();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setSize(Math.max(1, clientWidth), Math.max(1, clientHeight), false);
    this.orbit.eye.aspect = Math.max(1, clientWidth) / Math.max(1, clientHeight);
    this.orbit.eye.updateProjectionMatrix();
    this.draw();
  }
}

/** Colours that are told apart beside each other, one after another. */
export function colorOf(index: number): Color {
  return new Color().setHSL((0.58 + 0.381966 * index) % 1, 0.55, 0.55);
}

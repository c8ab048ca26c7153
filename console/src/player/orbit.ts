import { Group, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const NEAR_MM = 10;
const FAR_MM = 100_000;
const UP = new Vector3(0, 1, 0);

/** An eye that turns about what is in `world`, by mouse, fingers or keys. */
export class Orbit {
  readonly world = new Group(); // turned so that its up is +y
  readonly eye = new PerspectiveCamera(35, 1, NEAR_MM, FAR_MM);
  private readonly controls: OrbitControls;
  private up = new Vector3(0, -1, 0);
  private radius_mm = 0;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly onMove: () => void,
  ) {
    this.controls = new OrbitControls(this.eye, canvas);
    this.controls.addEventListener("change", onMove);
  }

  dispose(): void {
    this.controls.dispose();
  }

  set enabled(on: boolean) {
    this.controls.enabled = on;
  }

  get isPlaced(): boolean {
    return this.radius_mm > 0;
  }

  /** Where the world's up is; where nobody knows, it is taken for -y. */
  setUp(up: [number, number, number]): void {
    this.up = new Vector3(...up).normalize();
    this.reset();
  }

  /** To see all within this radius about the world's origin. */
  place(radius_mm: number): void {
    this.radius_mm = radius_mm || 1;
    this.reset();
  }

  /** Back to where the view began. */
  reset(): void {
    this.world.quaternion.setFromUnitVectors(this.up, UP);
    const away = Math.abs(this.up.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0);
    away.addScaledVector(this.up, -away.dot(this.up)).normalize().applyQuaternion(this.world.quaternion);
    const distance = (0.95 * this.radius_mm) / Math.sin((this.eye.fov * Math.PI) / 360) / Math.min(1, this.eye.aspect);
    this.eye.position.copy(away).multiplyScalar(-(distance || 1));
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.onMove();
  }

  /** Turns about what is looked at, in degrees; or moves nearer. */
  turn(right_deg: number, up_deg: number, nearer = 1): void {
    const offset = this.eye.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(UP, (-right_deg * Math.PI) / 180);
    const axis = new Vector3().crossVectors(UP, offset).normalize();
    const lifted = offset.clone().applyAxisAngle(axis, (-up_deg * Math.PI) / 180);
    // Not over the poles.
    if (Math.abs(lifted.clone().normalize().dot(UP)) < 0.99) offset.copy(lifted);
    this.eye.position.copy(this.controls.target).add(offset.divideScalar(nearer));
    this.controls.update();
    this.onMove();
  }
}

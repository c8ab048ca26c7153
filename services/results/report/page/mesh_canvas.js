// @ts-check
// Draws a lit mesh with WebGL: plain, since one mesh needs no library of 600 kB in every page.

const VERTEX_SHADER = `
attribute vec3 position, normal, color;
uniform mat3 turn;
uniform vec3 pan;
uniform vec2 scale;
varying vec3 n, c;
void main() {
  vec3 p = turn * position + pan;
  n = turn * normal;
  c = color;
  // A viewer at four radii; depth from 2 to 6.
  float distance = 4.0 - p.z;
  gl_Position = vec4(p.xy * scale * 4.0, (distance - 4.0) / 3.0 * distance, distance);
}`;
const FRAGMENT_SHADER = `
precision mediump float;
uniform float shading;
varying vec3 n, c;
void main() {
  vec3 normal = normalize(gl_FrontFacing ? n : -n);
  float light = 0.3 + 0.75 * max(dot(normal, normalize(vec3(-0.4, 0.5, 0.8))), 0.0);
  gl_FragColor = vec4(c * mix(1.0, light, shading) * (gl_FrontFacing ? 1.0 : 0.72), 1.0);
}`;

/** @param {WebGLRenderingContext} gl */
function meshProgram(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "no program");
  gl.useProgram(program);
  return program;
}

/** @typedef {number[]} Axis3 */
/** @param {Axis3} a @param {Axis3} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Area-weighted normals of the vertices. @param {Float32Array} positions @param {Uint16Array} faces */
export function vertexNormals(positions, faces) {
  const normals = new Float32Array(positions.length);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const v of [a, b, c]) { normals[v] += x; normals[v + 1] += y; normals[v + 2] += z; }
  }
  return normals;
}

/** A canvas that shows a mesh of radius 1 around the origin, turned and moved by the pointer, the wheel and keys. */
export class MeshCanvas {
  /** Throws where there is no WebGL. @param {HTMLCanvasElement} canvas @param {Uint16Array} faces @param {Axis3} right @param {Axis3} up */
  constructor(canvas, faces, right, up) {
    const gl = canvas.getContext("webgl", { antialias: true, alpha: true, premultipliedAlpha: false });
    if (!gl) throw new Error("no WebGL");
    this.canvas = canvas; this.gl = gl; this.right = right; this.up = up; this.towards = cross(right, up);
    this.faces = faces; this.first = 0; this.count = faces.length;
    this.waiting = false;
    const program = meshProgram(gl);
    this.place = (/** @type {string} */ name) => gl.getUniformLocation(program, name);
    /** @type {Record<string, WebGLBuffer>} */
    this.buffers = {};
    for (const [name, type] of /** @type {[string, number][]} */ ([["position", gl.FLOAT], ["normal", gl.FLOAT], ["color", gl.UNSIGNED_BYTE]])) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name] = gl.createBuffer());
      const at = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, type, type === gl.UNSIGNED_BYTE, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    gl.enable(gl.DEPTH_TEST);
    this.yaw = 0; this.pitch = 0; this.zoom = 1; this.pan = [0, 0];
    this.listen();
    new ResizeObserver(() => this.later()).observe(canvas);
  }

  begin() { this.yaw = 0; this.pitch = 0; this.zoom = 1; this.pan = [0, 0]; }

  /** @param {string} name @param {Float32Array | Uint8Array} data */
  put(name, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers[name]);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, /** @type {any} */ (data), this.gl.DYNAMIC_DRAW);
  }

  /** @param {Float32Array} positions */
  setPositions(positions) {
    this.put("position", positions);
    this.put("normal", vertexNormals(positions, this.faces));
    this.later();
  }

  /** `shading`: 0 plain colours, 1 fully lit. @param {Uint8Array} colors @param {number} shading */
  setColors(colors, shading) {
    this.put("color", colors);
    this.gl.uniform1f(this.place("shading"), shading);
    this.later();
  }

  /** Which faces are drawn. @param {number} first @param {number} faces */
  showFaces(first, faces) {
    this.first = first; this.count = 3 * faces;
    this.later();
  }

  /** @param {number} dx @param {number} dy */
  turn(dx, dy) {
    this.yaw += dx;
    this.pitch = Math.min(1.55, Math.max(-1.55, this.pitch + dy));
    this.later();
  }

  /** @param {number} factor */
  nearer(factor) {
    this.zoom = Math.min(30, Math.max(0.3, this.zoom * factor));
    this.later();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", event => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      if (!event.shiftKey) return this.turn(0.01 * event.movementX, 0.01 * event.movementY);
      const px = 2 / (0.92 * this.zoom * Math.min(canvas.clientWidth, canvas.clientHeight));
      this.pan = [this.pan[0] + px * event.movementX, this.pan[1] - px * event.movementY];
      this.later();
    });
    canvas.addEventListener("wheel", event => { event.preventDefault(); this.nearer(Math.exp(-0.0012 * event.deltaY)); }, { passive: false });
    canvas.addEventListener("dblclick", () => { this.begin(); this.later(); });
    canvas.addEventListener("keydown", event => {
      const act = /** @type {Record<string, () => void>} */ ({
        ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0), ArrowUp: () => this.turn(0, 0.1),
        ArrowDown: () => this.turn(0, -0.1), "+": () => this.nearer(1.15), "-": () => this.nearer(1 / 1.15),
      })[event.key];
      if (act) { event.preventDefault(); act(); }
    });
  }

  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.waiting = false;
    const { gl, canvas, right, up, towards } = this, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.clientWidth > 0 && (canvas.width !== width || canvas.height !== height)) { canvas.width = width; canvas.height = height; }
    const cy = Math.cos(this.yaw), sy = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch), axes = [0, 1, 2];
    // Rows: to the right, up and towards the viewer after the turn.
    const x = axes.map(i => cy * right[i] + sy * towards[i]), depth = axes.map(i => cy * towards[i] - sy * right[i]);
    const y = axes.map(i => cp * up[i] - sp * depth[i]), z = axes.map(i => cp * depth[i] + sp * up[i]);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.uniformMatrix3fv(this.place("turn"), false, axes.flatMap(i => [x[i], y[i], z[i]]));
    gl.uniform3f(this.place("pan"), this.pan[0], this.pan[1], 0);
    const fit = 0.92 * this.zoom, aspect = canvas.width / canvas.height;
    gl.uniform2f(this.place("scale"), fit / Math.max(aspect, 1), fit * Math.min(aspect, 1));
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_SHORT, 6 * this.first);
  }
}

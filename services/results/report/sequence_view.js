"use strict";
// Shows the frames of the page's ".sequence" with WebGL: plain, since one lit mesh needs no library of 600 kB in every page.
// Frames are decoded when they are shown: three 16-bit coordinates per vertex, then a byte per vertex and colouring.

const bytesOf = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const numbersOf = text => text.split(" ").map(Number);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

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

function programOf(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  return program;
}

// Area-weighted normals of the vertices.
function normalsOf(positions, faces) {
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

function show(view) {
  const find = what => view.querySelector(what);
  const canvas = find("canvas"), slider = find("input"), select = find(".colors"), parts = find(".parts"), button = find("button");
  const frames = [...document.querySelectorAll(".sequence-frame")], legends = [...view.querySelectorAll(".key")];
  const palettes = [...select.options].map(option => option.dataset.palette ? bytesOf(option.dataset.palette) : null);
  const count = Number(view.dataset.vertices), radius = Number(view.dataset.radius);
  const right = numbersOf(view.dataset.right), up = numbersOf(view.dataset.up), towards = cross(right, up);
  const gl = canvas.getContext("webgl", {antialias: true, alpha: true, premultipliedAlpha: false});
  if (!gl) throw new Error("no WebGL");
  const program = programOf(gl), place = name => gl.getUniformLocation(program, name);
  const faces = new Uint16Array(bytesOf(document.querySelector(".sequence-faces").textContent).buffer);
  const buffers = {};
  for (const [name, type, normalized] of [["position", gl.FLOAT], ["normal", gl.FLOAT], ["color", gl.UNSIGNED_BYTE, true]]) {
    buffers[name] = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, type, Boolean(normalized), 0, 0);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  gl.enable(gl.DEPTH_TEST);

  let bytes, yaw, pitch, zoom, pan, waiting = false, playing = 0;
  const begin = () => { yaw = 0; pitch = 0; zoom = 1; pan = [0, 0]; };
  const put = (name, data) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); };

  function color() {
    const palette = palettes[select.selectedIndex], colors = new Uint8Array(3 * count).fill(205);
    const at = (6 + select.selectedIndex) * count;
    if (palette) for (let v = 0; v < count; ++v) colors.set(palette.subarray(3 * bytes[at + v], 3 * bytes[at + v] + 3), 3 * v);
    put("color", colors);
    gl.uniform1f(place("shading"), palette ? 0.6 : 1);
    legends.forEach((legend, i) => { legend.hidden = i !== select.selectedIndex; });
    later();
  }
  function load() {
    const frame = frames[slider.value];
    bytes = bytesOf(frame.textContent);
    const words = new Uint16Array(bytes.buffer, 0, 3 * count), positions = new Float32Array(3 * count);
    const center = numbersOf(frame.dataset.center), step = Number(frame.dataset.step);
    for (let i = 0; i < words.length; ++i) positions[i] = (words[i] * step - center[i % 3]) / radius;
    put("position", positions);
    put("normal", normalsOf(positions, faces));
    find("output").textContent = frame.dataset.name + (frame.dataset.note ? " (" + frame.dataset.note + ")" : "");
    color();
  }
  function draw() {
    waiting = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.clientWidth > 0 && (canvas.width !== width || canvas.height !== height)) { canvas.width = width; canvas.height = height; }
    const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
    // Rows: to the right, up and towards the viewer after the turn.
    const x = [0, 1, 2].map(i => cy * right[i] + sy * towards[i]), depth = [0, 1, 2].map(i => cy * towards[i] - sy * right[i]);
    const y = [0, 1, 2].map(i => cp * up[i] - sp * depth[i]), z = [0, 1, 2].map(i => cp * depth[i] + sp * up[i]);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.uniformMatrix3fv(place("turn"), false, [0, 1, 2].flatMap(i => [x[i], y[i], z[i]]));
    gl.uniform3f(place("pan"), pan[0], pan[1], 0);
    const fit = 0.92 * zoom, aspect = canvas.width / canvas.height;
    gl.uniform2f(place("scale"), fit / Math.max(aspect, 1), fit * Math.min(aspect, 1));
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const part = parts ? parts.selectedOptions[0].dataset : {};
    gl.drawElements(gl.TRIANGLES, part.faces ? 3 * part.faces : faces.length, gl.UNSIGNED_SHORT, 6 * (part.first || 0));
  }
  function later() {
    if (!waiting) { waiting = true; requestAnimationFrame(draw); }
  }
  function play(on) {
    clearInterval(playing);
    playing = on ? setInterval(() => { slider.value = (Number(slider.value) + 1) % frames.length; load(); }, pace) : 0;
    button.textContent = on ? "Pause" : "Play";
  }
  // At the speed of the take where that is known, as far as a screen follows.
  const pace = 1000 / Math.min(Number(view.dataset.fps) || 15, 30);
  const turn = (dx, dy) => { yaw += dx; pitch = Math.min(1.55, Math.max(-1.55, pitch + dy)); later(); };
  const nearer = factor => { zoom = Math.min(30, Math.max(0.3, zoom * factor)); later(); };

  slider.addEventListener("input", () => { play(false); load(); });
  select.addEventListener("change", color);
  if (parts) parts.addEventListener("change", later);
  button.addEventListener("click", () => play(!playing));
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    if (event.shiftKey) {
      const px = 2 / (0.92 * zoom * Math.min(canvas.clientWidth, canvas.clientHeight));
      pan = [pan[0] + px * event.movementX, pan[1] - px * event.movementY];
      later();
    } else {
      turn(0.01 * event.movementX, 0.01 * event.movementY);
    }
  });
  canvas.addEventListener("wheel", event => { event.preventDefault(); nearer(Math.exp(-0.0012 * event.deltaY)); }, {passive: false});
  canvas.addEventListener("dblclick", () => { begin(); later(); });
  canvas.addEventListener("keydown", event => {
    const keys = {ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1),
                  ArrowDown: () => turn(0, -0.1), "+": () => nearer(1.15), "-": () => nearer(1 / 1.15)};
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });
  new ResizeObserver(later).observe(canvas);
  // What is on the screen goes on paper.
  window.addEventListener("beforeprint", () => {
    if (!find(".still")) return;
    draw();
    find(".still img").src = canvas.toDataURL("image/png");
    find(".still figcaption").textContent = "Frame " + find("output").textContent + ", colours: " + select.value;
  });

  view.classList.add("live");
  begin();
  load();
}

for (const view of document.querySelectorAll(".sequence")) {
  try {
    show(view);
  } catch (error) {
    view.classList.replace("live", "failed") || view.classList.add("failed");
    view.querySelector(".hint").textContent = "This browser shows a still picture only: " + error.message;
  }
}

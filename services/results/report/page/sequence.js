// @ts-check
// A sequence of meshes in three dimensions (v1.PageSequence). Frames are decoded when they are shown.
import { el, section } from "./parts.js";
import { MeshCanvas } from "./mesh_canvas.js";
import { legendOf, pictureFigure } from "./pictures.js";

/** @typedef {{name: string, key: any, palette: string, first_shown: boolean}} Coloring */
/** @typedef {{name: string, note: string, center_mm: number[], step_mm: number, bytes: string}} SequenceFrame */
/**
 * @typedef {{vertices: number, faces: string, frames: SequenceFrame[], colorings: Coloring[], parts: {name: string, faces: number}[],
 *   right: number[], up: number[], radius_mm: number, fps: number, still?: import("./pictures.js").Picture}} Sequence
 */

/** @param {string} base64 */
const bytesOf = base64 => Uint8Array.from(atob(base64), character => character.charCodeAt(0));

/** Of radius 1, around the mean of the vertices. @param {SequenceFrame} frame @param {Uint8Array} bytes @param {number} vertices @param {number} radius */
export function positionsOf({ center_mm, step_mm }, bytes, vertices, radius) {
  const words = new DataView(bytes.buffer), positions = new Float32Array(3 * vertices);
  for (let i = 0; i < positions.length; ++i) positions[i] = (words.getUint16(2 * i, true) * step_mm - center_mm[i % 3]) / radius;
  return positions;
}

/** A colour per vertex; without a palette plain cloth. @param {Uint8Array | null} palette @param {Uint8Array} indices one per vertex */
export function colorsOf(palette, indices) {
  const colors = new Uint8Array(3 * indices.length).fill(205);
  if (palette) indices.forEach((index, v) => colors.set(palette.subarray(3 * index, 3 * index + 3), 3 * v));
  return colors;
}

/** @param {Sequence} sequence */
function sequenceControls({ frames, colorings, parts }) {
  const select = (/** @type {string} */ name, /** @type {string[]} */ all) => /** @type {HTMLSelectElement} */ (el(`select.${name}`, all.map(one => el("option", one))));
  const colors = select("colors", [...colorings.map(coloring => coloring.name), "cloth"]);
  colors.selectedIndex = Math.max(0, colorings.findIndex(coloring => coloring.first_shown));
  return {
    play: el("button", { type: "button" }, "Play"),
    slider: /** @type {HTMLInputElement} */ (el("input", { type: "range", min: 0, max: frames.length - 1, value: 0 })),
    output: el("output"), colors, parts: parts.length > 0 ? select("parts", ["all", ...parts.map(part => part.name)]) : null,
    legends: colorings.map(coloring => el("div.key", legendOf(coloring.key))),
    canvas: /** @type {HTMLCanvasElement} */ (el("canvas", { tabindex: 0, role: "img",
      "aria-label": "the garment in three dimensions; arrow keys turn it, plus and minus zoom" })),
  };
}

/** @typedef {ReturnType<typeof sequenceControls>} Controls */

/** Shows frames in the canvas. Throws where there is no WebGL. @param {Sequence} sequence @param {Controls} controls */
function player(sequence, controls) {
  const { frames, vertices, colorings, parts, radius_mm } = sequence, { slider, colors, output, play } = controls;
  const mesh = new MeshCanvas(controls.canvas, new Uint16Array(bytesOf(sequence.faces).buffer), sequence.right, sequence.up);
  const palettes = colorings.map(coloring => bytesOf(coloring.palette));
  let bytes = new Uint8Array(), playing = 0;
  const color = () => {
    const at = colors.selectedIndex, palette = palettes[at] ?? null;
    mesh.setColors(colorsOf(palette, bytes.subarray((6 + at) * vertices, (7 + at) * vertices)), palette ? 0.6 : 1);
    controls.legends.forEach((legend, i) => { legend.hidden = i !== at; });
  };
  const load = () => {
    const frame = frames[Number(slider.value)];
    bytes = bytesOf(frame.bytes);
    mesh.setPositions(positionsOf(frame, bytes, vertices, radius_mm));
    output.textContent = frame.name + (frame.note ? ` (${frame.note})` : "");
    color();
  };
  // At the speed of the take where that is known, as far as a screen follows.
  const pace = 1000 / Math.min(sequence.fps || 15, 30);
  const run = (/** @type {boolean} */ on) => {
    clearInterval(playing);
    playing = on ? setInterval(() => { slider.value = String((Number(slider.value) + 1) % frames.length); load(); }, pace) : 0;
    play.textContent = on ? "Pause" : "Play";
  };
  slider.addEventListener("input", () => { run(false); load(); });
  colors.addEventListener("change", color);
  play.addEventListener("click", () => run(!playing));
  controls.parts?.addEventListener("change", () => {
    const at = (controls.parts?.selectedIndex ?? 0) - 1, before = parts.slice(0, Math.max(at, 0)).reduce((sum, part) => sum + part.faces, 0);
    mesh.showFaces(before, at < 0 ? mesh.faces.length / 3 : parts[at].faces);
  });
  load();
  return mesh;
}

/**
 * The section with the view; nothing without frames. Where there is no WebGL, and on paper, it shows a still picture.
 * @param {Sequence | undefined} sequence @param {import("./parts.js").Content} about what was left out
 */
export function sequenceSection(sequence, about) {
  if (!sequence || sequence.frames.length === 0) return null;
  const controls = sequenceControls(sequence), { slider, output, colors, parts, legends, canvas, play } = controls;
  const still = sequence.still ? pictureFigure(sequence.still, "the sequence") : null, hint = el("p.hint",
    "Drag to turn, with shift to move; wheel to zoom; double click to return.");
  still?.classList.add("still");
  const view = el("div.sequence",
    el("div.controls", play, el("label", "Frame ", slider), output, el("label", "Colours ", colors), parts && el("label", "Garments ", parts)),
    legends, canvas, still, hint, el("p", about));
  try {
    const mesh = player(sequence, controls);
    view.classList.add("live");
    // What is on the screen goes on paper.
    window.addEventListener("beforeprint", () => {
      const image = still?.querySelector("img"), caption = still?.querySelector("figcaption");
      if (!image || !caption) return;
      mesh.draw();
      image.src = canvas.toDataURL("image/png");
      caption.textContent = `Frame ${output.textContent}, colours: ${colors.value}`;
    });
  } catch (error) {
    view.classList.add("failed");
    hint.textContent = `This browser shows a still picture only: ${error instanceof Error ? error.message : error}`;
  }
  return section("sequence", "In three dimensions", view);
}

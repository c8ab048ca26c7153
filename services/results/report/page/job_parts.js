// @ts-check
// The other sections of a job's page: head, pictures, options, inputs. The page of its evaluation shows them, too.
import { details, el, name, pageHead, paragraph, section, table, tile, tiles } from "./parts.js";
import { formatCount, formatDuration, formatNumber, formatPercent, formatUnixTime, numberOf, shortened, DASH } from "./numbers.js";
import { legendOf, pictureRow } from "./pictures.js";
import { sequenceSection } from "./sequence.js";

/** v1.JobPage. @typedef {any} JobPage */

/** @param {JobPage} page */
function cameraTile({ cameras, figures: { unknown_cameras } }) {
  const withImages = cameras.filter((/** @type {any} */ camera) => camera.frames_missing === 0).length;
  return tile("Cameras", `${formatCount(withImages)} of ${formatCount(cameras.length + unknown_cameras)}`,
    unknown_cameras === 0 ? "gave an image in every frame"
      : `were used in every frame; ${formatCount(unknown_cameras)} ${unknown_cameras === 1 ? "is" : "are"} not in the rig`);
}

/** @param {JobPage} page */
function jobTiles(page) {
  const { figures, cameras } = page, hasCoverage = Number.isFinite(numberOf(figures.coverage)), unit = (/** @type {string} */ text) => `\u00a0${text}`;
  const time = tile("Time", formatDuration(figures.median_frame_ms), Number.isFinite(numberOf(figures.wall_ms))
    ? `per frame, median; ${formatDuration(figures.wall_ms)} in all` : "per frame, median");
  const lowest = ["lowest ", formatPercent(figures.lowest_coverage), " in frame ", name(shortened(figures.lowest_coverage_frame, 24))];
  return tiles([
    ...(figures.driven ? [
      tile("Rays", formatCount(figures.median_rays), "cells seen by a camera that the mesh follows, per frame, median"),
      tile("Residual", formatNumber(figures.median_residual_px, 2) + unit("px"), "from the mesh to these cells, median"),
      tile("Uncertainty", formatNumber(figures.median_sigma_mm, 2) + unit("mm"), "sigma of all vertices, median"), time] : []),
    ...(hasCoverage ? [
      tile("Cells observed", formatPercent(figures.coverage), figures.registered > 1 ? lowest : "of those that the template has"),
      tile("Triangulated cells", formatCount(figures.median_cells), "per frame, median"),
      tile("Uncertainty", formatNumber(figures.median_sigma_mm, 3) + unit("mm"), "sigma of observed vertices, median"), time] : []),
    cameras.length > 0 && cameraTile(page),
    figures.peak_memory_mib > 0 && tile("Memory", formatCount(figures.peak_memory_mib) + unit("MiB"), "largest of a worker"),
  ]);
}

/** @param {JobPage} page */
export function jobHead(page) {
  const { job, headline } = page, work = job.spec?.work;
  const kind = work ? `Weft report: ${work.kind}` : job.driven ? "Weft driving report" : "Weft registration report";
  const remarks = page.remarks.filter((/** @type {string} */ remark) => remark !== job.verdict?.reason);
  return pageHead([kind, !job.verdict && [" ", el("span.badge", "… not finished")]], headline, job.verdict,
    remarks.length > 0 && el("ul.remarks", remarks.map((/** @type {string} */ remark) => el("li", remark))), jobTiles(page));
}

/** @param {JobPage} page */
export function jobSequence({ sequence, figures: { registered } }) {
  if (!sequence) return null;
  const shown = sequence.frames.length;
  return sequenceSection(sequence, [`The view follows the garment and shows ${formatCount(sequence.vertices)} of its vertices as they are in mesh.ply, `,
    "to a part in 130,000 of its size", shown < registered ? `, in ${formatCount(shown)} of ${formatCount(registered)} frames, spread evenly.` : "."]);
}

/** A row of its own, since the pictures are to be looked at closely. @param {any} frame v1.PageFramePictures */
function inImages({ frame, by_state, in_images }) {
  if (in_images.length === 0) return null;
  const [what, about] = by_state.length > 0 ? [`frame ${frame} with the mesh over it`,
    "Images of cameras. Lines, black inside and white outside: edges of the mesh as the camera sees them; where they leave the cloth, the mesh is "
    + "off. Tinted by state: what three cameras did not observe."]
    : [`frame ${frame}`, "Images of cameras; the frame could not be registered."];
  return el("div.in-images", pictureRow(in_images, what, "", el("p.legend", about)));
}

/** @param {JobPage} page */
export function pictureSection({ pictures }) {
  const shown = pictures.filter((/** @type {any} */ frame) => frame.by_state.length + frame.by_sigma.length + frame.in_images.length > 0);
  return section("meshes", "Meshes", shown.map((/** @type {any} */ frame) => [
    el("h3", "Frame ", name(frame.frame), frame.why_shown && [" ", el("small", frame.why_shown)]),
    el("div.meshes", pictureRow(frame.by_state, `frame ${frame.frame}`, "state", legendOf(frame.state_key)),
      pictureRow(frame.by_sigma, `frame ${frame.frame}`, "uncertainty", legendOf(frame.sigma_key)), inImages(frame)),
  ]));
}

/** What differs from the preset, and all options folded away. @param {JobPage} page */
export function optionSection({ options, preset }) {
  if (options.length === 0) return null;
  const code = (/** @type {any} */ option) => el("code", option.path);
  const differing = options.filter((/** @type {any} */ option) => option.value !== option.preset);
  return section("options", "Options",
    differing.length === 0 ? paragraph(`All are those of the preset ${preset}.`) : [el("h3", "Different from the preset"),
      table(["Option", "Value", "Preset", "Meaning"],
        differing.map((/** @type {any} */ option) => [code(option), option.value, option.preset, option.meaning]), "facts")],
    details(`All ${options.length} options`, () => table(["Option", "Value", "Meaning"],
      options.map((/** @type {any} */ option) => [code(option), option.value, option.meaning]), "facts")));
}

/** @param {any} spec v1.RegistrationSpec */
function frameRange({ frames, first_frame, end_frame }) {
  if (frames) return frames;
  if (first_frame === 0 && end_frame === 0) return "all frames of the dump";
  return end_frame === 0 ? `from position ${first_frame} to the end` : `positions ${first_frame} to ${end_frame - 1} of the dump`;
}

/** Inputs and options of work without fields of its own. @param {any} work @param {any[]} hashes */
function workRows(work, hashes) {
  return [...work.inputs.map((/** @type {any} */ input) => [input.name, name(input.value), hashes.find(hash => hash.name === input.name)?.value]),
    ...work.options.map((/** @type {any} */ option) => [option.name, option.value || "yes"])];
}

/** @param {JobPage} page */
export function inputSection({ job, frames, take, algorithms }) {
  const spec = job.spec ?? {}, inputs = job.inputs ?? {};
  const threads = [...new Set(frames.map((/** @type {any} */ frame) => frame.threads))].filter(count => count > 0).sort((a, b) => a - b);
  const rows = spec.work ? workRows(spec.work, inputs.work ?? []) : [
    ["Dump", name(spec.dump ?? "")], ...take.map((/** @type {any} */ fact) => [fact.name, fact.value]), ["Rig", name(spec.rig ?? ""), inputs.rig],
    ["Board", name(spec.board ?? ""), inputs.board], ["Template", name(spec.garment ?? ""), inputs.garment]];
  rows.push(["Results", name(spec.out ?? "")], ["Frames", frameRange({ frames: "", first_frame: 0, end_frame: 0, ...spec })]);
  if (!spec.work) rows.push(["Preset", spec.options?.preset ?? ""]);
  rows.push(["Job", name(job.id || "local")], ["Submitted", formatUnixTime(job.created_unix_ns)], ["Started", formatUnixTime(job.started_unix_ns)],
    ["Finished", formatUnixTime(job.finished_unix_ns)], ["Threads", threads.length > 0 ? `${threads.join(", ")} per frame` : DASH],
    ["Weft", job.weft_version || "version not recorded"], ["Algorithms", algorithms.join(", ") || DASH]);
  return section("inputs", "Inputs, versions and ids",
    table(["", "", "Content hash"], rows.map(([fact, value, hash]) => [fact, value, hash && el("code", hash)]), "facts"));
}

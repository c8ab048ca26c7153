// @ts-check
// How good a result is: weft.v1.EvaluationPage.
import { cell, definePage, el, name, pageHead, paragraph, section, table, tile, tiles, verdictBlock, warnings } from "./parts.js";
import { DASH, formatCount, formatNumber, formatPercent, numberOf } from "./numbers.js";
import { cameraSection } from "./job_cameras.js";
import { frameSection, plotSection } from "./job_frames.js";
import { inputSection, jobSequence, optionSection, pictureSection } from "./job_parts.js";
import { alignmentSection, cellSection } from "./job_stages.js";
import { paperSection } from "./paper.js";
import { mapSection } from "./pictures.js";
import { barPlot, linePlot } from "./plot.js";

/** weft.v1.FrameScore. @typedef {any} Frame */

/** A measure of evaluation/measures.h by its name. @typedef {{unit: string, decimals: number, title: string, heading: string, total: any, frames: any[]}} Measured */

/** @param {any} page weft.v1.EvaluationPage @returns {Map<string, Measured>} */
const measuresOf = ({ measures, total, frames }) => new Map(measures.map((/** @type {any} */ measure, /** @type {number} */ i) =>
  [measure.name, { ...measure, total: total.values[i], frames: frames.map((/** @type {any} */ row) => row.values[i]) }]));

/** @param {Measured} measure @param {any} value */
const shown = ({ unit, decimals }, value) => (unit === "%" ? formatPercent(value) : formatNumber(value, decimals));

/** @param {Measured} measure @param {any} value */
const withUnit = (measure, value) =>
  shown(measure, value) + (Number.isFinite(numberOf(value)) && measure.unit !== "%" ? `\u00a0${measure.unit}` : "");

/** Drift per second, or per frame where the frame rate is not known. @param {any} evaluation @param {string} what */
const driftName = ({ frames_per_s }, what) => (frames_per_s > 0 ? `${what}_mm_s` : `${what}_mm`);

/** @param {any} evaluation @param {Map<string, Measured>} measured */
function headTiles(evaluation, measured) {
  const { frames_per_s: fps, frames_per_s_source: source } = evaluation;
  const of = (/** @type {string} */ name) => /** @type {Measured} */ (measured.get(name));
  const total = (/** @type {string} */ name) => withUnit(of(name), of(name).total);
  const drift = (/** @type {string} */ what) => total(driftName(evaluation, what));
  const pairs = numberOf(of("self_intersecting_pairs").total), relative = of("geodesic_distortion_relative").total;
  return tiles([
    tile("Vertex error, seen by 3 or more", total("mesh_visible_mean_mm"), `seen by fewer ${total("mesh_hidden_mean_mm")}`),
    tile("Correspondence drift", drift("texture_drift"), `texture flow; exact ${drift("true_drift_observed")} where observed`),
    tile("Geodesic distortion", total("geodesic_distortion_mm"),
      Number.isFinite(numberOf(relative)) ? `${formatPercent(relative)} of the distance` : "against the template"),
    tile("Left-out camera error", total("left_out_px"), `reprojection ${total("reprojection_px")}`),
    tile("Self-intersections", pairs === 0 ? "none" : formatCount(pairs), "pairs of faces, all frames"),
    tile("Jitter", total("jitter_observed_mm"), `inferred ${total("jitter_inferred_mm")}`),
    tile("Frames a second", fps > 0 ? formatNumber(fps, 2) : "not known", fps > 0 ? `by ${source}` : "drift is given per frame; --fps gives it per second"),
  ]);
}

/** @param {any} evaluation */
const axisOf = ({ frames }) => ({
  noun: "frame", names: frames.map((/** @type {Frame} */ frame) => frame.frame),
  withoutMesh: frames.map((/** @type {Frame} */ frame) => frame.missing.includes("mesh.ply")),
});

/** Nothing where no frame has a value. @param {any} evaluation @param {Measured | undefined} measure */
function plotOf(evaluation, measure, fromZero = true) {
  if (!measure?.frames.some(value => Number.isFinite(numberOf(value)))) return null;
  const { title, unit, decimals } = measure;
  return linePlot(axisOf(evaluation), measure.frames.map(numberOf), { title, unit, decimals, fromZero });
}

/** @param {any} evaluation @param {Map<string, Measured>} measured */
function visibility(evaluation, measured) {
  const counts = evaluation.visibility_histogram, all = counts.reduce((/** @type {number} */ sum, /** @type {number} */ count) => sum + count, 0);
  if (counts.length === 0) return null;
  const axis = { noun: "observed in", names: counts.map((/** @type {number} */ _, /** @type {number} */ i) => `${10 * i}${DASH}${10 * (i + 1)} %`) };
  return section("visibility", "Visibility", el("div.plots",
    barPlot(axis, counts.map((/** @type {number} */ count) => (all > 0 ? count / all : NaN)),
      { title: "Vertices by the share of frames that observe them", unit: "%" }),
    plotOf(evaluation, measured.get("two_view_share")),
    plotOf(evaluation, measured.get("coverage"), false)),
  paragraph("The paper reports 54 % to 90 % coverage per frame, 75 % in the mean (Fig. 7)."));
}

/** @param {any} evaluation @param {Map<string, Measured>} measured */
function accuracy(evaluation, measured) {
  const drift = (/** @type {string} */ what) => driftName(evaluation, what);
  const names = ["mesh_visible_mean_mm", "mesh_hidden_mean_mm", drift("texture_drift"), drift("true_drift_observed"), drift("true_drift_inferred"),
    "geodesic_distortion_mm", "self_intersecting_pairs", "jitter_observed_mm", "jitter_inferred_mm", "error_jitter_observed_mm",
    "error_jitter_inferred_mm", "left_out_px"];
  const plots = names.map(name => plotOf(evaluation, measured.get(name))).filter(Boolean);
  return plots.length > 0 && section("accuracy", "Accuracy over the frames", el("div.plots", plots));
}

/** @param {any} evaluation @param {Map<string, Measured>} measured */
function frameTable(evaluation, measured) {
  const columns = ["coverage", "decode_recall", "cloud_median_mm", "mesh_visible_mean_mm", "mesh_hidden_mean_mm", driftName(evaluation, "texture_drift"),
    driftName(evaluation, "true_drift_observed"), "geodesic_distortion_mm", "self_intersecting_pairs", "jitter_observed_mm", "left_out_px"]
    .map(name => /** @type {Measured} */ (measured.get(name)));
  const row = (/** @type {any} */ title, /** @type {(measure: Measured) => any} */ valueOf) =>
    [title, ...columns.map(measure => cell(shown(measure, valueOf(measure)), numberOf(valueOf(measure))))];
  const rows = evaluation.frames.map((/** @type {Frame} */ { frame }, /** @type {number} */ f) => row(name(frame), measure => measure.frames[f]));
  return section("frame-measures", "Measures of the frames", table(["Frame", ...columns.map(({ heading }) => ({ title: heading, number: true }))],
    [row(el("b", "all"), measure => measure.total), ...rows], "cameras"));
}

/** @param {any} evaluation */
function cameraTable({ cameras }) {
  if (cameras.length === 0) return null;
  const number = (/** @type {any} */ value) => cell(formatNumber(value, 3), value);
  const rows = cameras.map((/** @type {any} */ camera) => {
    const outliers = camera.observations > 0 ? camera.outliers / camera.observations : NaN, { reprojection_px, left_out_px } = camera;
    return [name(camera.camera), cell(formatCount(camera.observations), camera.observations), cell(formatPercent(outliers), outliers),
      ...[reprojection_px?.median, reprojection_px?.p95, left_out_px?.median, left_out_px?.p95, camera.shift_x_px, camera.shift_y_px].map(number)];
  });
  const columns = ["Observations", "Outliers", "Reprojection, median px", "95 %", "Left out, median px", "95 %", "Shift x, px", "Shift y, px"];
  return section("camera-errors", "Errors of the cameras", table(["Camera", ...columns.map(title => ({ title, number: true }))], rows, "cameras"),
    paragraph("Left out: distance to the point of all other cameras that agree with it. A shift that is not near zero indicates a camera that "
      + "has moved since its calibration."));
}

/** @param {any[]} remarks */
const remarks = remarks => remarks.length > 0 && section("remarks", "Not measured, and assumptions",
  table([], remarks.map(({ measure, reason }) => [measure, reason]), "facts"));

/** What stands beside the paper's figures. @param {any} evaluation */
function figuresOf({ total, frames }) {
  const coverages = frames.map((/** @type {Frame} */ frame) => numberOf(frame.measures.coverage)).filter(Number.isFinite);
  return {
    drift_mm_s: numberOf(total.measures.texture_drift_mm_s?.mean), geodesic_distortion_mm: numberOf(total.measures.geodesic_distortion_mm),
    coverage: numberOf(total.measures.coverage), lowest_coverage: Math.min(...coverages), highest_coverage: Math.max(...coverages),
  };
}

/** In front of what was measured: the job, its meshes and pictures. @param {any} page weft.v1.JobPage */
const jobBefore = page => [
  section("job", "The job", verdictBlock(page.headline, page.job.verdict)), warnings([...page.job.warnings, ...page.notes]), jobSequence(page),
  pictureSection(page),
];

/** @param {any} page */
const jobBehind = page => [
  plotSection(page.frames), frameSection(page.frames), cameraSection(page.cameras), cellSection(page.frames), alignmentSection(page.frames),
  optionSection(page), inputSection(page),
];

definePage("evaluation", ({ evaluation, page, maps, job }) => {
  const measured = measuresOf(page);
  return [
    pageHead(["Weft evaluation of ", name(evaluation.result), evaluation.truth ? ", against ground truth" : ", without ground truth"],
      `${page.headline}.`, evaluation.verdict, headTiles(evaluation, measured)),
    paperSection(figuresOf(evaluation), evaluation.paper),
    job && jobBefore(job),
    mapSection("On the garment", maps),
    visibility(evaluation, measured),
    accuracy(evaluation, measured),
    frameTable(evaluation, measured),
    cameraTable(evaluation),
    job && jobBehind(job),
    remarks(evaluation.remarks),
  ];
});

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

/** @param {any} errors weft.v1.ErrorSummary, or nothing */
const meanOf = errors => numberOf(errors?.mean);

/** @param {any} value @param {number} decimals @param {string} unit */
const shown = (value, decimals, unit) => (Number.isFinite(numberOf(value)) ? `${formatNumber(value, decimals)}\u00a0${unit}` : DASH);

/** Drift per second, or per frame where the frame rate is not known. @param {any} evaluation */
function driftOf({ frames_per_s }) {
  const isPerSecond = frames_per_s > 0;
  return {
    unit: isPerSecond ? "mm/s" : "mm a frame", decimals: isPerSecond ? 2 : 3,
    mean: (/** @type {Frame} */ frame, /** @type {string} */ what) => meanOf(frame.measures[isPerSecond ? `${what}_mm_s` : `${what}_mm`]),
  };
}

/** @param {any} evaluation */
function headTiles(evaluation) {
  const { total, frames_per_s: fps, frames_per_s_source: source } = evaluation, { measures, mesh } = total, drift = driftOf(evaluation);
  const driftText = (/** @type {string} */ what) => shown(drift.mean(total, what), drift.decimals, drift.unit);
  const pairs = measures.self_intersecting_pairs, relative = measures.geodesic_distortion_relative;
  return tiles([
    tile("Vertex error, seen by 3 or more", shown(meanOf(mesh?.visible_mm), 3, "mm"), `seen by fewer ${shown(meanOf(mesh?.hidden_mm), 3, "mm")}`),
    tile("Correspondence drift", driftText("texture_drift"), `texture flow; exact ${driftText("true_drift_observed")} where observed`),
    tile("Geodesic distortion", shown(measures.geodesic_distortion_mm, 2, "mm"),
      relative === undefined ? "against the template" : `${formatPercent(relative)} of the distance`),
    tile("Left-out camera error", shown(meanOf(measures.left_out_px), 3, "px"), `reprojection ${shown(meanOf(measures.reprojection_px), 3, "px")}`),
    tile("Self-intersections", pairs === undefined ? DASH : pairs === 0 ? "none" : formatCount(pairs), "pairs of faces, all frames"),
    tile("Jitter", shown(meanOf(measures.jitter_observed_mm), 3, "mm"), `inferred ${shown(meanOf(measures.jitter_inferred_mm), 3, "mm")}`),
    tile("Frames a second", fps > 0 ? formatNumber(fps, 2) : "not known", fps > 0 ? `by ${source}` : "drift is given per frame; --fps gives it per second"),
  ]);
}

/** @param {any} evaluation */
const axisOf = ({ frames }) => ({
  noun: "frame", names: frames.map((/** @type {Frame} */ frame) => frame.frame),
  withoutMesh: frames.map((/** @type {Frame} */ frame) => frame.missing.includes("mesh.ply")),
});

/** Nothing where no frame has a value. @param {any} evaluation @param {import("./plot_axes.js").PlotText} text @param {(frame: Frame) => any} value */
function plotOf(evaluation, text, value) {
  const values = evaluation.frames.map(value).map(numberOf);
  return values.some(Number.isFinite) && linePlot(axisOf(evaluation), values, text);
}

/** @param {any} evaluation */
function visibility(evaluation) {
  const counts = evaluation.visibility_histogram, all = counts.reduce((/** @type {number} */ sum, /** @type {number} */ count) => sum + count, 0);
  if (counts.length === 0) return null;
  const axis = { noun: "observed in", names: counts.map((/** @type {number} */ _, /** @type {number} */ i) => `${10 * i}${DASH}${10 * (i + 1)} %`) };
  return section("visibility", "Visibility", el("div.plots",
    barPlot(axis, counts.map((/** @type {number} */ count) => (all > 0 ? count / all : NaN)),
      { title: "Vertices by the share of frames that observe them", unit: "%" }),
    plotOf(evaluation, { title: "Measured by two cameras only, share of the cells", unit: "%" }, frame => frame.measures.two_view_share),
    plotOf(evaluation, { title: "Coverage: observed share of the cells", unit: "%", fromZero: false }, frame => frame.measures.coverage)),
  paragraph("The paper reports 54 % to 90 % coverage per frame, 75 % in the mean (Fig. 7)."));
}

/** @param {any} evaluation */
function accuracy(evaluation) {
  const drift = driftOf(evaluation);
  /** @param {string} title @param {string} unit @param {number} decimals @param {(frame: Frame) => any} value */
  const plot = (title, unit, decimals, value) => plotOf(evaluation, { title, unit, decimals }, value);
  /** @param {string} title @param {string} what */
  const driftPlot = (title, what) => plot(`${title}, mean, ${drift.unit}`, drift.unit, drift.decimals, frame => drift.mean(frame, what));
  /** @param {string} title @param {string} unit @param {string} measure */
  const meanPlot = (title, unit, measure) => plot(title, unit, 3, frame => meanOf(frame.measures[measure]));
  const plots = [
    plot("Vertex error, seen by 3 or more, mean, mm", "mm", 3, frame => meanOf(frame.mesh?.visible_mm)),
    plot("Vertex error, seen by fewer, mean, mm", "mm", 3, frame => meanOf(frame.mesh?.hidden_mm)),
    driftPlot("Drift by texture flow", "texture_drift"),
    driftPlot("Exact drift, observed", "true_drift_observed"),
    driftPlot("Exact drift, inferred", "true_drift_inferred"),
    plot("Geodesic distortion, mm", "mm", 2, frame => frame.measures.geodesic_distortion_mm),
    plot("Self-intersecting pairs of faces", "", 0, frame => frame.measures.self_intersecting_pairs),
    meanPlot("Jitter, observed, mm", "mm", "jitter_observed_mm"),
    meanPlot("Jitter, inferred, mm", "mm", "jitter_inferred_mm"),
    meanPlot("Jitter of the error, observed, mm", "mm", "error_jitter_observed_mm"),
    meanPlot("Jitter of the error, inferred, mm", "mm", "error_jitter_inferred_mm"),
    meanPlot("Left-out camera error, px", "px", "left_out_px"),
  ].filter(Boolean);
  return plots.length > 0 && section("accuracy", "Accuracy over the frames", el("div.plots", plots));
}

/** @param {any} evaluation */
function frameTable(evaluation) {
  const drift = driftOf(evaluation);
  const percent = (/** @type {any} */ share) => cell(formatPercent(share), share);
  const number = (/** @type {any} */ value, /** @type {number} */ decimals) => cell(formatNumber(value, decimals), value);
  /** @param {any} title @param {Frame} frame */
  const row = (title, frame) => {
    const { measures, mesh, centers, cloud } = frame;
    return [title, percent(measures.coverage), percent(centers?.recall), number(cloud?.error_mm?.median, 3), number(meanOf(mesh?.visible_mm), 3),
      number(meanOf(mesh?.hidden_mm), 3), number(drift.mean(frame, "texture_drift"), drift.decimals),
      number(drift.mean(frame, "true_drift_observed"), drift.decimals), number(measures.geodesic_distortion_mm, 2),
      cell(formatCount(measures.self_intersecting_pairs), measures.self_intersecting_pairs), number(meanOf(measures.jitter_observed_mm), 3),
      number(meanOf(measures.left_out_px), 3)];
  };
  const columns = ["Coverage", "Decode recall", "Cloud, median mm", "Seen by 3+, mm", "By fewer, mm", `Texture drift, ${drift.unit}`,
    `Exact drift, ${drift.unit}`, "Distortion, mm", "Self-inter\u00adsections", "Jitter, mm", "Left out, px"].map(title => ({ title, number: true }));
  const rows = evaluation.frames.map((/** @type {Frame} */ frame) => row(name(frame.frame), frame));
  return section("frame-measures", "Measures of the frames", table(["Frame", ...columns], [row(el("b", "all"), evaluation.total), ...rows], "cameras"));
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
    drift_mm_s: meanOf(total.measures.texture_drift_mm_s), geodesic_distortion_mm: numberOf(total.measures.geodesic_distortion_mm),
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

definePage("evaluation", ({ evaluation, page, maps, job }) => [
  pageHead(["Weft evaluation of ", name(evaluation.result), evaluation.truth ? ", against ground truth" : ", without ground truth"],
    `${page.headline}.`, evaluation.verdict, headTiles(evaluation)),
  paperSection(figuresOf(evaluation), evaluation.paper),
  job && jobBefore(job),
  mapSection("On the garment", maps),
  visibility(evaluation),
  accuracy(evaluation),
  frameTable(evaluation),
  cameraTable(evaluation),
  job && jobBehind(job),
  remarks(evaluation.remarks),
]);

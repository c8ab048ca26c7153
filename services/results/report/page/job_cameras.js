// @ts-check
// The section about cameras.
import { bar, cell, el, name, paragraph, section, table } from "./parts.js";
import { DASH, counted, formatCount, formatNumber, numberOf, words } from "./numbers.js";
import { barPlot } from "./plot.js";

// Decoding itself leaves some hundredths of a pixel, which many cells make significant.
const SIGNIFICANT_BIAS = 4, NOTABLE_BIAS_PX = 0.1;
const REASON_COLUMNS = 5, SHOWN_REASONS = 3;

/** v1.PageCamera. @typedef {any} Camera */

/** @param {any} count @param {Camera} camera */
const perFrame = (count, camera) => (camera.frames_seen > 0 ? numberOf(count) / camera.frames_seen : 0);

/** @param {any} count @param {Camera} camera @param {...any} more */
function perFrameCell(count, camera, ...more) {
  if (camera.frames_seen === 0) return cell(DASH, NaN);
  const mean = perFrame(count, camera), isSmall = camera.frames_seen > 1 && numberOf(count) > 0 && mean < 9.95;
  return cell([isSmall ? formatNumber(mean, 1) : formatCount(mean), ...more], mean);
}

/** Most frequent first; then how many more. @param {Camera} camera */
function missingText({ missing_reasons }) {
  const lines = missing_reasons.slice(0, SHOWN_REASONS).map((/** @type {any} */ { reason, count }) =>
    reason + (count > 1 ? ` (${counted(count, "frame", "frames")})` : ""));
  if (missing_reasons.length > SHOWN_REASONS) lines.push(`and ${formatCount(missing_reasons.length - SHOWN_REASONS)} more`);
  return lines.map((/** @type {string} */ line) => el("div", line));
}

/** @param {Camera[]} cameras */
function missingCameras(cameras) {
  const missing = cameras.filter(camera => camera.frames_missing > 0);
  if (missing.length === 0) return [paragraph("Every camera gave a usable image in every frame.")];
  const rows = missing.map(camera => [name(camera.camera), cell(
    `${formatCount(camera.frames_missing)} of ${formatCount(camera.frames_missing + camera.frames_seen)}`, camera.frames_missing), missingText(camera)]);
  return [el("h3", "Without a usable image"), table(["Camera", "Frames", "Why"], rows, "missing")];
}

/** Of cameras that nothing triggered together. @param {Camera[]} cameras */
function movedCameras(cameras) {
  const moved = cameras.filter(camera => camera.frames_moved > 0);
  if (moved.length === 0) return [];
  const rows = moved.map(camera => [name(camera.camera), cell(`${formatCount(camera.frames_moved)} of ${formatCount(camera.frames_seen)}`, camera.frames_moved),
    formatNumber(camera.longest_move_ms, 1)]);
  return [el("h3", "Taken at another moment"),
    paragraph("These observations were moved to the moment of their frame, by the cloth's motion to the camera's next or last image."),
    table(["Camera", "Frames", "At most, ms"], rows, "moved")];
}

/** How far the camera sees nodes from where the others do; marked where it is hardly chance. @param {Camera} camera */
function biasCell({ frames_with_bias, bias_x_px, bias_y_px, bias_significance }) {
  if (frames_with_bias === 0) return cell(DASH, NaN);
  const bias_px = Math.hypot(bias_x_px, bias_y_px);
  const text = `${formatNumber(bias_px, 2)} (${formatNumber(bias_significance, 1)} σ)`;
  return cell(bias_significance > SIGNIFICANT_BIAS && bias_px > NOTABLE_BIAS_PX ? el("b", text) : text, bias_px);
}

/** The most frequent reasons over all cameras. @param {Camera[]} cameras */
export function mainReasons(cameras) {
  /** @type {Map<string, number>} */
  const totals = new Map();
  for (const { patches_rejected } of cameras) for (const { reason, count } of patches_rejected) totals.set(reason, (totals.get(reason) ?? 0) + count);
  return [...totals].sort((a, b) => b[1] - a[1]).map(([reason]) => reason);
}

/** @param {Camera} camera @param {string[]} reasons @param {boolean} hasOthers @param {number} mostCenters */
function cameraRow(camera, reasons, hasOthers, mostCenters) {
  const counts = new Map(camera.patches_rejected.map((/** @type {any} */ { reason, count }) => [reason, count]));
  const listed = reasons.map(reason => counts.get(reason) ?? 0);
  const others = [...counts.values()].reduce((sum, count) => sum + count, 0) - listed.reduce((sum, count) => sum + count, 0);
  const share = mostCenters > 0 ? perFrame(camera.centers, camera) / mostCenters : 0;
  return [name(camera.camera), cell(`${formatCount(camera.frames_seen)} of ${formatCount(camera.frames_seen + camera.frames_missing)}`, camera.frames_seen),
    perFrameCell(camera.centers, camera, bar(share)), perFrameCell(camera.corners, camera), perFrameCell(camera.patches_accepted, camera),
    cell(formatNumber(camera.residual_px, 2), camera.residual_px), biasCell(camera), cell(formatNumber(camera.median_grey_levels, 0), camera.median_grey_levels),
    ...listed.map(count => perFrameCell(count, camera)), ...(hasOthers ? [perFrameCell(others, camera)] : [])];
}

/** @param {Camera[]} cameras */
function residualPlot(cameras) {
  if (!cameras.some(camera => Number.isFinite(numberOf(camera.residual_px)))) return null;
  return el("div.plots", barPlot({ names: cameras.map(camera => camera.camera), noun: "camera" }, cameras.map(camera => camera.residual_px),
    { title: "Reprojection residual per camera, RMS, px", unit: "px", decimals: 3 }));
}

/** @param {Camera[]} cameras */
export function cameraSection(cameras) {
  if (cameras.length === 0) return null;
  const all = mainReasons(cameras), reasons = all.slice(0, REASON_COLUMNS), hasOthers = all.length > reasons.length;
  const mostCenters = Math.max(...cameras.map(camera => perFrame(camera.centers, camera)));
  const columns = ["Frames", "Cells seen", "Corners seen", "Patches read", "Residual, px", "Off by, px", "Grey levels",
    ...reasons.map(reason => `Rejected: ${words(reason)}`), ...(hasOthers ? ["Rejected: other reasons"] : [])];
  return section("cameras", "Cameras", ...missingCameras(cameras), ...movedCameras(cameras), el("h3", "Contribution of each camera"),
    paragraph("Means per frame in which the camera gave an image. A patch is a connected piece of the pattern; it is rejected as a whole. ",
      el("i", "Residual"), " is the RMS distance of the camera's observations to the points as all other cameras see them, so it is a reprojection ",
      "error that cannot hide in the point. ", el("i", "Off by"), " is how far a camera sees the cloth from where all others see it, with its ",
      "significance: in bold where the camera moved or its calibration is off. ", el("i", "Grey levels"), " are those that the print spans, from its ",
      "black lines to its brightest ink."),
    table(["Camera", ...columns.map(title => ({ title, number: true }))],
      cameras.map(camera => cameraRow(camera, reasons, hasOthers, mostCenters)), "cameras"),
    residualPlot(cameras));
}

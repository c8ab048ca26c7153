// @ts-check
// Sections about frames: plots over them, and their table.
import { bar, cell, details, el, name, paragraph, section, table } from "./parts.js";
import { DASH, counted, formatCount, formatDuration, formatNumber, formatPercent, numberOf } from "./numbers.js";
import { linePlot, stackedPlot } from "./plot.js";

// Longer tables are folded away behind a short one of the frames that need a look.
const LONG_TABLE = 40, MOST_TROUBLED = 200, LOWEST = 5;

/** v1.FrameReport. @typedef {any} Frame */

/** @param {Frame} frame */
export const isRegistered = frame => frame.state === "FRAME_STATE_DONE" || frame.state === "FRAME_STATE_DEGRADED";

const STATES = /** @type {Record<string, [string, string]>} */ ({
  FRAME_STATE_DONE: ["good", "✓ done"], FRAME_STATE_DEGRADED: ["warn", "! degraded"], FRAME_STATE_FAILED: ["bad", "✕ failed"],
  FRAME_STATE_CANCELLED: ["", "cancelled"], FRAME_STATE_RUNNING: ["", "running"], FRAME_STATE_WAITING: ["", "waiting"],
});

/** @param {Frame} frame */
function stateOf(frame) {
  const [colour, text] = STATES[frame.state] ?? ["bad", "? not recorded"];
  const isBridged = frame.state === "FRAME_STATE_FAILED" && frame.temporal?.bridged;
  return el(colour ? `span.state.${colour}` : "span.state", isBridged ? "✕ bridged" : text);
}

/** The reason, what the removal of self-intersections left, and whom it cost a measurement. @param {Frame} frame @param {string} more */
function remarkOf({ reason, temporal, mesh, set_aside }, more = "") {
  const again = temporal?.refined || temporal?.bridged;
  const pairs = (again ? temporal?.self_intersections : mesh?.self_intersections) ?? 0;
  const demoted = (mesh?.demoted ?? 0) + (temporal?.demoted ?? 0);
  return [
    reason, pairs > 0 && counted(pairs, "pair of faces intersects", "pairs of faces intersect"),
    demoted > 0 && `${counted(demoted, "observed vertex", "observed vertices")} moved to undo a self-intersection`,
    set_aside && "given up because its workers ended abnormally; a new job retries it", more,
  ].filter(Boolean).join("; ");
}

/** The columns at both ends of every table of frames. @param {Frame} frame */
function endsOf(frame) {
  const cameras = frame.views_used + frame.views_missing;
  return [cell(cameras > 0 ? `${formatCount(frame.views_used)} of ${formatCount(cameras)}` : DASH, frame.views_used),
    cell(frame.total_ms > 0 ? formatDuration(frame.total_ms) : DASH, frame.total_ms)];
}

/** False of imports, and of work without cameras. @param {Frame[]} frames */
const areMeasured = frames => !frames.some(isRegistered)
  || frames.some(({ mesh, cloud, driven }) => driven || cloud || numberOf(mesh?.vertices_with_cell ?? mesh?.coverage ?? 0) > 0);

/** @param {Frame} frame */
const plainRow = frame => [name(frame.frame), stateOf(frame), ...endsOf(frame), remarkOf(frame)];

/** @param {Frame} frame */
function frameRow(frame) {
  const { mesh, cloud } = frame, has = isRegistered(frame), coverage = mesh?.coverage ?? 0;
  return [name(frame.frame), stateOf(frame), cell(has ? [formatPercent(coverage), bar(coverage)] : DASH, has ? coverage : NaN),
    has ? cell(`${formatCount(mesh?.observed ?? 0)} of ${formatCount(mesh?.vertices_with_cell ?? 0)}`, mesh?.observed) : DASH,
    cell(formatCount(cloud?.centers), cloud?.centers),
    cell(has ? formatNumber(mesh?.median_observed_sigma_mm ?? 0, 3) : DASH, has ? mesh?.median_observed_sigma_mm : NaN),
    ...endsOf(frame), remarkOf(frame)];
}

/** @param {Frame} frame */
function drivenRow(frame) {
  const driven = isRegistered(frame) ? frame.driven : undefined, rays = driven && driven.rays - driven.rejected_rays;
  return [name(frame.frame), stateOf(frame), cell(formatCount(rays), rays), cell(formatCount(driven?.rejected_rays), driven?.rejected_rays),
    cell(formatNumber(driven?.residual_px, 2), driven?.residual_px), cell(formatNumber(driven?.median_sigma_mm, 2), driven?.median_sigma_mm),
    ...endsOf(frame), remarkOf(frame, frame.driven?.started_anew ? "found without the frame before" : "")];
}

/** @param {Frame[]} frames */
function frameTable(frames) {
  const number = (/** @type {string} */ title) => ({ title, number: true });
  const isDriven = frames.some(frame => frame.driven);
  const [row, measures] = isDriven ? [drivenRow, ["Rays", "Rays set aside", "Residual, px", "Sigma, mm"]]
    : areMeasured(frames) ? [frameRow, ["Coverage", "Observed cells", "Triangulated", "Sigma, mm"]] : [plainRow, []];
  return table(["Frame", "State", ...measures.map(number), number("Cameras"), number("Time"), "Remark"],
    frames.map(row), "frames");
}

/** Frames that are not simply done, and those that came out worst; in their order. @param {Frame[]} frames */
export function framesToLookAt(frames) {
  const badness = (/** @type {Frame} */ frame) => (frame.driven ? numberOf(frame.driven.median_sigma_mm) : -numberOf(frame.mesh?.coverage ?? 0));
  const done = frames.filter(frame => frame.state === "FRAME_STATE_DONE").sort((a, b) => badness(b) - badness(a)).slice(0, LOWEST);
  const troubled = frames.filter(frame => frame.state !== "FRAME_STATE_DONE").slice(0, MOST_TROUBLED);
  const chosen = new Set([...done, ...troubled]);
  return frames.filter(frame => chosen.has(frame));
}

/** @param {Frame[]} frames */
export function frameSection(frames) {
  if (frames.length === 0) return section("frames", "Frames", paragraph("No frame has a report."));
  if (frames.length <= LONG_TABLE) return section("frames", "Frames", frameTable(frames));
  const notDone = frames.filter(frame => frame.state !== "FRAME_STATE_DONE").length;
  const worst = frames.some(frame => frame.driven) ? ", and those with the largest sigma"
    : areMeasured(frames) ? ", and those with the lowest coverage" : "";
  const first = notDone > MOST_TROUBLED ? ` (the first ${MOST_TROUBLED} of ${formatCount(notDone)})` : "";
  return section("frames", "Frames", paragraph(`Frames that are not simply done${worst}${first}:`),
    frameTable(framesToLookAt(frames)), details(`All ${formatCount(frames.length)} frames`, () => frameTable(frames)));
}

/** @param {Frame[]} frames */
export function stageLayers(frames) {
  /** @type {Map<string, number[]>} */
  const layers = new Map();
  frames.forEach((frame, i) => {
    for (const { stage, time_ms } of frame.stages) {
      if (!layers.has(stage)) layers.set(stage, frames.map(() => NaN));
      const values = /** @type {number[]} */ (layers.get(stage));
      values[i] = (values[i] || 0) + numberOf(time_ms);
    }
  });
  // Missing counts as no time where the frame has others, so that bars are whole means.
  return [...layers].map(([stage, values]) =>
    ({ name: stage, values: values.map((value, i) => (Number.isFinite(value) || frames[i].stages.length === 0 ? value : 0)) }));
}

/** @param {Frame[]} frames */
export function plotSection(frames) {
  if (frames.length === 0) return null;
  const axis = { names: frames.map(frame => frame.frame), withoutMesh: frames.map(frame => !isRegistered(frame)), noun: "frame" };
  const over = (/** @type {(frame: Frame) => any} */ of, needsMesh = true) => frames.map(frame => (needsMesh && !isRegistered(frame) ? NaN : of(frame)));
  const isDriven = frames.some(frame => isRegistered(frame) && frame.driven);
  const plots = isDriven ? [
    linePlot(axis, over(({ driven }) => driven && driven.rays - driven.rejected_rays), { title: "Rays: cells seen by a camera that the mesh follows" }),
    linePlot(axis, over(({ driven }) => driven?.residual_px), { title: "Residual, median, px", unit: "px", decimals: 2 }),
    linePlot(axis, over(({ driven, mesh }) => (driven ? driven.median_sigma_mm : mesh?.median_observed_sigma_mm)),
      { title: "Sigma of all vertices, median, mm", unit: "mm", decimals: 2 }),
  ] : !areMeasured(frames) ? [] : [
    linePlot(axis, over(({ mesh }) => mesh?.coverage ?? 0), { title: "Coverage: observed share of the cells", unit: "%", fromZero: false }),
    linePlot(axis, over(({ cloud }) => cloud?.centers, false), { title: "Triangulated cells" }),
    linePlot(axis, over(({ mesh }) => mesh?.median_observed_sigma_mm ?? 0), { title: "Sigma of observed vertices, median, mm", unit: "mm", decimals: 3 }),
  ];
  const layers = stageLayers(frames);
  if (layers.length > 0) plots.push(stackedPlot(axis, layers, { title: "Time per stage" }));
  if (plots.length === 0) return null;
  const anyLost = axis.withoutMesh.includes(true);
  return section("plots", "Over the frames", el("div.plots", plots), anyLost && paragraph("Red triangles mark frames without a mesh."));
}

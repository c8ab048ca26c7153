// @ts-check
// Sections about stages: cells without a point, garments, alignment, scans.
import { cell, details, el, name, paragraph, section, table } from "./parts.js";
import { DASH, counted, formatCount, formatDuration, formatNumber, formatPercent, medianOf, numberOf, words } from "./numbers.js";

// What the reasons of triangulation/cloud.h mean to an operator.
const EXPLANATIONS = /** @type {Record<string, string>} */ ({
  too_few_views: "seen by fewer cameras than triangulation needs: add cameras on that side, or move them closer",
  no_consensus: "the rays of the cameras do not meet: wrong observations, or a camera that has moved",
  poor_geometry: "the rays are nearly parallel: the cameras are too close together",
  isolated: "too few neighbours around it to be trusted",
  stretched_edges: "farther from its neighbours than cloth stretches",
  small_component: "part of a small piece far from trusted ones",
  unconfirmed: "seen by two cameras, without neighbours that confirm it",
});

/** @param {string} title */
const number = title => ({ title, number: true });

/** @param {any[]} frames v1.FrameReport */
export function cellSection(frames) {
  const clouds = frames.filter(frame => frame.cloud);
  if (clouds.length === 0) return null;
  /** @type {Map<string, number>} */
  const totals = new Map();
  for (const { cloud } of clouds) for (const { reason, count } of cloud.rejected) totals.set(reason, (totals.get(reason) ?? 0) + count);
  const sum = (/** @type {(frame: any) => number} */ of) => clouds.reduce((sum, frame) => sum + of(frame), 0);
  const points = sum(({ cloud }) => cloud.centers + cloud.corners), unclaimed = sum(({ mesh }) => mesh?.unclaimed_points ?? 0);
  const perFrame = (/** @type {number} */ count) => {
    const mean = count / clouds.length;
    return cell(clouds.length > 1 && count > 0 && mean < 9.95 ? formatNumber(mean, 1) : formatCount(mean), mean);
  };
  const rows = [[el("b", "triangulated"), perFrame(points), "cells and corners of the cloud"],
    ...[...totals].sort((a, b) => b[1] - a[1]).map(([reason, count]) => [words(reason), perFrame(count), EXPLANATIONS[reason] ?? ""])];
  if (unclaimed > 0) rows.push(["not on the garment", perFrame(unclaimed), "points whose cell belongs to no vertex of the template"]);
  return section("cells", "Cells that were seen", table(["", number("Per frame"), ""], rows, "reasons"));
}

/** @param {any[]} garments v1.PageGarment @param {any[]} overlaps v1.PageOverlap */
export function garmentSection(garments, overlaps) {
  if (garments.length === 0) return null;
  const rows = garments.map(garment => [garment.id, cell(formatCount(garment.vertices), garment.vertices), formatPercent(garment.coverage),
    formatPercent(garment.lowest_coverage), garment.lowest_coverage_frame, formatNumber(garment.median_sigma_mm, 3)]);
  return section("garments", "Garments",
    paragraph(el("code", "weft split"), " makes a result of each garment by itself.", overlaps.map(({ inner, outer, frames }) =>
      [" ", name(outer), " lies over ", name(inner), ` in ${counted(frames, "frame", "frames")}.`])),
    table(["Garment", number("Vertices"), number("Cells observed"), number("Lowest"), "in frame", number("Median sigma, mm")], rows, "garments"));
}

/** @param {number} energy */
function energyText(energy) {
  if (!Number.isFinite(energy)) return DASH;
  return Math.abs(energy) >= 1000 && Math.abs(energy) < 1e12 ? formatCount(energy) : String(Number(energy.toPrecision(4)));
}

/** @param {any[]} frames v1.FrameReport */
export function alignmentSection(frames) {
  /** @type {Map<string, any[]>} */
  const stages = new Map();
  for (const { mesh } of frames) for (const stage of mesh?.stages ?? []) stages.set(stage.name, [...(stages.get(stage.name) ?? []), stage]);
  if (stages.size === 0) return null;
  const rows = [...stages].map(([stage, entries]) => {
    const iterations = entries.map(entry => entry.iterations), least = Math.min(...iterations), most = Math.max(...iterations);
    const median = (/** @type {string} */ field) => medianOf(entries.map(entry => entry[field]));
    const before = median("energy_before"), after = median("energy_after"), time = median("time_ms");
    return [words(stage), formatCount(entries.length),
      cell(formatCount(medianOf(iterations)) + (least === most ? "" : ` (${least} to ${most})`), medianOf(iterations)),
      cell(energyText(before), before), cell(energyText(after), after), cell(formatDuration(time), time)];
  });
  return section("alignment", "Alignment", frames.length > 1 && paragraph("Medians over the frames."),
    table(["Stage", ...["Frames", "Iterations", "Energy before", "Energy after", "Time"].map(number)], rows, "stages"));
}

/** Scans by other methods, and what came of them. @param {any[]} frames v1.FrameReport */
export function scanSection(frames) {
  const scanned = frames.filter(frame => frame.mesh?.scan), scans = scanned.map(frame => frame.mesh.scan);
  if (scans.length === 0) return null;
  const sum = (/** @type {string} */ field) => formatCount(scans.reduce((sum, scan) => sum + numberOf(scan[field]), 0));
  const rows = scanned.map(({ frame, mesh: { scan } }) => [name(frame), ...[scan.points, scan.found].map(count => cell(formatCount(count), count)),
    cell(scan.found > 0 ? formatNumber(scan.median_distance_mm, 2) : DASH, scan.found > 0 ? scan.median_distance_mm : NaN),
    ...[scan.vertices, scan.unmeasured, scan.without_normal].map(count => cell(formatCount(count), count)), scan.normals_turned ? "turned" : ""]);
  const all = () => table(["Frame", ...["Points", "Found a vertex", "Distance, mm", "Vertices that follow", "Without measurement",
    "Without normal"].map(number), "Normals"], rows, "scans");
  return section("scans", "Scans", paragraph(`${sum("found")} of ${sum("points")} points found the cloth in ${counted(scans.length, "frame", "frames")}; `,
    `${sum("vertices")} vertices without a target follow them.`), rows.length > 40 ? details("All scans", all) : all());
}

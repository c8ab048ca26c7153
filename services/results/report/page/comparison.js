// @ts-check
// Two results side by side: weft.v1.Comparison and weft.v1.ComparisonPage.
import { cell, definePage, el, name, pageHead, paragraph, section, table } from "./parts.js";
import { DASH, formatCount, formatNumber, formatPercent, numberOf } from "./numbers.js";
import { mapSection } from "./pictures.js";
import { overlaidPlot } from "./plot.js";
import { sequenceSection } from "./sequence.js";

const OUTCOMES = /** @type {Record<string, string>} */ ({
  COMPARISON_OUTCOME_NOT_TESTED: "not tested", COMPARISON_OUTCOME_NO_DIFFERENCE: "no significant difference",
  COMPARISON_OUTCOME_A_LOWER: "A is lower", COMPARISON_OUTCOME_A_HIGHER: "A is higher",
});
/** Signs are for those who cannot tell the colours apart. */
const SIDES = { a: "● A", b: "■ B" };

/** @param {"a" | "b"} which @param {string} more */
const side = (which, more = "") => el(`span.side.${which}`, SIDES[which] + more);

/** "< 0.001", "0.042". @param {number | undefined} p */
const probability = p => cell(p === undefined ? DASH : p < 0.001 ? "< 0.001" : p.toFixed(3), p);

/** @param {any} comparison @param {any} page */
const head = (comparison, page) => pageHead(
  `Weft comparison of two results${comparison.truth ? ", against ground truth" : ", without ground truth"}`, `${page.headline}.`, null,
  el("ul.sides", el("li", side("a"), " ", name(comparison.a)), el("li", side("b"), " ", name(comparison.b))));

/** @param {string} outcome */
function outcomeOf(outcome) {
  if (outcome === "COMPARISON_OUTCOME_A_BETTER") return side("a", " is better");
  if (outcome === "COMPARISON_OUTCOME_B_BETTER") return side("b", " is better");
  return OUTCOMES[outcome];
}

/** @param {any} comparison @param {any} page */
function measures({ measures: all, meshes, significance_level: level }, { decimals }) {
  const rows = all.map((/** @type {any} */ measure, /** @type {number} */ m) => {
    const value = (/** @type {any} */ number, more = 0) => cell(formatNumber(measure.unit === "%" ? 100 * number : number, decimals[m] + more), number);
    const error = measure.standard_error;
    return [measure.unit ? `${measure.title}, ${measure.unit}` : measure.title, value(measure.a), value(measure.b), value(measure.difference, 1),
      error === undefined ? DASH : cell(`±\u00a0${value(error, 1).content}`, error), cell(formatCount(measure.frames), measure.frames),
      probability(measure.p), probability(measure.p_adjusted), outcomeOf(measure.outcome)];
  });
  const { distance_mm: distance, beyond_sigmas_share: beyond } = meshes;
  const columns = ["A", "B", "A − B", "Standard error", "Frames", "p", "p, all"].map(title => ({ title, number: true }));
  return section("measures", "Side by side", table(["Mean over the frames", ...columns, "Outcome"], rows, "outcomes"),
    distance && paragraph(`Vertices of both are ${formatNumber(distance.mean, 3)} mm apart in the mean, ${formatNumber(distance.median, 3)} mm in the median, `
      + `${formatNumber(distance.p95, 3)} mm at 95 %`,
    beyond !== undefined && `; ${formatPercent(beyond)} of them farther than the sigmas of both explain in 99 % of cases`, "."),
    paragraph("Each frame of A is paired with the same frame of B. p is the probability that chance makes such a difference; it allows for frames that "
      + "resemble their neighbours (Lazarus et al. 2018). ", el("i", "p, all"), " allows for the number of measures as well (Holm 1979). Where that is below "
      + `${formatNumber(level, 2)} a difference is called significant.`));
}

/** @param {any[]} differences */
const jobDifferences = differences => differences.length > 0 && section("differences", "What differs in the jobs", table(["", "A", "B"],
  differences.map(({ what, a, b }) => [el("code", what), a ? name(a) : DASH, b ? name(b) : DASH]), "facts"));

/** @param {any} comparison @param {any} page */
function overlays({ frames }, { plots, without_mesh: withoutMesh }) {
  const axis = { noun: "frame", names: frames.map((/** @type {any} */ frame) => frame.frame), withoutMesh };
  return plots.length > 0 && section("plots", "Over the frames", el("div.plots", plots.map((/** @type {any} */ plot) => overlaidPlot(axis, plot.series, {
    title: plot.title, unit: plot.unit, decimals: plot.decimals, fromZero: plot.from_zero, wholePercent: plot.whole_percent, firstStyle: plot.first_style,
  }))));
}

/** @param {any} page weft.v1.CameraScore of both results */
function cameras({ a_cameras: a, b_cameras: b }) {
  const names = [...new Set([...a, ...b].map(camera => camera.camera))].sort();
  const number = (/** @type {any} */ value) => cell(formatNumber(value, 3), value);
  const rows = names.map(id => {
    const both = [a, b].map(of => of.find((/** @type {any} */ camera) => camera.camera === id));
    const shift = (/** @type {any} */ camera) => Math.hypot(numberOf(camera?.shift_x_px), numberOf(camera?.shift_y_px));
    return [name(id), ...both.map(camera => number(camera?.reprojection_px?.median)), ...both.map(camera => number(camera?.left_out_px?.median)),
      ...both.map(camera => number(shift(camera)))];
  });
  const columns = ["Reprojection, median px, A", "B", "Left out, median px, A", "B", "Mean shift, px, A", "B"].map(title => ({ title, number: true }));
  return rows.length > 0 && section("cameras", "Cameras", table(["Camera", ...columns], rows, "cameras"));
}

/** Of one result begin with its name. @param {any[]} remarks */
const comparedRemarks = remarks => remarks.length > 0 && section("remarks", "Not measured, and assumptions", table(["", "Measure", "Why"],
  remarks.map(({ measure, reason }) => {
    const [, which, rest] = /^([AB]): (.*)$/.exec(measure) ?? [null, "both", measure];
    return [which, rest, reason];
  }), "facts"));

/** The meshes of A by how far both results are apart. @param {any} comparison @param {any} page @param {any} meshes */
const distances = ({ frames }, { notes }, meshes) => sequenceSection(meshes, [
  `Meshes of A, ${formatCount(meshes.vertices)} of their vertices in ${formatCount(meshes.frames.length)} of ${formatCount(frames.length)} frames; `
  + "grey: not measured in both.", notes.map((/** @type {string} */ note) => ` ${note}`)]);

definePage("comparison", ({ comparison, page, maps, meshes }) => [
  head(comparison, page),
  measures(comparison, page),
  jobDifferences(comparison.differences),
  meshes && distances(comparison, page, meshes),
  mapSection("Differences on the garment", maps, paragraph("Dark grey: not measured in both. Results of the same images share their noise, so a distance "
    + "beyond the sigmas is no chance.")),
  overlays(comparison, page),
  cameras(page),
  comparedRemarks(comparison.remarks),
]);

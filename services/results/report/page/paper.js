// @ts-check
// The figures of the paper beside ours: Halimi et al. 2022, Table 1 and Figure 7.
import { el, paragraph, section, table } from "./parts.js";
import { DASH, formatNumber, formatPercent, numberOf } from "./numbers.js";

/** @typedef {import("./numbers.js").Value} Value */
/** NaN where it was not measured; coverage from 0 to 1, over the frames. @typedef {{drift_mm_s: Value, geodesic_distortion_mm: Value, coverage?: Value, lowest_coverage?: Value, highest_coverage?: Value}} PaperFigures */

/** Of Figure 7, for the first method. */
const PAPER_COVERAGE = { coverage: 0.75, lowest_coverage: 0.54, highest_coverage: 0.90 };

/** @param {Partial<PaperFigures>} figures */
function coverageText({ coverage, lowest_coverage, highest_coverage }) {
  if (!Number.isFinite(numberOf(coverage))) return DASH;
  if (!Number.isFinite(numberOf(lowest_coverage))) return formatPercent(coverage);
  return `${formatPercent(coverage)} (${formatPercent(lowest_coverage)} to ${formatPercent(highest_coverage)})`;
}

/** Says how to measure what is missing. @param {PaperFigures} ours @param {any[]} published v1.PaperMethod */
export function paperSection(ours, published) {
  const row = (/** @type {any} */ method, /** @type {PaperFigures} */ figures) =>
    [method, formatNumber(figures.drift_mm_s, 2), formatNumber(figures.geodesic_distortion_mm, 2), coverageText(figures)];
  const rows = published.map((method, i) => row(method.method, i === 0 ? { ...method, ...PAPER_COVERAGE } : method));
  const isComplete = [ours.drift_mm_s, ours.geodesic_distortion_mm].every(value => Number.isFinite(numberOf(value)));
  const columns = ["Correspondence drift rate, mm/s", "Geodesic distortion, mm", "Coverage per frame, mean (lowest to highest)"];
  return section("paper", "Beside the paper",
    table(["Method", ...columns.map(title => ({ title, number: true }))], [row(el("b", "This result"), ours), ...rows]),
    !isComplete && paragraph(el("code", "weft evaluate RESULT --out RESULT/evaluation"), " measures drift and distortion."),
    paragraph("The other lines are Table 1 and Figure 7 of Halimi et al. 2022, measured on that paper's own recordings of worn shirts, which ",
      "are not public: another garment, other motion, another frame rate. Drift: optical flow between consecutive unwrapped textures. ",
      "Distortion: mean change of exact geodesic distances from seeded sources, here against the template, there against a T-pose. Coverage: ",
      "share of the cells measured by three cameras or more."));
}

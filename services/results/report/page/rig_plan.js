// @ts-check
// Cameras for a rig, in the order of their use: weft.v1.RigPlanPage.
import { cell, definePage, el, name, pageHead, paragraph, section, svg, table } from "./parts.js";
import { counted, formatNumber, formatPercent } from "./numbers.js";
import { mapSection } from "./pictures.js";
import { linePlot } from "./plot.js";
import { FROM_ABOVE, FROM_THE_SIDE, RigDrawing } from "./rig.js";

// Names of candidates that were not chosen only where there are few.
const MOST_NAMED = 60;

/** @param {any} page @param {import("./rig.js").PaperAxes} axes */
function drawing({ plan, page: { cameras, garment_mm: coordinates } }, axes) {
  const points = Array.from({ length: coordinates.length / 3 }, (_, i) => coordinates.slice(3 * i, 3 * i + 3));
  const drawn = new RigDrawing(axes, [...cameras.map((/** @type {any} */ camera) => camera.center_mm), ...points]);
  for (const point of points) {
    const [x, y] = drawn.place(point);
    drawn.add(svg("circle.range", { cx: x.toFixed(1), cy: y.toFixed(1), r: 1.2 }));
  }
  const chosen = new Set(plan.steps.slice(0, plan.chosen).map((/** @type {any} */ step) => step.camera)), areFew = cameras.length <= MOST_NAMED;
  for (const camera of cameras) if (chosen.has(camera.id)) drawn.addCamera(camera, "point", ", chosen", true);
  for (const camera of cameras) if (!chosen.has(camera.id)) drawn.addCamera(camera, "line", "", areFew);
  return drawn.figure();
}

/** @param {any} plan */
function curves({ steps }) {
  const axis = { noun: "camera", names: steps.map((/** @type {any} */ _, /** @type {number} */ i) => String(i + 1)) };
  const plot = (/** @type {string} */ field, /** @type {import("./plot_axes.js").PlotText} */ text) =>
    linePlot(axis, steps.map((/** @type {any} */ step) => step[field]), text);
  return el("div.plots", plot("coverage", { title: "Covered cells", unit: "%" }),
    plot("mean_views", { title: "Views of a cell, mean", decimals: 1 }),
    plot("median_sigma_mm", { title: "Expected sigma of covered cells, median, mm", unit: "mm", decimals: 3 }));
}

/** @param {any} plan */
function cameraTable({ steps, chosen }) {
  const rows = steps.map((/** @type {any} */ step, /** @type {number} */ i) => {
    const added = 100 * (step.coverage - (i > 0 ? steps[i - 1].coverage : 0));
    return [name(step.camera), cell(`${i + 1}${i < chosen ? " (chosen)" : ""}`, i), cell(formatPercent(step.coverage), step.coverage),
      cell(formatNumber(added, 2), added), cell(formatNumber(step.mean_views, 1), step.mean_views),
      cell(formatNumber(step.median_sigma_mm, 3), step.median_sigma_mm)];
  });
  const columns = ["Place", "Covered", "Added, %", "Views of a cell, mean", "Sigma, mm"].map(title => ({ title, number: true }));
  return table(["Camera", ...columns], rows, "cameras");
}

definePage("rig_plan", data => {
  const { plan, page, maps } = data;
  return [
    pageHead("Weft rig plan", `${page.headline}.`, plan.verdict, paragraph(
      `A cell is covered when ${plan.views_needed} cameras see it: nothing before it, facing within ${formatNumber(plan.max_facing_deg, 0)} degrees, `
      + `${formatNumber(plan.min_pitch_px, 1)} px or more. All candidates together cover ${formatPercent(plan.steps[plan.steps.length - 1].coverage)}. `
      + `Evaluated ${counted(plan.moments.length, "moment", "moments")} of the motion; sigma is what pixel noise of ${formatNumber(plan.noise_px, 2)} px leaves.`)),
    section("curves", "By the number of cameras", curves(plan)),
    section("rig", "The rig", el("div.plots.drawings", [FROM_ABOVE, FROM_THE_SIDE].map(axes => drawing(data, axes))), paragraph(
      "Selected cameras are filled, the others outlined; each wedge opens in the direction that its camera faces. Dots are the garment.")),
    mapSection("Coverage of the selected cameras", maps),
    section("cameras", "Cameras in order of selection", cameraTable(plan)),
  ];
});

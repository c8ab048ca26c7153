// @ts-check
// What a calibration of a rig came to: weft.v1.CalibrationReport and weft.v1.CalibrationPage.
import { cell, definePage, el, name, pageHead, paragraph, section, svg, table, tile, tiles } from "./parts.js";
import { counted, formatCount, formatDuration, formatNumber, shortened } from "./numbers.js";
import { linePlot } from "./plot.js";
import { FROM_ABOVE, FROM_THE_SIDE, RigDrawing } from "./rig.js";

/** Of the report, and of the page. @typedef {any} Camera */

const PANEL = 150, MATRIX = 480;  // in the pictures' units
const MOST_IN_MATRIX = 64, MOST_LINKS = 900;

/** @param {number} value */
const f = value => value.toFixed(1);

/** @param {any} report @param {any} page */
function head(report, page) {
  const views = report.cameras.reduce((/** @type {number} */ sum, /** @type {Camera} */ camera) => sum + camera.views, 0);
  const { solution } = page;
  const stage = solution && solution.stage_mm.map((/** @type {number} */ mm) => formatNumber(mm / 1000, 2)).join(" x ");
  return pageHead("Weft rig calibration", `${page.headline}.`, report.verdict, page.provenance && paragraph(`${page.provenance}.`), tiles([
    tile("Frames", formatCount(report.frames), `${formatCount(views)} views of boards`),
    tile("Detection", formatDuration(1000 * report.detection_s), ""),
    ...(!solution ? [] : [
      tile("Solution", formatDuration(1000 * report.solution_s), `${solution.iterations} iterations${solution.converged ? "" : ", not converged"}`),
      tile("Reprojection error", `${formatNumber(report.rms_px, 3)}\u00a0px`,
        `variance factor ${formatNumber(report.variance_factor, 3)}, 1 for a model that fits`),
      tile("Projection uncertainty", `${formatNumber(solution.worst_px, 3)}\u00a0px`,
        ["at most, of a known point on the stage, in camera ", name(solution.worst_camera)]),
      tile("Stage", stage, "m that the boards were moved through"),
      tile("Rig", `version ${solution.rig_version}`, `${solution.rig_id} ${report.rig_hash}`),
    ]),
  ]));
}

/** @param {string} id @param {string} heading @param {string[]} items @param {number} most */
function list(id, heading, items, most) {
  const more = items.length - most;
  return items.length > 0 && section(id, heading,
    el("ul.warnings", items.slice(0, most).map(item => el("li", item)), more > 0 && el("li", `and ${formatCount(more)} more`)));
}

/** Not known is written as 0. @param {Camera} camera */
const projectionSigma = camera => camera.projection_sigma_px || NaN;

/** @param {any} report @param {any} page */
function plots({ cameras }, { solution }) {
  if (!solution) return null;
  const axis = { noun: "camera", names: cameras.map((/** @type {Camera} */ camera) => camera.id) };
  const plot = (/** @type {(camera: Camera) => number} */ value, /** @type {import("./plot_axes.js").PlotText} */ text) => linePlot(axis, cameras.map(value), text);
  return section("plots", "By camera", el("div.plots",
    plot(camera => camera.rms_px, { title: "Reprojection error, px", unit: "px", decimals: 3 }),
    plot(projectionSigma, { title: "Projection uncertainty over the stage, px", unit: "px", decimals: 3 }),
    plot(camera => camera.views, { title: "Views of boards" })));
}

/** One or five times a power of ten that keeps lines of typical residuals visible. @param {any} report @param {any} page */
function magnification({ rms_px }, { solution }) {
  if (!solution) return 1;
  const wanted = 60 / Math.max(1e-3, rms_px), decade = 10 ** Math.floor(Math.log10(wanted));
  return decade * (wanted / decade >= 5 ? 5 : 1);
}

/**
 * Its image in 3 x 3 parts, those without corners shaded; residuals of some corners as lines, or the corners where there is no solution.
 * @param {Camera} camera @param {any} drawn of the page @param {any} solution @param {number} magnified
 */
function imagePanel(camera, { width_px, height_px, corners_px: corners, residuals_px: residuals }, solution, magnified) {
  const scale = PANEL / Math.max(width_px, height_px), width = scale * width_px, height = scale * height_px;
  const shades = camera.coverage.map((/** @type {number} */ count, /** @type {number} */ i) => count === 0 && svg("rect.uncovered",
    { x: f(width / 3 * (i % 3)), y: f(height / 3 * Math.floor(i / 3)), width: f(width / 3), height: f(height / 3) }));
  let path = "";
  for (let i = 0; i < corners.length; i += 2) {
    path += `M${f(scale * corners[i])} ${f(scale * corners[i + 1])}`;
    path += solution ? `l${f(scale * magnified * residuals[i])} ${f(scale * magnified * residuals[i + 1])}` : "h1";
  }
  const picture = svg("svg", { viewBox: `-2 -2 ${(width + 4).toFixed(0)} ${(height + 4).toFixed(0)}`, width: (width + 4).toFixed(0), role: "img", "aria-label": `image of ${camera.id}` },
    svg("rect.edge", { width: f(width), height: f(height) }), shades, svg("path.corners", { d: path, "stroke-width": solution ? 0.8 : 1.4 }));
  return el("figure", picture, el("figcaption", name(camera.id), solution && [" ", el("small", `${formatNumber(camera.rms_px, 3)} px`)]));
}

/** @param {any} report @param {any} page */
function images(report, page) {
  const magnified = magnification(report, page);
  const what = page.solution
    ? `Lines are reprojection errors of some corners, ${formatCount(magnified)} times their length: directions at random are noise, a common `
      + "direction in one region is a lens that is not known there. "
    : "Dots are corners of boards. ";
  return section("coverage", "Corners in each camera", paragraph(`${what}Parts of an image without any corner are shaded.`), el("div.panels",
    report.cameras.map((/** @type {Camera} */ camera, /** @type {number} */ c) => imagePanel(camera, page.cameras[c], page.solution, magnified))));
}

/** Who shares boards with whom, a square per pair of cameras; nothing for many cameras. @param {any} report @param {any} page */
function linkMatrix({ cameras }, page) {
  if (cameras.length > MOST_IN_MATRIX) return null;
  const shared = page.cameras.map((/** @type {any} */ camera) => camera.shared), size = MATRIX / cameras.length;
  const most = Math.max(1, ...shared.flatMap((/** @type {number[]} */ row, /** @type {number} */ a) => row.filter((_, b) => b !== a)));
  const squares = shared.flatMap((/** @type {number[]} */ row, /** @type {number} */ a) => row.map((count, b) => a !== b && count > 0 && svg("rect.shared", {
    x: f(40 + b * size), y: f(a * size), width: f(size - 0.5), height: f(size - 0.5), opacity: (0.15 + 0.85 * count / most).toFixed(2),
  }, svg("title", `${cameras[a].id} and ${cameras[b].id}: ${counted(count, "board", "boards")}`))));
  const labels = size > 9 && cameras.map((/** @type {Camera} */ camera, /** @type {number} */ a) =>
    svg("text.tick", { x: 36, y: f((a + 0.5) * size + 4), "text-anchor": "end" }, shortened(camera.id, 6)));
  return el("figure.plot", el("figcaption", `Boards that two cameras saw at the same moment (at most ${most})`),
    svg("svg", { viewBox: "0 0 524 484", role: "img", "aria-label": "covisibility" }, svg("rect.edge", { x: 40, width: MATRIX, height: MATRIX }), squares, labels));
}

/** Lines between cameras that share boards, the more the darker. @param {any} report @param {any} page @param {RigDrawing} drawn */
function linkLines({ cameras }, page, drawn) {
  const links = page.cameras.flatMap((/** @type {any} */ { shared }, /** @type {number} */ a) =>
    shared.map((/** @type {number} */ count, /** @type {number} */ b) => ({ count, a, b })).filter((/** @type {any} */ link) => link.b > a && link.count > 0));
  links.sort((/** @type {any} */ one, /** @type {any} */ other) => other.count - one.count);
  return links.slice(0, MOST_LINKS).map((/** @type {any} */ { count, a, b }) => {
    const [x1, y1] = drawn.place(page.cameras[a].center_mm), [x2, y2] = drawn.place(page.cameras[b].center_mm);
    return svg("line.link", { x1: f(x1), y1: f(y1), x2: f(x2), y2: f(y2), "stroke-opacity": (0.08 + 0.6 * count / links[0].count).toFixed(2) },
      svg("title", `${cameras[a].id} and ${cameras[b].id}: ${counted(count, "board", "boards")}`));
  });
}

/** @param {any} report @param {any} page @param {import("./rig.js").PaperAxes} axes */
function linkDrawing(report, page, axes) {
  if (!page.solution) return null;
  const { boards_mm: flat, stage_low_mm: low, stage_mm: stage } = page.solution;
  const boards = Array.from({ length: flat.length / 3 }, (_, i) => flat.slice(3 * i, 3 * i + 3));
  const drawn = new RigDrawing(axes, [...page.cameras.map((/** @type {any} */ camera) => camera.center_mm), low,
    low.map((/** @type {number} */ value, /** @type {number} */ i) => value + stage[i])]);
  for (const board of boards) {
    const [x, y] = drawn.place(board);
    drawn.add(svg("circle.range", { cx: f(x), cy: f(y), r: 3 }));
  }
  drawn.add(linkLines(report, page, drawn));
  report.cameras.forEach((/** @type {Camera} */ { id, views }, /** @type {number} */ c) =>
    drawn.addCamera({ id, center_mm: page.cameras[c].center_mm, look: page.cameras[c].look }, "camera", `: ${counted(views, "view", "views")}`, true));
  return drawn.figure();
}

/** What detection found, and what came of it. @param {any} report @param {any} page */
function cameraTable(report, page) {
  const count = (/** @type {any} */ value) => cell(formatCount(value), value);
  const rows = report.cameras.map((/** @type {Camera} */ camera, /** @type {number} */ c) => {
    const { tags, views_used: used } = page.cameras[c];
    return [name(camera.id),
      ...[camera.images, camera.views, camera.shared_views, tags, camera.small_tags, camera.blurred_tags, camera.unclear_tags].map(count),
      ...(page.solution ? [count(used), count(camera.corners), count(camera.rejected_corners), cell(formatNumber(camera.rms_px, 3), camera.rms_px)] : [])];
  });
  const found = ["Images", "Views", "Shared", "Tags used", "Too small", "Blurred", "Unclear"];
  const solved = page.solution ? ["Views used", "Corners", "Rejected", "Reprojection error, px"] : [];
  return section("cameras", "Cameras", paragraph("Views are boards in images; shared ones were seen by another camera at the same moment, used ones are in the "
    + "solution. Tags are left out where they are too small to measure, blurred, or unclear: hidden in part, or without contrast."),
  table(["Camera", ...[...found, ...solved].map(title => ({ title, number: true }))], rows, "cameras"));
}

/** The lenses and how well all is known. @param {any} report @param {any} page */
function sigmas({ cameras }, page) {
  if (!page.solution) return null;
  const number = (/** @type {any} */ value, /** @type {number} */ decimals) => cell(formatNumber(value, decimals), value);
  const rows = cameras.map((/** @type {Camera} */ camera, /** @type {number} */ c) => {
    const { lens, lens_sigmas: sigmas, rotation_sigma_deg: rotation, center_sigma_mm: center } = page.cameras[c];
    const withSigma = (/** @type {number} */ value, /** @type {number} */ i) => {
      const decimals = i === 3 ? 4 : 2;
      return cell(`${formatNumber(value, decimals)}\u00a0±\u00a0${formatNumber(sigmas[i], decimals)}`, value);
    };
    return [name(camera.id), ...lens.map(withSigma), number(rotation, 4), number(center, 3), number(camera.corner_sigma_px, 3), number(projectionSigma(camera), 3)];
  });
  const columns = ["fx, px", "cx, px", "cy, px", "k1", "Rotation, deg", "Centre, mm", "Corner, px", "Projection, px"];
  return section("sigmas", "Lenses and sigmas", table(["Camera", ...columns.map(title => ({ title, number: true }))], rows, "cameras"));
}

/** @param {any} report @param {any} page */
function boards({ warps, bars }, page) {
  if (!page.solution) return null;
  const number = (/** @type {any} */ value, /** @type {number} */ decimals) => cell(formatNumber(value, decimals), value);
  const numeric = (/** @type {string[]} */ titles) => titles.map(title => ({ title, number: true }));
  const rows = warps.map((/** @type {any} */ warp, /** @type {number} */ b) => {
    const board = page.boards[b];
    return [name(board.id), cell(`${board.rows} x ${board.cols}`, board.rows * board.cols), number(board.tag_mm, 3), number(warp.bend_xx_mm, 2),
      number(warp.bend_xy_mm, 2), number(warp.bend_yy_mm, 2), number(100 * warp.stretch, 3)];
  });
  const barRows = bars.map((/** @type {any} */ bar) => [name(bar.id), number(bar.length_mm, 3), number(bar.measured_mm, 3), number(bar.sigma_mm, 3),
    number(100 * (bar.measured_mm / bar.length_mm - 1), 3), cell(formatCount(bar.frames), bar.frames)]);
  return section("boards", "Boards",
    table(["Board", ...numeric(["Tags", "Tag, mm", "Bend along x, mm", "Twist, mm", "Bend along y, mm", "Stretch, %"])], rows, "cameras"),
    bars.length > 0 && [el("h3", "Scale bars"),
      table(["Bar", ...numeric(["Length, mm", "Measured by tag sizes, mm", "Sigma, mm", "Difference, %", "Frames"])], barRows, "cameras")]);
}

definePage("calibration", ({ report, page }) => [
  head(report, page),
  list("warnings", "Why it is refused", report.issues.map((/** @type {any} */ issue) => issue.message), 60),
  list("images", "Images that could not be read", page.unread, 8),
  plots(report, page),
  images(report, page),
  section("covisibility", "Cameras that see the same boards",
    el("div.plots.drawings", linkMatrix(report, page), [FROM_ABOVE, FROM_THE_SIDE].map(axes => linkDrawing(report, page, axes))),
    paragraph("The more boards two cameras share, the darker their square and line. Dots are the boards.")),
  cameraTable(report, page),
  sigmas(report, page),
  boards(report, page),
]);

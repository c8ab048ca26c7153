// @ts-check
// A garment's template as it was built: weft.v1.TemplateSummary, weft.v1.Template without its files, and weft.v1.TemplatePage.
import { cell, definePage, el, name, pageHead, paragraph, section, svg, table } from "./parts.js";
import { counted, formatCount, formatNumber, formatPercent } from "./numbers.js";
import { garmentMap, pictureRow } from "./pictures.js";

/** Two coordinates, one after the other. @typedef {number[]} Flat */

/** @param {number} value */
const f = value => value.toFixed(1);

/** As a path. @param {Flat} flat @param {(x: number, y: number) => number[]} place */
const pathOf = (flat, place) => Array.from({ length: flat.length / 2 }, (_, i) =>
  `${i === 0 ? "M" : "L"}${place(flat[2 * i], flat[2 * i + 1]).map(f).join(" ")}`).join("");

/** The middle of a cell. @param {number} col @param {number} row */
const middle = (col, row) => [col + 0.5, row + 0.5];

/** @param {Flat[]} outlines @param {(x: number, y: number) => number[]} place @param {number} strokeWidth */
const cloth = (outlines, place, strokeWidth) => svg("path.cloth",
  { d: outlines.map(flat => `${pathOf(flat, place)}Z`).join(""), "fill-rule": "evenodd", "stroke-width": strokeWidth.toFixed(2) });

/** @param {number} size @param {Record<string, any>} where @param {any} text */
const label = (size, where, text) => svg("text", { "font-size": f(size), "text-anchor": "middle", "dominant-baseline": "central", ...where }, text);

/** @param {any} page @param {any} template */
function boardPicture({ outlines, seams: drawn }, { panels }) {
  const least = (/** @type {string} */ field) => Math.min(...panels.map((/** @type {any} */ panel) => panel[field]));
  const most = (/** @type {string} */ field) => Math.max(...panels.map((/** @type {any} */ panel) => panel[field]));
  const left = least("first_col"), top = least("first_row"), wide = most("last_col") - left, high = most("last_row") - top;
  const unit = Math.max(wide, high) / 100, margin = 3 * unit;
  const sides = drawn.flatMap((/** @type {any} */ seam, /** @type {number} */ i) => [seam.side_a.cells, seam.side_b.cells].map(flat => ({ flat, i, color: seam.color })));
  const seams = sides.map((/** @type {any} */ { flat, i, color }) => svg("path",
    { d: pathOf(flat, middle), fill: "none", stroke: color, "stroke-width": f(0.9 * unit), "stroke-linejoin": "round" },
    svg("title", `seam ${i + 1}`)));
  const numbers = sides.map((/** @type {any} */ { flat, i, color }) => {
    const at = 2 * Math.floor(flat.length / 4), [x, y] = middle(flat[at], flat[at + 1]), size = 2.6 * unit;
    return label(size, { x: f(x), y: f(y), fill: color, stroke: "#fff", "stroke-width": (size / 6).toFixed(2), "paint-order": "stroke", "font-weight": "bold" }, i + 1);
  });
  const names = panels.map((/** @type {any} */ panel, /** @type {number} */ p) => {
    const width = panel.last_col - panel.first_col, height = panel.last_row - panel.first_row;
    const size = Math.min(Math.max(0.8 * Math.min(width, height), 1.5 * unit), 6 * unit);
    return label(size, { class: "panel", x: f(panel.first_col + width / 2), y: f(panel.first_row + height / 2) }, p + 1);
  });
  const box = [left - margin, top - margin, wide + 1 + 2 * margin, high + 1 + 2 * margin];
  return svg("svg", { viewBox: box.map(f).join(" "), role: "img", "aria-label": "Panels on the board" },
    cloth(outlines.map((/** @type {any} */ outline) => outline.cells), middle, 0.3 * unit), seams, numbers, names);
}

/** The panels as charts, with their cells' rows as they lie on the board. @param {any} page @param {any} template */
function texturePicture({ outlines }, { panels, cell_mm: cellMm, texture_side_mm: side }) {
  const numbers = panels.map((/** @type {any} */ panel, /** @type {number} */ p) => {
    const rows = panel.last_row - panel.first_row + 1, cols = panel.last_col - panel.first_col + 1;
    const [wide, high] = panel.quarter_turns % 2 === 1 ? [rows, cols] : [cols, rows];
    const x = (panel.texture_col + wide / 2) * cellMm, y = (panel.texture_row + high / 2) * cellMm;
    return label(side / 20, { class: "panel", transform: `translate(${f(x)} ${f(y)}) rotate(${90 * panel.quarter_turns})` }, p + 1);
  });
  return svg("svg.texture", { viewBox: `0 0 ${f(side)} ${f(side)}`, role: "img", "aria-label": "Panels in the texture" },
    svg("rect.edge", { width: f(side), height: f(side), "stroke-width": (side / 300).toFixed(2) }),
    cloth(outlines.map((/** @type {any} */ outline) => outline.texture_mm), (x, y) => [x, side - y], side / 500), numbers);
}

/** @param {any} summary @param {any} page @param {any} template */
const texture = (summary, page, template) => [
  paragraph(`The panels as they lie on the board, packed into a square of ${formatNumber(template.texture_side_mm, 0)} mm a side, of which they cover `
    + `${formatPercent(summary.texture_coverage)}. Numbers are upright as on the board.`),
  texturePicture(page, template),
];

/** @param {number} seam @param {string} color */
function swatch(seam, color) {
  const square = el("span", "■");
  square.style.color = color;
  return cell([square, ` ${seam + 1}`], seam);
}

/** @param {any} value @param {number} decimals */
const number = (value, decimals) => cell(formatNumber(value, decimals), value);

/** @param {any} page @param {any} template */
const seamTable = ({ seams: drawn }, { seams }) => table(
  ["Seam", "Panel", "with panel", "Length, mm", "Width, mm", "Widest, mm", "Cells"],
  seams.map((/** @type {any} */ seam, /** @type {number} */ i) => [swatch(i, drawn[i].color), cell(seam.panel_a + 1, seam.panel_a), cell(seam.panel_b + 1, seam.panel_b),
    number(seam.length_mm, 0), number(seam.gap_mm, 1), number(seam.max_gap_mm, 1), `${seam.side_a.length} / ${seam.side_b.length}`]));

/** @param {any[]} openings @param {any[]} closed */
function borderTable(openings, closed) {
  const rows = (/** @type {string} */ kind, /** @type {any[]} */ borders) => borders.map((border, i) => [`${kind} ${i + 1}`, number(border.length_mm, 0),
    border.panels.map((/** @type {number} */ panel) => panel + 1).join(", "), cell(formatCount(border.vertices.length), border.vertices.length)]);
  return table(["Border", "Length, mm", "Along panels", "Vertices"], [...rows("Opening", openings), ...rows("Closed hole", closed)]);
}

/** @param {any} template */
const panelTable = ({ panels }) => table(["Panel", "Cells", "Rows", "Columns"], panels.map((/** @type {any} */ panel, /** @type {number} */ i) =>
  [cell(i + 1, i), cell(formatCount(panel.cells), panel.cells), cell(`${panel.first_row} to ${panel.last_row}`, panel.first_row),
    cell(`${panel.first_col} to ${panel.last_col}`, panel.first_col)]));

/** @param {any} summary @param {any} page */
function head(summary, { seam_faces: seamFaces }) {
  const corners = summary.vertices_with_corner > 0 ? `${formatCount(summary.vertices_with_corner)} of them corners between cells, ` : "";
  return pageHead("Weft template", `Template ${summary.id}`, summary.verdict, paragraph(
    `${formatCount(summary.vertices)} vertices, ${corners}${formatCount(summary.faces)} faces (${formatCount(seamFaces)} of them across seams), `
    + `Euler characteristic ${formatCount(summary.euler)}, ${counted(summary.handles, "handle", "handles")}. Edges are within `
    + `${formatPercent(summary.strain_median)} (median) and ${formatPercent(summary.strain_p95)} (95 of 100) of the print.`));
}

/** @param {any} page @param {any} template */
function inputs(page, template) {
  const clouds = page.clouds.flatMap((/** @type {string} */ path, /** @type {number} */ i) =>
    [i > 0 && ", ", name(path), i === page.reference && " (its pose is the rest state's)"]);
  return [
    paragraph("Board ", name(page.board), `, cells of ${formatNumber(template.cell_mm, 2)} mm (${formatNumber(page.measured_pitch_mm, 2)} mm apart in the clouds). Panels `,
      page.panels ? ["from ", name(page.panels)] : "as the clouds show them",
      `; ${formatCount(page.filled_cells)} of their cells are in no cloud. Left out: ${formatCount(page.contradicting_points)} points that contradict the cloth around them, `
      + `${formatCount(page.speck_cells)} cells in pieces too small for a panel.`),
    paragraph("Clouds: ", clouds),
  ];
}

definePage("template", ({ summary, template, page }) => [
  head(summary, page),
  summary.warnings.length > 0 && section("warnings", "Warnings", el("ul", summary.warnings.map((/** @type {string} */ warning) => el("li", warning)))),
  section("board", "Panels on the board", paragraph(
    "Panels have large numbers. Both sides of a seam have the same small number and colour; grey outlines are open."), boardPicture(page, template)),
  section("garment", "The sewn garment", pictureRow(page.sewn, "the template", "seam", paragraph("Seams coloured as above, openings dark."))),
  section("texture", "Texture", texture(summary, page, template)),
  section("seams", "Seams", seamTable(page, template)),
  section("borders", "Openings and closed holes", borderTable(template.openings, page.closed_holes)),
  section("strain", "Rest state", garmentMap(page.strain)),
  section("panels", "Panels", panelTable(template)),
  section("inputs", "Inputs", inputs(page, template)),
]);

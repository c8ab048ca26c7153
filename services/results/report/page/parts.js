// @ts-check
// What pages are made of. Nodes are built, never parsed, so text from outside stays text.
import { formatCount, numberOf } from "./numbers.js";

/** @typedef {Node | string | number | null | undefined | false} Piece */
/** Lists may hold lists. @typedef {Piece | any[]} Content */
/** What a cell shows, and what tables sort it by. @typedef {{content: Content, value: number | string}} Cell */
/** @typedef {{title: string, number?: boolean}} Column */
/** @typedef {{grade: string, reason: string, remedy: string, checks: any[], others: any[]}} Verdict */

const SVG = "http://www.w3.org/2000/svg";
const CONTROLS = /[\u0000-\u0008\u000b-\u001f\u007f-\u009f]/g;

/** Without characters that no page can show. @param {string | number} text */
export const printable = text => String(text).replace(CONTROLS, "\ufffd");

/** @param {Element} parent @param {any[]} content */
function fill(parent, content) {
  for (const piece of content.flat(Infinity)) {
    if (piece === null || piece === undefined || piece === false || piece === "") continue;
    parent.append(piece instanceof Node ? piece : printable(piece));
  }
  return parent;
}

/** @param {Element} element @param {string[]} classes @param {any[]} rest */
function build(element, classes, rest) {
  for (const one of classes) element.classList.add(one);
  const hasAttributes = rest[0] && Object.getPrototypeOf(rest[0]) === Object.prototype;
  for (const [key, value] of Object.entries(hasAttributes ? rest[0] : {}))
    if (value !== null && value !== undefined && value !== false) element.setAttribute(key, value === true ? "" : printable(value));
  return fill(element, hasAttributes ? rest.slice(1) : rest);
}

/**
 * An element: el("p.reason.good", {id: "x"}, "text", node, [more]). Attributes may be left out.
 * @param {string} what tag and classes
 * @param {...any} rest
 * @returns {HTMLElement}
 */
export function el(what, ...rest) {
  const [tag, ...classes] = what.split(".");
  return /** @type {HTMLElement} */ (build(document.createElement(tag), classes, rest));
}

/** The same for SVG. @param {string} what @param {...any} rest @returns {SVGElement} */
export function svg(what, ...rest) {
  const [tag, ...classes] = what.split(".");
  return /** @type {SVGElement} */ (build(document.createElementNS(SVG, tag), classes, rest));
}

/** A name from outside: isolated, so that right-to-left characters stay its own affair. @param {string} text */
export const name = text => el("bdi", text);

/** A section with its heading; nothing where it has no content. @param {string} id @param {string} heading @param {...Content} content */
export function section(id, heading, ...content) {
  const filled = content.flat(Infinity).filter(piece => piece !== null && piece !== undefined && piece !== false && piece !== "");
  return filled.length > 0 ? el("section", { id }, el("h2", heading), filled) : null;
}

/** @param {...Content} content */
export const paragraph = (...content) => el("p", content);

/** @param {string} label @param {Content} value @param {Content} detail */
export const tile = (label, value, detail) => el("div.tile", el("span", label), el("b", value), el("small", detail));

/** @param {(Node | null | false)[]} all */
export function tiles(all) {
  const shown = all.filter(Boolean);
  return shown.length > 0 ? el("div.tiles", shown) : null;
}

/** Folded away; its content is made when it is opened. @param {string} summary @param {() => Content} content */
export function details(summary, content) {
  const element = el("details", el("summary", summary));
  element.addEventListener("toggle", () => fill(element, [content()]), { once: true });
  return element;
}

/** A cell of a table that sorts by `value`. @param {Content} content @param {any} value @returns {Cell} */
export const cell = (content, value) => ({ content, value: typeof value === "string" && value !== "NaN" ? value : numberOf(value) });

/** @param {any} one @returns {one is Cell} */
const isCell = one => Boolean(one) && typeof one === "object" && Object.getPrototypeOf(one) === Object.prototype;

/** @param {Cell | Content} one @param {HTMLElement} shown */
const sortKey = (one, shown) => (isCell(one) ? one.value : shown.textContent ?? "");

/** Numbers before text; what is no number comes last. @param {number | string} a @param {number | string} b */
function compare(a, b) {
  if (typeof a === "number" && typeof b === "number") return Number.isNaN(a) || Number.isNaN(b) ? Number(Number.isNaN(a)) - Number(Number.isNaN(b)) : a - b;
  return String(a).localeCompare(String(b), "en", { numeric: true });
}

/** Sorts by the column of the heading that is pressed; pressed again, the other way round. @param {HTMLElement} head @param {HTMLElement} body @param {any[]} rows */
function sortable(head, body, rows) {
  head.addEventListener("click", event => {
    const button = /** @type {Element} */ (event.target).closest("button"), th = button?.closest("th");
    if (!th) return;
    const down = th.getAttribute("aria-sort") === "ascending", at = [...head.children].indexOf(th);
    for (const other of head.children) other.removeAttribute("aria-sort");
    th.setAttribute("aria-sort", down ? "descending" : "ascending");
    const keyed = rows.map((row, i) => ({ shown: row.shown, key: sortKey(row.cells[at], row.shown.children[at]), i }));
    keyed.sort((a, b) => (down ? -1 : 1) * compare(a.key, b.key) || a.i - b.i);
    body.append(...keyed.map(row => row.shown));
  });
}

/**
 * A table in a box that scrolls when it is long or wide. Headings sort where there are three rows or more.
 * @param {(string | Column)[]} columns none: without a head
 * @param {(Cell | Content)[][]} cells [rows][columns]
 * @param {string} classes of the table, separated by spaces: "frames"
 */
export function table(columns, cells, classes = "") {
  const titles = columns.map(column => (typeof column === "string" ? { title: column } : column));
  const numeric = titles.map(column => Boolean(/** @type {Column} */ (column).number));
  const rows = cells.map(row => ({
    cells: row, shown: el("tr", row.map((one, i) => el(numeric[i] ? "td.number" : "td", isCell(one) ? one.content : one))),
  }));
  const body = el("tbody", rows.map(row => row.shown));
  const sorts = cells.length > 2 && classes !== "facts" && classes !== "checks";
  const head = el("tr", titles.map(({ title }, i) =>
    el(numeric[i] ? "th.number" : "th", { scope: "col" }, sorts && title ? el("button", { type: "button", title: "Sort" }, title) : title)));
  if (sorts) sortable(head, body, rows);
  const element = el("table", columns.length > 0 && el("thead", head), body);
  if (classes) element.className = classes;
  return el("div.scroll", { tabindex: cells.length > 12 ? 0 : null, role: cells.length > 12 ? "group" : null, "aria-label": cells.length > 12 ? "table" : null }, element);
}

/** A share as a short bar. @param {any} share from 0 to 1 */
export function bar(share) {
  const inner = el("i");
  inner.style.width = `${Math.min(Math.max(100 * (numberOf(share) || 0), 0), 100).toFixed(1)}%`;
  return el("i.bar", inner);
}

const GRADES = /** @type {Record<string, string[]>} */ ({
  GRADE_GOOD: ["good", "✓", "good"], GRADE_USABLE: ["warn", "!", "usable"], GRADE_BAD: ["bad", "✕", "bad"],
});

/** Colour, sign (for those who cannot tell the colours apart) and word. @param {string} grade */
const lookOf = grade => GRADES[grade] ?? GRADES.GRADE_BAD;

/** @param {any} verdict */
export const isGraded = verdict => Boolean(verdict?.grade) && verdict.grade !== "GRADE_UNSPECIFIED";

/** @param {string} grade */
export function badge(grade) {
  const [colour, sign, word] = lookOf(grade);
  return el(`span.grade.${colour}`, `${sign}\u00a0${word}`);
}

/** Without what only typography tells apart. @param {string} text */
const bare = text => text.replace(/\.$/, "").replaceAll("\u00a0", " ");

/** A reason that the headline tells already is left out. @param {string} headline @param {Verdict} verdict */
function reasonAndChecks(headline, verdict) {
  const checks = verdict.checks.map(check => {
    const [colour, sign, word] = lookOf(check.grade);
    return [check.name, el("b", check.value), el(`span.${colour}`, `${sign}\u00a0${word}`), check.limits];
  });
  return [
    bare(headline) !== bare(verdict.reason) && el("p.reason", verdict.reason),
    verdict.remedy && el("p.remedy", el("b", "Remedy:"), " ", verdict.remedy),
    verdict.others.length > 0 && el("ul.others", verdict.others.map(other => el("li", badge(other.grade), " ", other.reason))),
    checks.length > 0 && table([], checks, "checks"),
  ].filter(Boolean);
}

/** Badge and headline, reason, remedy, and values with limits; the headline alone without a verdict. @param {string} headline @param {any} verdict */
export function verdictBlock(headline, verdict) {
  if (!isGraded(verdict)) return [el("p.reason", headline)];
  return [el("p.reason", badge(verdict.grade), " ", headline), ...reasonAndChecks(headline, verdict)];
}

/**
 * The head of a page, verdict first.
 * @param {Content} kind above the headline @param {string} headline @param {any} verdict @param {...Content} more
 */
export function pageHead(kind, headline, verdict, ...more) {
  if (!isGraded(verdict)) return el("header", el("p.kind", kind), el("h1", headline), more);
  const body = reasonAndChecks(headline, verdict);
  return el("header", el("p.kind", kind), el("h1", badge(verdict.grade), " ", headline),
    body.length > 0 && el(`div.verdict.${lookOf(verdict.grade)[0]}`, { id: "verdict" }, body), more);
}

/** Warnings as a list, at most 50 of them. @param {string[]} warnings */
export function warnings(warnings) {
  const shown = warnings.slice(0, 50), more = warnings.length - shown.length;
  return warnings.length > 0 && section("warnings", "Warnings",
    el("ul.warnings", shown.map(warning => el("li", warning)), more > 0 && el("li", `and ${formatCount(more)} more`)));
}

/** @type {Map<string, (data: any) => Content>} */
const pages = new Map();

/** A page file calls this: `show` makes the content of pages of this kind from their data. @param {string} kind @param {(data: any) => Content} show */
export const definePage = (kind, show) => { pages.set(kind, show); };

/** Shows the page of the document. */
export function startPage() {
  const main = /** @type {HTMLElement} */ (document.querySelector("main"));
  const source = /** @type {HTMLElement} */ (document.getElementById("data"));
  try {
    const show = pages.get(source.dataset.kind ?? "");
    if (!show) throw new Error(`there is no page of the kind ${source.dataset.kind}`);
    const content = show(JSON.parse(source.textContent ?? ""));
    main.replaceChildren();
    fill(main, [content]);
  } catch (error) {
    main.replaceChildren(el("p.reason", `This page cannot be shown: ${error}`));
    throw error;
  }
}

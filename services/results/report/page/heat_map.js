// @ts-check
// Many series over one axis in one picture: a row each, colours for values.
import { el, svg } from "./parts.js";
import { formatShort, numberOf, shortened } from "./numbers.js";
import { binName, makeBins, valueText } from "./plot_axes.js";

/** `note`: hover text, after the name. @typedef {{name: string, values: import("./numbers.js").Value[], note: string}} HeatMapRow */
/** Red, green, blue. @typedef {number[]} Color */

const MOST_BINS = 360, WIDTH = 1120, LEFT = 96, RIGHT = 1112, TOP = 26;
const ALL_ROWS = 800, LEAST_ROW = 3, LARGEST_ROW = 18, LABEL_STEP = 13;
const SCALE_SHARE = 0.98;
const MISSING = [196, 26, 34], LOW = [42, 96, 168], MIDDLE = [244, 244, 240], HIGH = [222, 126, 24];

/** From blue over white to orange. @param {number} share from -1 to 1 @returns {Color} */
function diverging(share) {
  const end = share < 0 ? LOW : HIGH, way = Math.min(Math.abs(share), 1);
  return MIDDLE.map((middle, i) => Math.round(middle + (end[i] - middle) * way));
}

/** @param {Color} color */
const css = color => `rgb(${color.join(",")})`;

/** 1, 2 or 5 times a power of ten, at least most of the values. @param {number[][]} rows */
export function heatScale(rows) {
  const sizes = rows.flatMap(row => row.filter(value => Number.isFinite(value) && value !== 0).map(Math.abs)).sort((a, b) => a - b);
  if (sizes.length === 0) return 1;
  const most = sizes[Math.floor(SCALE_SHARE * (sizes.length - 1))], decade = 10 ** Math.floor(Math.log10(most));
  return ([1, 2, 5].find(factor => most <= factor * decade * (1 + 1e-9)) ?? 10) * decade;
}

/** The value that is farthest from 0, and whether one is missing. @param {import("./plot_axes.js").Bin} bin @param {number[]} values */
function cellOf({ begin, end }, values) {
  const all = values.slice(begin, end), finite = all.filter(Number.isFinite);
  return {
    farthest: finite.length > 0 ? finite.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a)) : NaN, lacks: finite.length < all.length,
  };
}

/** A pixel per cell; blank ones are transparent. @param {{farthest: number, lacks: boolean}[][]} cells @param {number} scale @param {boolean} gapsAreFaults */
function image(cells, scale, gapsAreFaults) {
  const canvas = document.createElement("canvas"), width = cells[0].length;
  canvas.width = width, canvas.height = cells.length;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), pixels = context.createImageData(width, cells.length);
  cells.flat().forEach(({ farthest, lacks }, i) => {
    const isFault = lacks && gapsAreFaults;
    if (isFault || Number.isFinite(farthest)) pixels.data.set([...(isFault ? MISSING : diverging(farthest / scale)), 255], 4 * i);
  });
  context.putImageData(pixels, 0, 0);
  return canvas.toDataURL("image/png");
}

/** @param {number} x @param {number} y @param {string} anchor @param {string} text */
const tick = (x, y, anchor, text) => svg("text.tick", { x: x.toFixed(1), y: y.toFixed(1), "text-anchor": anchor }, shortened(text, 16));

/** @param {number} scale @param {string} unit @param {boolean} gapsAreFaults */
function legend(scale, unit, gapsAreFaults) {
  const wide = 180, x = RIGHT - wide, after = unit ? `\u00a0${unit}` : "", steps = 61, number = formatShort(scale);
  const strip = Array.from({ length: steps }, (_, i) => svg("rect",
    { x: (x + wide * i / steps).toFixed(1), y: 2, width: (wide / steps + 0.3).toFixed(1), height: 10, fill: css(diverging(2 * i / (steps - 1) - 1)) }));
  return [
    strip, tick(x - 6, 11, "end", `−${number}${after}`), tick(x + wide, 23, "end", number + after), tick(x + wide / 2, 23, "middle", "0"),
    gapsAreFaults && [svg("rect", { x: LEFT, y: 2, width: 10, height: 10, fill: css(MISSING) }), tick(LEFT + 15, 11, "start", "frame missing")],
  ];
}

/** Reads out the cell that the pointer is over. @param {SVGElement} picture @param {number} rowHeight @param {(row: number, x: number) => string} reading */
function readingOf(picture, rowHeight, reading) {
  const out = el("output.reading");
  picture.addEventListener("pointermove", event => {
    const box = picture.getBoundingClientRect(), unit = WIDTH / box.width;
    const x = ((event.clientX - box.left) * unit - LEFT) / (RIGHT - LEFT), row = Math.floor(((event.clientY - box.top) * unit - TOP) / rowHeight);
    out.textContent = reading(row, x);
  });
  picture.addEventListener("pointerleave", () => { out.textContent = ""; });
  return out;
}

/**
 * Values around 0 from blue over white to orange; the ends of the scale hold all but the highest 2 % of the values. Up to 360 bins of
 * frames, each with the value that is farthest from 0; a bin in which a value is missing is red where gaps are faults. 200 rows fit
 * one screen. Nothing without frames or rows.
 * @param {import("./plot_axes.js").Axis} axis @param {HeatMapRow[]} rows @param {import("./plot_axes.js").PlotText} text @param {boolean} gapsAreFaults
 */
export function heatMap(axis, rows, text, gapsAreFaults) {
  const bins = makeBins(axis.names.length, MOST_BINS), { names } = axis;
  if (bins.length === 0 || rows.length === 0) return null;
  const rowHeight = Math.min(Math.max(ALL_ROWS / rows.length, LEAST_ROW), LARGEST_ROW), height = rowHeight * rows.length, bottom = TOP + height;
  const values = rows.map(row => names.map((_, i) => numberOf(row.values[i]))), scale = heatScale(values);
  const cells = values.map(row => bins.map(bin => cellOf(bin, row)));
  const every = Math.ceil(LABEL_STEP / rowHeight);
  const labels = rows.map((row, r) => [
    r % every === 0 && tick(LEFT - 6, TOP + rowHeight * r + rowHeight / 2 + 4, "end", row.name),
    svg("rect", { x: 0, y: (TOP + rowHeight * r).toFixed(1), width: RIGHT, height: rowHeight.toFixed(1), fill: "transparent" },
      svg("title", row.name + row.note)),
  ]);
  const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${(bottom + 20).toFixed(0)}`, role: "img", "aria-label": text.title },
    legend(scale, text.unit ?? "", gapsAreFaults),
    svg("image", { x: LEFT, y: TOP, width: RIGHT - LEFT, height: height.toFixed(1), preserveAspectRatio: "none", class: "pixels", href: image(cells, scale, gapsAreFaults) }),
    labels, tick(LEFT, bottom + 14, "start", `${axis.noun} ${names[0]}`),
    bins.length > 4 && tick((LEFT + RIGHT) / 2, bottom + 14, "middle", names[names.length >> 1]), tick(RIGHT, bottom + 14, "end", names[names.length - 1]));
  const out = readingOf(picture, rowHeight, (row, x) => {
    const bin = Math.floor(x * bins.length), cell = cells[row]?.[bin];
    if (!cell) return "";
    return `${rows[row].name}, ${binName(bins[bin], axis)}: ${Number.isFinite(cell.farthest) ? valueText(cell.farthest, text) : "none"}`;
  });
  return el("figure.heat", el("figcaption", text.title, " ", out), picture);
}

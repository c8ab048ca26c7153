// @ts-check
// Frame axis, value axis and bins of the plots.
import { el, svg } from "./parts.js";
import { formatCount, formatNumber, formatPercent, numberOf, shortened } from "./numbers.js";

/** What all plots of a page share. @typedef {{names: string[], withoutMesh?: boolean[], noun: string}} Axis */
/**
 * `unit`: "mm", or "%" with values from 0 to 1. `decimals`: of the numbers that the hover shows.
 * `wholePercent`: an axis of percentages ends at 100 %. `firstStyle`: which of the four looks the first overlaid series has.
 * @typedef {{title: string, unit?: string, decimals?: number, fromZero?: boolean, wholePercent?: boolean, firstStyle?: number}} PlotText
 */
/** Consecutive frames that are drawn as one: [begin, end). @typedef {{begin: number, end: number}} Bin */
/** NaN where a bin has no values. @typedef {{mean: number, low: number, high: number}} BinValues */

/** At most `most` bins of equal size (the last may be smaller). @param {number} frames @param {number} most @returns {Bin[]} */
export function makeBins(frames, most) {
  const size = Math.max(1, Math.ceil(frames / most)), bins = [];
  for (let begin = 0; begin < frames; begin += size) bins.push({ begin, end: Math.min(begin + size, frames) });
  return bins;
}

/** @param {Bin} bin @param {import("./numbers.js").Value[]} values @returns {BinValues} */
export function valuesIn(bin, values) {
  const finite = values.slice(bin.begin, bin.end).map(numberOf).filter(Number.isFinite);
  if (finite.length === 0) return { mean: NaN, low: NaN, high: NaN };
  return { mean: finite.reduce((sum, value) => sum + value, 0) / finite.length, low: Math.min(...finite), high: Math.max(...finite) };
}

/** Round numbers from at most `low` to at least `high`, three to seven of them. @param {number} low @param {number} high */
export function roundTicks(low, high) {
  if (!(high > low)) high = low + (low !== 0 ? Math.abs(low) : 1);
  const rough = (high - low) / 4, decade = 10 ** Math.floor(Math.log10(rough));
  const factor = [1, 2, 2.5, 5].find(factor => rough <= factor * decade * (1 + 1e-9)) ?? 10;
  const step = factor * decade, ticks = [];
  const last = Math.ceil(high / step - 1e-9);
  for (let k = Math.floor(low / step + 1e-9); k <= last + 0.5; ++k) ticks.push(k * step);
  return ticks;
}

/** "0.142 mm", "95.2 %". @param {number} value @param {PlotText} text */
export function valueText(value, text) {
  if (text.unit === "%") return formatPercent(value);
  const number = text.decimals ? formatNumber(value, text.decimals) : formatCount(value);
  return text.unit ? `${number}\u00a0${text.unit}` : number;
}

/** One per tick, with as many decimals as they need. @param {number[]} ticks @param {PlotText} text */
export function tickLabels(ticks, text) {
  const isPercent = text.unit === "%", step = (isPercent ? 100 : 1) * (ticks[1] - ticks[0]);
  let decimals = 0;
  for (let s = step; decimals < 6 && Math.abs(s - Math.round(s)) > 1e-6 * s; s *= 10) ++decimals;
  return ticks.map(tick => (isPercent ? `${formatNumber(100 * tick, decimals)}\u00a0%` : formatNumber(tick, decimals)));
}

/** Ticks that hold the values; whole percentages end at 100. @param {BinValues[]} bins @param {PlotText} text */
export function valueTicks(bins, text) {
  const finite = bins.filter(bin => Number.isFinite(bin.mean)), fromZero = text.fromZero ?? true;
  const low = finite.length > 0 ? Math.min(...finite.map(bin => bin.low)) : 0;
  const high = finite.length > 0 ? Math.max(...finite.map(bin => bin.high)) : 1;
  if (text.unit === "%" && (text.wholePercent ?? true))
    return roundTicks(fromZero ? 0 : Math.min(Math.max(Math.floor(10 * low - 0.5) / 10, 0), 0.9), 1);
  return roundTicks(fromZero ? Math.min(0, low) : low, high);
}

/** @param {BinValues[]} values @param {number} bin */
export const hasValue = (values, bin) => Number.isFinite(values[bin]?.mean);

/** Where no line leads to a value, as in measures of a sample of the frames. @param {BinValues[]} values @param {number} bin */
export const isAlone = (values, bin) => hasValue(values, bin) && !hasValue(values, bin + 1) && !hasValue(values, bin - 1);

/** "frame 0012", "frames 0012 to 0019". @param {Bin} bin @param {Axis} axis */
export const binName = ({ begin, end }, { noun, names }) =>
  (end - begin === 1 ? `${noun} ${names[begin]}` : `${noun}s ${names[begin]} to ${names[end - 1]}`);

const WIDTH = 560, HEIGHT = 220, LEFT = 62, RIGHT = 548, TOP = 14;
export const BOTTOM = 186;

/** Where things are in the picture, in its units. */
export class PlotArea {
  /** @param {number} bins @param {number[]} ticks */
  constructor(bins, ticks) {
    this.binWidth = (RIGHT - LEFT) / Math.max(bins, 1);
    this.ticks = ticks;
  }

  /** @param {number} bin */
  x(bin) { return LEFT + (bin + 0.5) * this.binWidth; }

  /** @param {number} value */
  y(value) {
    const share = (value - this.ticks[0]) / (this.ticks[this.ticks.length - 1] - this.ticks[0]);
    return BOTTOM - Math.min(Math.max(share, 0), 1) * (BOTTOM - TOP);
  }

  /** Grid lines with their labels, frame names below. @param {Axis} axis @param {Bin[]} bins @param {string[]} labels */
  axes({ names }, bins, labels) {
    /** @param {number} x @param {string} anchor @param {string} text @param {number} y */
    const tick = (x, anchor, text, y = BOTTOM + 16) => svg("text.tick", { x: x.toFixed(1), y: y.toFixed(1), "text-anchor": anchor }, text);
    const lines = this.ticks.flatMap((value, i) => {
      const y = this.y(value);
      return [svg("line.grid", { x1: LEFT, x2: RIGHT, y1: y.toFixed(1), y2: y.toFixed(1) }), tick(LEFT - 6, "end", labels[i], y + 3.5)];
    });
    if (names.length === 1) return [...lines, tick(this.x(0), "middle", shortened(names[0], 14))];
    if (names.length === 0) return lines;
    const half = bins.length >> 1;
    return [...lines, tick(LEFT, "start", shortened(names[0], 14)),
      bins.length > 4 && tick(this.x(half), "middle", shortened(names[bins[half].begin], 14)),
      tick(RIGHT, "end", shortened(names[names.length - 1], 14))];
  }

  /** The values as path data; it breaks where one is missing. @param {BinValues[]} values */
  path(values) {
    return values.map(({ mean }, b) => (Number.isFinite(mean)
      ? `${hasValue(values, b - 1) ? "L" : "M"}${this.x(b).toFixed(1)} ${this.y(mean).toFixed(1)}` : "")).join("");
  }

  /** Marks on the axis where frames have no mesh. @param {Axis} axis @param {Bin[]} bins */
  lostMarks(axis, bins) {
    return bins.map((bin, b) => lostIn(axis, bin) > 0 && svg("path.lost", { d: `M${this.x(b).toFixed(1)} ${BOTTOM - 7}l4 7h-8z` }));
  }
}

/** @param {Axis} axis @param {Bin} bin */
export const lostIn = ({ withoutMesh }, { begin, end }) => (withoutMesh ?? []).slice(begin, end).filter(Boolean).length;

/** "; no mesh" @param {Axis} axis @param {Bin} bin */
export function lostText(axis, bin) {
  const lost = lostIn(axis, bin);
  if (lost === 0) return "";
  return bin.end - bin.begin === 1 ? "no mesh" : `${lost} without mesh`;
}

/**
 * The figure with its caption. What the pointer is over, or arrow keys come to, is read out beside the title and marked by a line.
 * @param {PlotText} text @param {import("./parts.js").Content} legend @param {any[]} body
 * @param {PlotArea} area @param {string[]} readings one per bin
 */
export function plotFigure(text, legend, body, area, readings) {
  const out = el("output.reading"), line = svg("line.cursor", { y1: TOP, y2: BOTTOM, visibility: "hidden" });
  const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", tabindex: 0, "aria-label": text.title }, line, body);
  let at = -1;
  /** @param {number} bin */
  const show = bin => {
    at = Math.min(Math.max(bin, -1), readings.length - 1);
    out.textContent = readings[at] ?? "";
    line.setAttribute("visibility", at < 0 ? "hidden" : "visible");
    for (const end of ["x1", "x2"]) line.setAttribute(end, area.x(Math.max(at, 0)).toFixed(1));
  };
  picture.addEventListener("pointermove", event => {
    const box = picture.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * WIDTH;
    show(x < LEFT - 8 || x > RIGHT + 8 ? -1 : Math.max(0, Math.floor((x - LEFT) / area.binWidth)));
  });
  picture.addEventListener("pointerleave", () => show(-1));
  picture.addEventListener("blur", () => show(-1));
  picture.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    show(Math.max(at + step, 0));
  });
  return el("figure.plot", el("figcaption", text.title, " ", out), legend, picture);
}

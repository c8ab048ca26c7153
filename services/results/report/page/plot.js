// @ts-check
// Plots over the frames of a job, or over cameras. Colours come from the style sheet.
import { el, svg } from "./parts.js";
import { formatDuration, numberOf, words } from "./numbers.js";
import {
  BOTTOM, PlotArea, binName, hasValue, isAlone, lostText, makeBins, plotFigure, roundTicks, tickLabels, valueText, valueTicks, valuesIn,
} from "./plot_axes.js";

/** @typedef {import("./plot_axes.js").Axis} Axis */
/** @typedef {import("./plot_axes.js").PlotText} PlotText */
/** @typedef {import("./numbers.js").Value} Value */
/** A line or a layer: NaN, or nothing, where a frame has no value. @typedef {{name: string, values: Value[]}} Series */

const MOST_POINTS = 120, MOST_BARS = 100, MOST_LAYERS = 8, MOST_SERIES = 4;

/** @param {number} value @param {number} low @param {number} high */
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** @param {(string | false)[]} parts */
const joined = parts => parts.filter(Boolean).join("; ");

/**
 * One value per frame. Up to 120 frames are points on a line that breaks at missing values. More are binned, each bin with
 * its mean, minimum and maximum, and a point where both neighbours are missing.
 * @param {Axis} axis @param {Value[]} values @param {PlotText} text
 */
export function linePlot(axis, values, text) {
  const bins = makeBins(axis.names.length, MOST_POINTS), inBins = bins.map(bin => valuesIn(bin, values));
  const area = new PlotArea(bins.length, valueTicks(inBins, text)), isSingle = axis.names.length <= MOST_POINTS;
  const radius = clamp(area.binWidth * 0.35, isSingle ? 1.6 : 2.5, 3.5);
  const ranges = isSingle ? [] : inBins.map(({ mean, low, high }, b) => {
    if (!Number.isFinite(mean)) return null;
    const top = area.y(high);
    return svg("rect.range", {
      x: (area.x(b) - area.binWidth / 2).toFixed(2), y: top.toFixed(1), width: area.binWidth.toFixed(2),
      height: Math.max(1.5, area.y(low) - top).toFixed(1),
    });
  });
  const points = inBins.map(({ mean }, b) => (isSingle ? hasValue(inBins, b) : isAlone(inBins, b))
    && svg("circle.point", { cx: area.x(b).toFixed(1), cy: area.y(mean).toFixed(1), r: radius.toFixed(1) }));
  const readings = bins.map((bin, b) => {
    const { mean, low, high } = inBins[b];
    const value = isSingle ? valueText(mean, text) : `mean ${valueText(mean, text)}, ${valueText(low, text)} to ${valueText(high, text)}`;
    return `${binName(bin, axis)}: ${joined([Number.isFinite(mean) && value, lostText(axis, bin)]) || "none"}`;
  });
  const body = [area.axes(axis, bins, tickLabels(area.ticks, text)), ranges, svg("path.line", { d: area.path(inBins) }), points,
    area.lostMarks(axis, bins)];
  return plotFigure(text, null, body, area, readings);
}

/** A bar per value, at most 100 of them. @param {Axis} axis @param {Value[]} values @param {PlotText} text */
export function barPlot(axis, values, text) {
  const bins = makeBins(axis.names.length, MOST_BARS), means = bins.map(bin => valuesIn(bin, values).mean);
  const area = new PlotArea(bins.length, roundTicks(0, Math.max(0, ...means.filter(Number.isFinite)))), width = area.binWidth * 0.8;
  const bars = means.map((mean, b) => Number.isFinite(mean) && svg("rect.f0", {
    x: (area.x(b) - width / 2).toFixed(2), y: area.y(mean).toFixed(2), width: width.toFixed(2), height: (BOTTOM - area.y(mean)).toFixed(2),
  }));
  const readings = bins.map((bin, b) => `${binName(bin, axis)}: ${Number.isFinite(means[b]) ? valueText(means[b], text) : "none"}`);
  return plotFigure(text, null, [area.axes(axis, bins, tickLabels(area.ticks, text)), bars], area, readings);
}

/** Circle, square, triangle, diamond: by its class and, without colours, by its shape. @param {number} style @param {number} x @param {number} y @param {number} r */
function marker(style, x, y, r) {
  const at = `M${x.toFixed(1)} `, f = (/** @type {number} */ value) => value.toFixed(1);
  if (style === 0) return svg("circle.m0", { cx: f(x), cy: f(y), r: f(r) });
  if (style === 1) return svg("rect.m1", { x: f(x - r), y: f(y - r), width: f(2 * r), height: f(2 * r) });
  if (style === 2) return svg("path.m2", { d: `${at}${f(y - 1.2 * r)}l${f(1.2 * r)} ${f(2.1 * r)}h${f(-2.4 * r)}z` });
  const d = f(1.3 * r);
  return svg("path.m3", { d: `${at}${f(y - 1.3 * r)}l${d} ${d}l-${d} ${d}l-${d} -${d}z` });
}

/**
 * Up to four lines over the same frames; more than 120 frames are binned, each bin with its mean. Lines differ in colour (Okabe
 * and Ito 2008, seen by the colour-blind), in dashes and in the shape of their points.
 * @param {Axis} axis @param {Series[]} all @param {PlotText} text
 */
export function overlaidPlot(axis, all, text) {
  const bins = makeBins(axis.names.length, MOST_POINTS), series = all.slice(0, MOST_SERIES);
  const means = series.map(one => bins.map(bin => {
    const { mean } = valuesIn(bin, one.values);
    return { mean, low: mean, high: mean };
  }));
  const area = new PlotArea(bins.length, valueTicks(means.flat(), text)), few = bins.length <= MOST_POINTS / 2;
  const styleOf = (/** @type {number} */ s) => (s + (text.firstStyle ?? 0)) % MOST_SERIES;
  const lines = means.map((values, s) => svg(`path.series.s${styleOf(s)}`, { d: area.path(values) }));
  const radius = clamp(area.binWidth * 0.3, 1.6, 3.4);
  const points = means.map((values, s) => values.map(({ mean }, b) =>
    hasValue(values, b) && marker(styleOf(s), area.x(b), area.y(mean), few || isAlone(values, b) ? radius : 1.1)));
  const readings = bins.map((bin, b) => `${binName(bin, axis)}: ${joined([
    ...series.map((one, s) => hasValue(means[s], b) && `${one.name} ${valueText(means[s][b].mean, text)}`), lostText(axis, bin)]) || "none"}`);
  const legend = el("ul.legend", series.map((one, s) => el("li",
    svg("svg.sample", { viewBox: "0 0 28 10", "aria-hidden": "true" },
      svg(`path.series.s${styleOf(s)}`, { d: "M1 5h26" }), marker(styleOf(s), 14, 5, 3.2)), one.name)));
  const body = [area.axes(axis, bins, tickLabels(area.ticks, text)), lines, points, area.lostMarks(axis, bins)];
  return plotFigure(text, legend, body, area, readings);
}

/** Layers beyond the seventh become one named "other". @param {Series[]} layers @returns {Series[]} */
export function foldedLayers(layers) {
  if (layers.length <= MOST_LAYERS) return layers;
  const others = layers.slice(MOST_LAYERS - 1);
  const sums = layers[0].values.map((_, i) => others.reduce((sum, { values }) => sum + (Number.isFinite(numberOf(values[i])) ? numberOf(values[i]) : 0), 0));
  return [...layers.slice(0, MOST_LAYERS - 1), { name: "other", values: sums }];
}

/** Durations need a unit that fits them all. @param {number} highest in ms @returns {[number, string]} */
const timeUnit = highest => (highest > 180_000 ? [60_000, "min"] : highest > 1500 ? [1000, "s"] : [1, "ms"]);

/**
 * The layers on top of each other, a bar per frame, or per bin of frames with their mean. Values are milliseconds and shown as durations.
 * @param {Axis} axis @param {Series[]} all @param {PlotText} text
 */
export function stackedPlot(axis, all, text) {
  const layers = foldedLayers(all), bins = makeBins(axis.names.length, MOST_BARS);
  const means = layers.map(layer => bins.map(bin => Math.max(0, valuesIn(bin, layer.values).mean || 0)));
  const totals = bins.map((_, b) => means.reduce((sum, layer) => sum + layer[b], 0));
  const highest = Math.max(0, ...totals), [ms, unit] = timeUnit(highest);
  const area = new PlotArea(bins.length, roundTicks(0, highest / ms));
  const width = Math.min(area.binWidth * (bins.length > 60 ? 1 : 0.72), 60);
  const below = bins.map(() => 0);
  const bars = means.flatMap((layer, l) => layer.map((mean, b) => {
    const bottom = area.y(below[b] / ms), top = area.y((below[b] += mean) / ms);
    return mean > 0 && svg(`rect.f${l}`, {
      x: (area.x(b) - width / 2).toFixed(2), y: top.toFixed(2), width: width.toFixed(2), height: (bottom - top).toFixed(2),
    });
  }));
  const readings = bins.map((bin, b) => `${binName(bin, axis)}: ${joined([`${formatDuration(totals[b])} in all`,
    ...layers.map((layer, l) => means[l][b] > 0 && `${words(layer.name)} ${formatDuration(means[l][b])}`), lostText(axis, bin)])}`);
  const labels = tickLabels(area.ticks, { title: "" }).map(label => `${label}\u00a0${unit}`);
  const legend = el("ul.legend", layers.map((layer, l) => el("li", el(`i.f${l}`), words(layer.name))));
  return plotFigure(text, legend, [area.axes(axis, bins, labels), bars, area.lostMarks(axis, bins)], area, readings);
}

// @ts-check
// How well the cameras of a take kept together: weft.v1.SyncPage.
import { cell, definePage, el, name, pageHead, paragraph, section, table } from "./parts.js";
import { counted, formatCount, formatNumber, numberOf } from "./numbers.js";
import { heatMap } from "./heat_map.js";
import { linePlot } from "./plot.js";

const PLOTTED_ALONE = 6;  // cameras

/** @typedef {{camera: string, values: number[], farthest: number}} Series */
/** @typedef {{what: string, unit: string, gapsAreFaults: boolean, sets?: string[]}} Plotted */

/** -1 where there is no value. @param {number[]} values */
const farthestOf = values => values.reduce((most, value) => (Number.isFinite(value) ? Math.max(most, Math.abs(value)) : most), -1);

/** @param {string[]} lines */
const list = lines => lines.length > 0 && el("ul", lines.map(line => el("li", line)));

/** All cameras in one picture, and a plot each of those that stray farthest. @param {Series[]} all @param {Plotted} of */
function plots(all, { what, unit, gapsAreFaults, sets }) {
  const known = all.filter(series => series.farthest >= 0);
  if (known.length === 0) return null;
  const readings = (/** @type {number} */ count) => ({ noun: "reading", names: Array.from({ length: count }, (_, i) => String(i)) });
  const axisOf = (/** @type {number} */ count) => (sets ? { noun: "set", names: sets } : readings(count));
  const longest = axisOf(Math.max(...all.map(series => series.values.length)));
  const rows = all.map(({ camera, values, farthest }) => {
    const lacking = values.filter(value => !Number.isFinite(value)).length;
    const most = farthest >= 0 ? `: at most ${farthest.toFixed(3)} ${unit} from 0` : "";
    return { name: camera, values, note: most + (sets && lacking > 0 ? `, ${counted(lacking, "frame", "frames")} missing` : "") };
  });
  const order = known.length > PLOTTED_ALONE ? [...known].sort((a, b) => b.farthest - a.farthest).slice(0, PLOTTED_ALONE) : known;
  return [
    all.length > 1 && heatMap(longest, rows, { title: `${what}, all cameras`, unit, decimals: 4 }, gapsAreFaults),
    el("div.plots", order.map(({ camera, values }) =>
      linePlot(axisOf(values.length), values, { title: `${what}, camera ${camera}`, unit, decimals: 4, fromZero: false }))),
  ];
}

/** @param {any} report */
function cameraTable({ timing, clocks }) {
  const rows = timing.map((/** @type {any} */ of, /** @type {number} */ i) => {
    const clock = clocks[i], hasPtp = clock.ptp_states.length > 0;
    // What a camera has not is no 0.
    const number = (/** @type {any} */ value, /** @type {number} */ decimals, isKnown = true) =>
      cell(formatNumber(isKnown ? value : NaN, decimals), isKnown ? value : NaN);
    return [name(of.camera), cell(formatCount(of.frames), of.frames), cell(formatCount(of.missing), of.missing), number(of.offset_mean_ms, 4),
      number(of.offset_jitter_ms, 4), number(of.offset_worst_ms, 4), number(clock.drift_ppm, 2, clock.readings > 1),
      cell(formatCount(clock.jumps), clock.jumps), number(clock.ptp_offset_rms_us, 3, hasPtp), number(clock.ptp_offset_worst_us, 3, hasPtp),
      hasPtp ? clock.ptp_states.join(", ") : "-"];
  });
  const columns = ["frames", "missing", "offset ms", "jitter ms", "worst ms", "drift ppm", "jumps", "PTP rms µs", "PTP worst µs"];
  return rows.length > 0 && table(["camera", ...columns.map(title => ({ title, number: true })), "PTP"], rows);
}

definePage("sync", ({ report, page: { set_names: sets, series, causes } }) => {
  /** @param {string} values @returns {Series[]} */
  const seriesOf = values => series.map((/** @type {any} */ one) => {
    const numbers = one[values].map(numberOf);
    return { camera: one.camera, values: numbers, farthest: farthestOf(numbers) };
  });
  const sync = report.take.sync ? `${report.take.sync}. ` : "";
  return [
    pageHead(["Weft sync of take ", name(report.take.id)], report.verdict.reason, report.verdict, paragraph(
      `${sync}${formatCount(report.sets_complete)} of ${counted(report.sets, "frame set", "frame sets")} complete, `
      + `${formatCount(report.sets_dropped)} dropped. Between the cameras of a set: ${formatNumber(report.spread_median_ms, 4)} ms in the median, `
      + `${formatNumber(report.spread_worst_ms, 4)} ms at worst.`)),
    section("findings", "Findings", list(report.findings)),
    section("offsets", "Offset from the other cameras", plots(seriesOf("offset_ms"), { what: "Offset", unit: "ms", gapsAreFaults: true, sets })),
    section("missing", "Missing frames", list(causes)),
    section("cameras", "Cameras", cameraTable(report)),
    section("clocks", "Clock against the host", plots(seriesOf("clock_ms"), { what: "Since the first reading", unit: "ms", gapsAreFaults: false })),
    section("ptp", "Offset from the PTP master", plots(seriesOf("ptp_us"), { what: "PTP offset", unit: "us", gapsAreFaults: false })),
    section("events", "Events", list(report.notes)),
  ];
});

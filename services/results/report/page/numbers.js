// @ts-check
// Numbers as pages show them. Protobuf's JSON has 64-bit numbers and what is no number as text, so all formats take text, too.

export const DASH = "–";
const MINUS = "−", SPACE = "\u00a0";

/** @typedef {number | string | null | undefined} Value */

/** What is missing is no number. @param {Value} value */
export const numberOf = value => (value === null || value === undefined || value === "" ? NaN : Number(value));

/** Digits in threes: "1,234,567". @param {string} digits */
const grouped = digits => digits.replace(/\B(?=(\d{3})+$)/g, ",");

/** "12,345". @param {Value} value */
export function formatCount(value) {
  const count = Math.round(numberOf(value));
  if (!Number.isFinite(count)) return DASH;
  return (count < 0 ? MINUS : "") + grouped(BigInt(Math.abs(count)).toString());
}

/** "0.14", "1,204.5". @param {Value} value @param {number} decimals */
export function formatNumber(value, decimals) {
  const number = numberOf(value);
  if (!Number.isFinite(number)) return DASH;
  const [whole, part] = Math.abs(number).toFixed(decimals).split(".");
  const isZero = !/[1-9]/.test(whole + (part ?? ""));
  return (number < 0 && !isZero ? MINUS : "") + grouped(whole) + (part ? "." + part : "");
}

/** 0.952: "95.2 %". @param {Value} share */
export function formatPercent(share) {
  let percent = 100 * numberOf(share);
  if (!Number.isFinite(percent)) return DASH;
  // 99.97 % must not read as 100 %.
  if (percent < 100 && percent > 99.9) percent = 99.9;
  return percent.toFixed(1).replace("-", MINUS) + SPACE + "%";
}

/** "340 ms", "2.31 s", "4 min 10 s", "3 h 5 min". @param {Value} value */
export function formatDuration(value) {
  const ms = numberOf(value), s = ms / 1000;
  if (!(ms >= 0) || s > 1e12) return DASH;
  if (ms < 9.95) return ms.toFixed(1) + SPACE + "ms";
  if (ms < 999.5) return ms.toFixed(0) + SPACE + "ms";
  if (s < 9.995) return s.toFixed(2) + SPACE + "s";
  if (s < 99.95) return s.toFixed(1) + SPACE + "s";
  const seconds = Math.round(s), minutes = Math.floor(seconds / 60);
  if (minutes < 60) return `${minutes}${SPACE}min${SPACE}${seconds % 60}${SPACE}s`;
  return `${Math.floor(minutes / 60)}${SPACE}h${SPACE}${minutes % 60}${SPACE}min`;
}

/** "2026-11-21 10:44:03 UTC"; a dash for 0. @param {Value} unixNs */
export function formatUnixTime(unixNs) {
  const ms = Number(BigInt(unixNs || 0) / 1000000n);
  return ms > 0 ? new Date(ms).toISOString().slice(0, 19).replace("T", " ") + " UTC" : DASH;
}

/** Six digits, without zeros at the end: "0.5", "12". @param {Value} value */
export const formatShort = value => (Number.isFinite(numberOf(value)) ? String(Number(numberOf(value).toPrecision(6))).replace("-", MINUS) : DASH);

/** "1 frame", "12 frames". @param {Value} count @param {string} singular @param {string} plural */
export const counted = (count, singular, plural) => `${formatCount(count)} ${numberOf(count) === 1 ? singular : plural}`;

/** "too_few_views" as "too few views". @param {string} identifier */
export const words = identifier => identifier.replaceAll("_", " ");

/** At most `characters` of the text, with an ellipsis where it was cut. @param {string} text @param {number} characters */
export function shortened(text, characters) {
  const all = [...text];
  return all.length > characters ? all.slice(0, characters).join("") + "…" : text;
}

/** NaN where there are no finite values. @param {Value[]} values */
export function medianOf(values) {
  const sorted = values.map(numberOf).filter(Number.isFinite).sort((a, b) => a - b), half = sorted.length >> 1;
  if (sorted.length === 0) return NaN;
  return sorted.length % 2 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

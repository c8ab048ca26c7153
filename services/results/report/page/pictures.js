// @ts-check
// Pictures of meshes, with what their colours mean.
import { el, section } from "./parts.js";
import { formatShort } from "./numbers.js";

/** v1.PagePicture: `bytes` are base64. @typedef {{title: string, bytes: string, type: string, width_px: number, height_px: number}} Picture */
/** v1.PageScale. @typedef {{low: number, high: number, label: string, unit: string, bounded: boolean, colors: string[]}} Scale */
/** v1.PageKey: colours with their meanings, or a scale. @typedef {{entries: {color: string, meaning: string}[], scale?: Scale}} Key */

/** "label 0 mm [colours] 0.5 mm and more". @param {Scale} scale */
export function colorBar({ low, high, label, unit, bounded, colors }) {
  const after = unit ? ` ${unit}` : "", around = low < 0;
  const least = `${formatShort(low)}${after}${around && !bounded ? " and less" : ""}`;
  const most = `${around ? "+" : ""}${formatShort(high)}${after}${bounded ? "" : " and more"}`;
  const strip = el("i");
  strip.style.background = `linear-gradient(90deg,${colors.join(",")})`;
  return el("p.colorbar", el("span", `${label} ${least}`), strip, el("span", most));
}

/** @param {Key | undefined} key */
export function legendOf(key) {
  if (!key) return null;
  if (key.scale) return colorBar(key.scale);
  return el("ul.legend", key.entries.map(({ color, meaning }) => {
    const swatch = el("i");
    swatch.style.background = color;
    return el("li", swatch, meaning);
  }));
}

/** @param {Picture} picture */
export const dataUri = ({ type, bytes }) => `data:${type};base64,${bytes}`;

/** @param {Picture} picture @param {string} what for those who cannot see it */
export const pictureFigure = (picture, what) => el("figure",
  el("img", { width: picture.width_px, height: picture.height_px, alt: what, src: dataUri(picture) }), el("figcaption", picture.title));

/**
 * Pictures side by side under their legend; nothing without pictures.
 * @param {Picture[]} pictures @param {string} whatOf "frame 0001" @param {string} coloring may be empty @param {import("./parts.js").Content} legend
 */
export function pictureRow(pictures, whatOf, coloring, legend) {
  if (pictures.length === 0) return null;
  const by = coloring ? `, coloured by ${coloring}` : "";
  return el("div.pair", legend, el("div.pictures", pictures.map(one => pictureFigure(one, `${one.title} of ${whatOf}${by}`))));
}

/** v1.PageMap: values painted on both sides of the garment. @param {{title: string, pictures: Picture[], key: Key}} map */
export const garmentMap = map => el("div", el("h3", map.title), pictureRow(map.pictures, "the garment", map.title, legendOf(map.key)));

/**
 * Maps on the garment (v1.PageMaps), and why others have no picture; nothing without either.
 * @param {string} heading @param {{maps: any[], problems: string[]}} all @param {...any} below
 */
export const mapSection = (heading, { maps, problems }, ...below) => (maps.length + problems.length > 0
  ? section("maps", heading, el("div.meshes", maps.map(garmentMap), problems.map(problem => el("p", problem))), below) : null);

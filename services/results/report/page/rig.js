// @ts-check
// A rig seen along an axis of the world: cameras with their names, a scale bar.
import { el, svg } from "./parts.js";
import { counted, formatShort, shortened } from "./numbers.js";

/** @typedef {number[]} Point three coordinates in mm */
/** `look`: unit vector along which the camera looks. @typedef {{id: string, center_mm: Point, look: Point}} RigCamera */
/** Which world axes run to the right and down the paper. @typedef {{title: string, right: number, down: number}} PaperAxes */
/** @typedef {{left: number, top: number, right: number, bottom: number}} Box */

/** @type {PaperAxes} */
export const FROM_ABOVE = { title: "From above (x to the right, z down the page)", right: 0, down: 2 };
/** @type {PaperAxes} */
export const FROM_THE_SIDE = { title: "From the side (z to the right, y down)", right: 2, down: 1 };

const SIZE = 500, MARGIN = 30, SYMBOL = 12, FOOT = 22; // room for the scale bar
const LETTER = 5.2, LINE = 9; // of names, 9 px high
const LONGEST_NAME = 12;

/** @param {Box} a @param {Box} b */
const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

/** A round length: 1, 2 or 5 times a power of ten. @param {number} mm */
export function roundLength(mm) {
  const decade = 10 ** Math.floor(Math.log10(Math.max(mm, 1e-6)));
  return ([5, 2].find(factor => mm >= factor * decade) ?? 1) * decade;
}

/** @param {number} mm */
const lengthText = mm => (mm >= 1000 ? `${formatShort(mm / 1000)}\u00a0m` : `${formatShort(mm)}\u00a0mm`);

/** Draws in the order of the calls. Everything that is to be drawn must be among `held`, so that it fits. */
export class RigDrawing {
  /** @param {PaperAxes} axes @param {Point[]} held */
  constructor(axes, held) {
    this.axes = axes;
    const places = held.filter(point => point.every(Number.isFinite)).map(point => this.onPaper(point));
    this.low = [0, 1].map(i => Math.min(...places.map(place => place[i])));
    const high = [0, 1].map(i => Math.max(...places.map(place => place[i])));
    const extent = [0, 1].map(i => (places.length > 0 ? high[i] - this.low[i] : 0));
    this.scale = SIZE / Math.max(1, ...extent);
    this.size = [extent[0] * this.scale + 2 * MARGIN, extent[1] * this.scale + 2 * MARGIN + FOOT];
    /** @type {any[]} */
    this.body = [];
    /** @type {{at: number[], look: number[], id: string}[]} */
    this.cameras = [];
  }

  /** @param {Point} point */
  onPaper(point) { return [point[this.axes.right], point[this.axes.down]]; }

  /** Where a point comes to lie, in the picture's units. @param {Point} point */
  place(point) { return this.onPaper(point).map((value, i) => (value - this.low[i]) * this.scale + MARGIN); }

  /** SVG to be drawn below the names: links, points. @param {...any} nodes */
  add(...nodes) { this.body.push(nodes); }

  /**
   * A wedge that opens to where the camera looks. Named cameras bear their name where there is room for it.
   * @param {RigCamera} camera @param {string} cssClass @param {string} more follows the name in the hover text @param {boolean} isNamed
   */
  addCamera({ id, center_mm, look }, cssClass, more, isNamed) {
    const at = this.place(center_mm), way = this.onPaper(look).map(value => SYMBOL * value), side = [-0.45 * way[1], 0.45 * way[0]];
    const corner = (/** @type {number} */ sign) => [0, 1].map(i => (at[i] + way[i] + sign * side[i]).toFixed(1)).join(" ");
    this.add(svg(`path.${cssClass}`, { d: `M${at[0].toFixed(1)} ${at[1].toFixed(1)}L${corner(1)}L${corner(-1)}Z` }, svg("title", id, more)));
    if (isNamed) this.cameras.push({ at, look: way, id });
  }

  /** Behind the camera first, then around it, then farther away; undefined without room. @param {{at: number[], look: number[]}} camera @param {number} width @param {Box[]} taken */
  roomFor({ at, look }, width, taken) {
    const length = Math.hypot(...look), behind = length > 1 ? look.map(value => -value / length) : [0, -1];
    for (let attempt = 0; attempt < 24; ++attempt) {
      const turn = (attempt % 2 === 0 ? 1 : -1) * (((attempt % 8) + 1) >> 1) * Math.PI / 4, away = 9 + 7 * (attempt >> 3);
      const way = [Math.cos(turn) * behind[0] - Math.sin(turn) * behind[1], Math.sin(turn) * behind[0] + Math.cos(turn) * behind[1]];
      const middle = [at[0] + way[0] * (away + width / 2), at[1] + way[1] * away];
      const box = { left: middle[0] - width / 2, top: middle[1] - LINE / 2, right: middle[0] + width / 2, bottom: middle[1] + LINE / 2 };
      const fits = box.left >= 0 && box.top >= 0 && box.right <= this.size[0] && box.bottom <= this.size[1] - FOOT;
      if (fits && !taken.some(other => overlap(box, other))) return { box, middle };
    }
    return undefined;
  }

  /** The figure; names that found no room are counted in the caption. */
  figure() {
    const taken = this.cameras.map(({ at, look }) => {
      const x = at[0] + look[0] / 2, y = at[1] + look[1] / 2;
      return { left: x - 4, top: y - 4, right: x + 4, bottom: y + 4 };
    });
    let withoutRoom = 0;
    const names = this.cameras.map(camera => {
      const name = shortened(camera.id, LONGEST_NAME), room = this.roomFor(camera, LETTER * [...name].length, taken);
      if (!room) return void ++withoutRoom;
      taken.push(room.box);
      return svg("text.names", { x: room.middle[0].toFixed(1), y: (room.middle[1] + 3).toFixed(1), "text-anchor": "middle" }, name);
    });
    const length = roundLength(0.3 * SIZE / this.scale), bar = length * this.scale, y = this.size[1] - 10;
    const { title } = this.axes;
    const caption = withoutRoom > 0 ? `${title}; ${counted(withoutRoom, "camera", "cameras")} without room for a name` : title;
    return el("figure.plot", el("figcaption", caption),
      svg("svg", { viewBox: `0 0 ${this.size[0].toFixed(0)} ${this.size[1].toFixed(0)}`, role: "img", "aria-label": title }, this.body, names,
        svg("path.bar-line", { d: `M${MARGIN} ${y - 3}v6m0-3h${bar.toFixed(1)}m0-3v6` }),
        svg("text.tick", { x: MARGIN + bar + 6, y: y + 4 }, lengthText(length))));
  }
}

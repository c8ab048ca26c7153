/** What the vertices' colours tell. */
export const COLORINGS = ["state", "sigma", "cameras", "coverage", "difference", "cloth"] as const;
export type Coloring = (typeof COLORINGS)[number];

type Rgb = [number, number, number];

/** By VertexState; those of the reports (services/results/report/mesh_colors.h), which the colour-blind tell apart. */
export const STATE_COLORS: Rgb[] = [
  [230, 158, 0],
  [87, 181, 232],
  [0, 158, 115],
  [140, 64, 128],
  [240, 227, 66],
];
export const STATE_NAMES = ["inferred", "seen by three cameras or more", "seen by two cameras", "bridged", "driven"];
export const CLOTH_COLOR: Rgb = [204, 201, 194];

function srgb(linear: number): number {
  const c = Math.min(1, Math.max(0, linear));
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
}

/** Dark blue over green to light yellow with evenly rising lightness, as MapColor of the reports. */
function mapColor(t: number): Rgb {
  const hue = ((285 - 180 * t) * Math.PI) / 180;
  const chroma = 0.092 + 0.065 * t ** 3;
  const [light, a, b] = [0.36 + 0.55 * t, chroma * Math.cos(hue), chroma * Math.sin(hue)];
  const l = (light + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (light - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (light - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    srgb(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    srgb(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    srgb(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

const PALETTE_COLORS = 256;

/** RGBA of the colours from low to high. */
export function palette(): Uint8ClampedArray<ArrayBuffer> {
  const bytes = new Uint8ClampedArray(4 * PALETTE_COLORS);
  for (let i = 0; i < PALETTE_COLORS; ++i) bytes.set([...mapColor(i / (PALETTE_COLORS - 1)), 255], 4 * i);
  return bytes;
}

/** A round number that all but 2 % of the values do not exceed; 1 where there is none. */
export function roundRange(values: number[]): number {
  const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
  const most = sorted[Math.ceil(0.98 * (sorted.length - 1))] ?? 0;
  if (most <= 0) return 1;
  const decade = 10 ** Math.floor(Math.log10(most));
  const round = decade * ([1, 1.5, 2, 3, 4, 5, 6, 8].find((step) => most <= step * decade * 1.000001) ?? 10);
  return Number(round.toPrecision(3));
}

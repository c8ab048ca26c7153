import { useEffect, useRef } from "preact/hooks";

export const BINS = 64;
const MOST_PX = 400_000; // that are counted; larger pictures are sampled

/** Shares of the picture's values in BINS bins of equal width, of the brightest of its three channels. */
export function histogramOf(pixels: Uint8ClampedArray): number[] {
  const counts = new Array<number>(BINS).fill(0);
  const step = 4 * Math.max(1, Math.floor(pixels.length / 4 / MOST_PX));
  let total = 0;
  for (let i = 0; i + 2 < pixels.length; i += step) {
    const value = Math.max(pixels[i]!, pixels[i + 1]!, pixels[i + 2]!);
    counts[value >> 2]! += 1;
    total += 1;
  }
  return counts.map((count) => count / Math.max(1, total));
}

export function Histogram({ bins }: { bins: number[] }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!canvas.current || !context) return;
    const { width, height } = canvas.current;
    const styles = getComputedStyle(canvas.current);
    context.clearRect(0, 0, width, height);
    // The outermost bins, which clipped and black pixels fill, hide nothing of the others.
    const most = Math.max(0.001, ...bins.slice(1, -1));
    bins.forEach((share, i) => {
      const tall = Math.min(1, share / most) * height;
      context.fillStyle = styles.getPropertyValue(i === BINS - 1 && share > 0.002 ? "--bad" : "--dim");
      context.fillRect((i * width) / BINS, height - tall, width / BINS - 0.5, tall);
    });
  }, [bins]);
  return <canvas class="histogram" ref={canvas} width={256} height={40} role="img" aria-label="Histogram, dark to bright" />;
}

const NS_PER_MS = 1_000_000n;

/** Of nanoseconds since 1970; "" for 0. */
export function timeText(unix_ns: bigint): string {
  if (unix_ns === 0n) return "";
  const date = new Date(Number(unix_ns / NS_PER_MS));
  const isToday = date.toDateString() === new Date().toDateString();
  const time = date.toLocaleTimeString("en-GB");
  return isToday ? time : `${date.toLocaleDateString("en-CA")} ${time}`;
}

/** Seconds between two times in ns. */
export function secondsBetween(from_ns: bigint, to_ns: bigint): number {
  return Number((to_ns - from_ns) / NS_PER_MS) / 1000;
}

export function durationText(seconds: number): string {
  if (seconds < 0.1) return `${(1000 * seconds).toFixed(seconds < 0.001 ? 1 : 0)} ms`;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 90 * 60) return `${Math.round(seconds / 60)} min`;
  if (seconds < 48 * 3600) return `${(seconds / 3600).toFixed(1)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

/** "1:07", "1:02:09": what a clock shows that counts a take. */
export function clockText(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const two = (n: number) => String(n).padStart(2, "0");
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h > 0 ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)}`;
}

export function bytesText(bytes: number | bigint): string {
  let value = Number(bytes);
  const units = ["B", "kB", "MB", "GB", "TB"];
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) {
    value /= 1000;
    ++unit;
  }
  return `${value >= 100 || unit === 0 ? value.toFixed(0) : value.toPrecision(3)} ${units[unit]}`;
}

export function countText(count: number | bigint): string {
  return count.toLocaleString("en-US");
}

export function percentText(share: number): string {
  const percent = 100 * share;
  return `${percent >= 99.95 || percent === 0 ? percent.toFixed(0) : percent.toFixed(1)} %`;
}

/** "1 frame", "3 frames"; "2 vertices" where the plural is given. */
export function countOf(count: number | bigint, noun: string, nouns = `${noun}s`): string {
  return `${countText(count)} ${Number(count) === 1 ? noun : nouns}`;
}

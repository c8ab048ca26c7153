import { signal } from "@preact/signals";

const KEY = "weft.muted";
export const isMuted = signal(localStorage.getItem(KEY) === "yes");
/** How many alarms were sounded or would have been, were it not muted. */
export const alarms = signal(0);
let audio: AudioContext | undefined;

export function switchSound(): void {
  isMuted.value = !isMuted.value;
  localStorage.setItem(KEY, isMuted.value ? "yes" : "no");
}

/** Browsers play sounds only of pages that were used: called by what a person did. */
export function allowSound(): void {
  audio ??= new AudioContext();
  void audio.resume();
}

function beep(hz: number, seconds: number, after_s = 0): void {
  if (isMuted.value || !audio) return;
  const tone = audio.createOscillator();
  const volume = audio.createGain();
  const begin = audio.currentTime + after_s;
  tone.frequency.value = hz;
  volume.gain.setValueAtTime(0.25, begin);
  volume.gain.exponentialRampToValueAtTime(0.001, begin + seconds);
  tone.connect(volume).connect(audio.destination);
  tone.start(begin);
  tone.stop(begin + seconds);
}

/** A frame was lost. */
export function soundAlarm(): void {
  alarms.value += 1;
  beep(880, 0.18);
  beep(587, 0.3, 0.2);
}

export function soundTick(isLast: boolean): void {
  beep(isLast ? 1320 : 660, 0.12);
}

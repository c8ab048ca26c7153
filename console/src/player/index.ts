import { h, render } from "preact";
import type { Client } from "../api/client";
import { LiveView } from "./live_view";
import "./player.css";
import { PlayerView } from "./player_view";

/** Shows a job's sequence in `element`; returns what ends that and frees its memory. */
export function mountPlayer(element: HTMLElement, client: Client, jobId: string): () => void {
  render(h(PlayerView, { client, jobId }), element);
  return () => render(null, element);
}

/** As mountPlayer, but the newest mesh of a job that runs, small. */
export function mountLive(element: HTMLElement, client: Client, jobId: string): () => void {
  render(h(LiveView, { client, jobId }), element);
  return () => render(null, element);
}

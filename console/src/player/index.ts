import { h, render } from "preact";
import type { ComponentType } from "preact";
import type { Client } from "../api/client";
import { GarmentView } from "./garment_view";
import { LiveView } from "./live_view";
import "./player.css";
import { PlayerView } from "./player_view";
import { RigView } from "./rig_view";
import { TemplateView } from "./template_view";

function mount<P extends object>(element: HTMLElement, view: ComponentType<P>, properties: P): () => void {
  render(h(view, properties), element);
  return () => render(null, element);
}

/** Shows a job's sequence in `element`; returns what ends that and frees its memory. */
export function mountPlayer(element: HTMLElement, client: Client, jobId: string): () => void {
  return mount(element, PlayerView, { client, jobId });
}

/** As mountPlayer, but the newest mesh of a job that runs, small. */
export function mountLive(element: HTMLElement, client: Client, jobId: string): () => void {
  return mount(element, LiveView, { client, jobId });
}

/** Likewise the cameras of a rig in the library; `item` is its id. */
export function mountRig(element: HTMLElement, client: Client, item: string): () => void {
  return mount(element, RigView, { client, item });
}

/** Likewise a template with its panels and seams. */
export function mountTemplate(element: HTMLElement, client: Client, item: string): () => void {
  return mount(element, TemplateView, { client, item });
}

/** Likewise a garment's mesh without a board; `files` are its frames. */
export function mountGarment(element: HTMLElement, client: Client, item: string, files: string[]): () => void {
  return mount(element, GarmentView, { client, item, files });
}

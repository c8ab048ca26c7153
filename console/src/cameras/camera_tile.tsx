import { useEffect, useRef, useState } from "preact/hooks";
import type { CameraLook } from "@api/camera_pb";
import { percentText } from "../ui/format";
import { pictureUrl } from "../ui/picture";
import { Histogram, histogramOf } from "./histogram";
import type { CameraLoad } from "./link_load";

export interface TileProps {
  id: string;
  look: CameraLook | undefined;
  load: CameraLoad | undefined;
  isAlarmed: boolean;
  isOld: boolean; // the picture is: there is no newer one
  onOpen: () => void;
}

/** Draws the picture of a look, and counts its histogram. */
export function usePicture(look: CameraLook | undefined) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [bins, setBins] = useState<number[]>([]);
  useEffect(() => {
    if (!look?.jpeg.length) return;
    let isGone = false;
    const image = new Image();
    const url = pictureUrl(look.jpeg);
    image.onload = () => {
      URL.revokeObjectURL(url);
      const context = canvas.current?.getContext("2d", { willReadFrequently: true });
      if (isGone || !canvas.current || !context) return;
      canvas.current.width = image.width;
      canvas.current.height = image.height;
      context.drawImage(image, 0, 0);
      setBins(histogramOf(context.getImageData(0, 0, image.width, image.height).data));
    };
    image.onerror = () => URL.revokeObjectURL(url);
    image.src = url;
    return () => {
      isGone = true;
    };
  }, [look]);
  return { canvas, bins };
}

const MOST_CLIPPED = 0.01;

export function CameraTile({ id, look, load, isAlarmed, isOld, onOpen }: TileProps) {
  const { canvas, bins } = usePicture(look);
  return (
    <article class={isAlarmed ? "camera alarmed" : "camera"} aria-label={`Camera ${id}`}>
      <header>
        <strong>{id}</strong>
        <small>{look?.camera?.model}</small>
        {isOld && look && <strong class="bad-text">old picture</strong>}
        {isAlarmed && <strong class="bad-text">lost a frame</strong>}
      </header>
      <button type="button" class="picture" onClick={onOpen} aria-label={`Look at camera ${id} closely`}>
        <canvas class={isOld ? "old" : ""} ref={canvas} aria-hidden="true" />
        {!look?.jpeg.length && <span>{look?.problem || "no picture yet"}</span>}
      </button>
      {bins.length > 0 && <Histogram bins={bins} />}
      {look && !look.problem && (
        <p class="measures number">
          <span title="Grows with sharpness; compares pictures of this camera and scene">focus {look.focus.toFixed(1)}</span>
          <span>median {look.medianValue}</span>
          <span class={look.clippedShare > MOST_CLIPPED ? "bad-text" : ""}>clipped {percentText(look.clippedShare)}</span>
          <span>dark {percentText(look.darkShare)}</span>
        </p>
      )}
      {load && (
        <p class="measures number">
          <span>{load.fps.toFixed(1)} fps</span>
          {load.megabitsPerS > 0 && (
            <span>
              <meter min={0} max={1} low={0.8} high={0.95} optimum={0} value={load.share} aria-label={`Link load of ${id}`} /> {Math.round(load.megabitsPerS)} Mbit/s
            </span>
          )}
          <span class={load.lost > 0 ? "bad-text" : ""}>lost {load.lost}</span>
          {load.resent > 0 && <span>resent {load.resent}</span>}
        </p>
      )}
    </article>
  );
}

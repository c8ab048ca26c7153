import type { CameraLook } from "@api/camera_pb";
import type { RecordedTake } from "@api/takes_pb";
import { countText, percentText } from "../ui/format";
import { Table } from "../ui/parts";
import type { CameraLoad } from "./link_load";

/** How the cameras of a take keep step, and what their links carry. */
export function LinkBoard({ take, loads, looks }: { take: RecordedTake; loads: Map<string, CameraLoad>; looks: Map<string, CameraLook> }) {
  const cameras = take.state?.cameras ?? [];
  if (!cameras.length) return null;
  const most = Math.max(...cameras.map((camera) => Number(camera.framesReceived)));
  const total = [...loads.values()].reduce((sum, load) => sum + load.megabitsPerS, 0);
  return (
    <section class="link-board" aria-label="Sync and links">
      <h2>Sync and links{total > 0 && <small>, {countText(Math.round(total))} Mbit/s together</small>}</h2>
      <Table label="Sync and links of each camera" head={["camera", "fps", "frames behind", "clock", "Mbit/s", "of its link", "lost", "packets resent", "packets missing", "disconnected", "came back"]}>
        {cameras.map((camera) => {
          const load = loads.get(camera.id);
          const known = looks.get(camera.id)?.camera;
          const behind = most - Number(camera.framesReceived);
          const number = (value: bigint) => <td class={value ? "number bad-text" : "number"}>{countText(value)}</td>;
          return (
            <tr key={camera.id}>
              <td>{camera.id}</td>
              <td class="number">{load?.fps.toFixed(1)}</td>
              <td class={behind > 1 ? "number bad-text" : "number"}>{behind}</td>
              <td class={camera.isAway ? "bad-text" : undefined}>{camera.isAway ? "camera gone" : known?.clockProblem || (known?.ownClock ? "its own" : known ? "in step" : "")}</td>
              <td class="number">{load?.megabitsPerS ? Math.round(load.megabitsPerS) : ""}</td>
              <td class="number">{load?.megabitsPerS ? percentText(load.share) : ""}</td>
              {number(camera.framesLost)}
              <td class="number">{countText(camera.packetsResent)}</td>
              {number(camera.packetsMissing)}
              {number(camera.disconnections)}
              <td class="number">{countText(camera.reconnections)}</td>
            </tr>
          );
        })}
      </Table>
    </section>
  );
}

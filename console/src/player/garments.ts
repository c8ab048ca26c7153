import { fromJson } from "@bufbuild/protobuf";
import type { JsonValue } from "@bufbuild/protobuf";
import { Jobs } from "@api/jobs_pb";
import { FrameReportSchema } from "@api/report_pb";
import type { GarmentReport } from "@api/report_pb";
import type { Client } from "../api/client";

/** A garment of a joint template: its own faces, which follow each other. */
export interface GarmentSpan {
  id: string;
  firstFace: number;
  faces: number;
}

/** The garments that a job registered together, as the report of one of its frames has them; none: it was one. */
export async function garmentsOf(client: Client, jobId: string, frame: string): Promise<GarmentReport[]> {
  const query = { job_id: jobId, frame, kind: "RESULT_KIND_FRAME_REPORT" };
  const text = new TextDecoder().decode(await client.file(Jobs.method.fetchResult, query));
  return fromJson(FrameReportSchema, JSON.parse(text) as JsonValue, { ignoreUnknownFields: true }).mesh?.garments ?? [];
}

/** Vertices of the garments follow each other, and so do the faces. */
export function spansOf(garments: GarmentReport[], faces: Uint32Array): GarmentSpan[] {
  let [vertices, firstFace] = [0, 0];
  return garments.map((garment) => {
    vertices += garment.vertices;
    let end = firstFace;
    while (3 * end < faces.length && faces[3 * end]! < vertices) ++end;
    const span = { id: garment.id, firstFace, faces: end - firstFace };
    firstFace = end;
    return span;
  });
}

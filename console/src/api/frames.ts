import { fromJsonString } from "@bufbuild/protobuf";
import type { FrameInfo } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
import { FrameReportSchema } from "@api/report_pb";
import type { FrameReport } from "@api/report_pb";
import type { Client } from "./client";

/** All frames of a job, page by page. */
export async function allFrames(client: Client, jobId: string): Promise<FrameInfo[]> {
  const frames: FrameInfo[] = [];
  let pageToken = "";
  do {
    const page = await client.call(Jobs.method.listFrames, { jobId, pageToken });
    frames.push(...page.frames);
    pageToken = page.nextPageToken;
  } while (pageToken);
  return frames;
}

/** What a frame's report.json says. */
export async function frameReport(client: Client, jobId: string, frame: string, signal: AbortSignal): Promise<FrameReport> {
  const query = { job_id: jobId, frame, kind: "RESULT_KIND_FRAME_REPORT" };
  const json = new TextDecoder().decode(await client.file(Jobs.method.fetchResult, query, signal));
  return fromJsonString(FrameReportSchema, json, { ignoreUnknownFields: true });
}

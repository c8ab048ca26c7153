import type { FrameInfo } from "@api/job_pb";
import { Jobs } from "@api/jobs_pb";
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

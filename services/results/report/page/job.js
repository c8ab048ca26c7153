// @ts-check
// The page of a job.
import { definePage, warnings } from "./parts.js";
import { jobHead, jobSequence, inputSection, optionSection, pictureSection } from "./job_parts.js";
import { frameSection, plotSection } from "./job_frames.js";
import { cameraSection } from "./job_cameras.js";
import { alignmentSection, cellSection, garmentSection, scanSection } from "./job_stages.js";
import { paperSection } from "./paper.js";

definePage("job", ({ job: page }) => {
  const { job, frames, cameras, figures } = page;
  return [
    jobHead(page), warnings([...job.warnings, ...page.notes]), jobSequence(page), pictureSection(page),
    ...(job.spec?.work ? [frameSection(frames)] : [
      plotSection(frames), paperSection({ drift_mm_s: NaN, geodesic_distortion_mm: NaN, ...figures }, page.paper), frameSection(frames),
      cameraSection(cameras), cellSection(frames), garmentSection(page.garments, page.overlaps), scanSection(frames), alignmentSection(frames),
      optionSection(page)]),
    inputSection(page),
  ];
});

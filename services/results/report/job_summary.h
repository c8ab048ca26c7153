// What a job's frames come to, as its report tells it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/verdict/camera_checks.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/page_job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

bool IsRegistered(v1::FrameState state);  // done or degraded

// NaN where there are no finite values.
double MedianOf(std::vector<double> values);

struct JobSummary {
  v1::FrameCounts counts;  // of the job; counted from the frames where the job has none
  int registered = 0;      // done and degraded
  // Over the registered frames; NaN where there are none. Sigma is of observed vertices, of driven jobs of
  // all.
  double coverage = 0;  // observed vertices of all of them, of those that can be observed
  double lowest_coverage = 0, highest_coverage = 0;
  std::string lowest_coverage_frame;
  double median_cells = 0;
  // Of a driven job, which has no coverage: an avatar is for cameras too few to observe cells.
  bool is_driven = false;
  double median_rays = 0, median_residual_px = 0;
  double median_sigma_mm = 0;
  double median_frame_ms = 0;
  double peak_memory_mib = 0;
  double wall_ms = 0;  // of the job, NaN while it runs
  // In order of first appearance.
  std::vector<v1::PageCamera> cameras;
  CameraFacts facts;                      // what tells whether these are the cameras of the recording
  std::vector<v1::PageGarment> garments;  // in the order of the joint template; else empty
  // Frames by the inner and the outer garment.
  std::map<std::pair<std::string, std::string>, int> overlaps;
  std::vector<std::pair<std::string, int>> failure_reasons;  // frames by reason, most frequent first
};
JobSummary Summarize(const v1::Job& job, const std::vector<v1::FrameReport>& frames);

// A camera that sees the cloth elsewhere than the others do, in a sentence.
struct CameraAlarm {
  std::string text, remedy;
};

// The worst first: cameras that moved, whose calibration is off, or that are late. None of cameras that agree
// with no other, which have a check of their own.
std::vector<CameraAlarm> CameraAlarms(const JobSummary& summary);

// What happened to a frame that is done: "registered", "driven", or "done" in work of another kind.
const char* DoneWord(const v1::Job& job);

// "12 of 12 frames registered, 95.2 % of the cells observed."
std::string Headline(const v1::Job& job, const JobSummary& summary);
// What else is worth a sentence: cameras that moved, degraded, failed, missing, reused frames; not escaped.
std::vector<std::string> Remarks(const v1::Job& job, const JobSummary& summary);

}  // namespace weft

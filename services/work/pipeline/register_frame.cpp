#include "services/work/pipeline/register_frame.h"

#include <tbb/task_arena.h>

#include <fstream>

#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/frame_stages.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// Largest resident size of this process so far; 0 where the system does not tell.
double PeakMemoryMib() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key; std::getline(status, key)) {
    double kib = 0;
    if (key == "VmHWM:" && status >> kib) return kib / 1024;
  }
  return 0;
}

}  // namespace

void SignReport(const RegistrationInputs& inputs, const v1::RegistrationOptions& options,
                v1::FrameReport& report) {
  *report.mutable_inputs() = inputs.hashes;
  *report.mutable_options() = options;
  *report.mutable_keys() = KeysOf(inputs.hashes, options);
  report.set_weft_version(WEFT_VERSION);
  report.set_peak_memory_mib(PeakMemoryMib());
  report.set_threads(tbb::this_task_arena::max_concurrency());
}

absl::StatusOr<v1::FrameReport> RegisterFrame(const RegistrationInputs& inputs, size_t index,
                                              const JobOptions& options, const std::string& out,
                                              const FrameProgress& progress, std::stop_token stop) {
  const Stopwatch watch;
  const v1::RegistrationOptions& asked = options.message;
  // Taken first: images that change while they are read must not look like those that were read.
  WEFT_ASSIGN_OR_RETURN(const std::string fingerprint, FrameFingerprint(*inputs.dump, index, asked));

  const FrameOptions frame_options{options.pipeline, asked.scans(), asked.starts(), options.kept_image_bytes};
  WEFT_ASSIGN_OR_RETURN(FrameResult frame, ComputeFrame(inputs, index, frame_options, progress, stop));
  v1::FrameReport& report = frame.report;
  report.set_frame(inputs.dump->frame_names()[index]);
  report.set_images_fingerprint(fingerprint);
  SignReport(inputs, asked, report);
  report.set_total_ms(watch.Ms());
  WEFT_RETURN_IF_ERROR(WriteFrame(out, inputs, frame));
  if (progress) progress(1);
  return std::move(report);
}

v1::FrameInfo SummaryOf(const v1::FrameReport& report, bool reused) {
  v1::FrameInfo info;
  info.set_frame(report.frame());
  info.set_state(report.state());
  info.set_reason(report.reason());
  info.set_coverage(report.mesh().coverage());
  info.set_total_ms(report.total_ms());
  info.set_reused(reused);
  info.set_share_done(1);
  return info;
}

}  // namespace weft

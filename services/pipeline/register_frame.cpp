#include "services/pipeline/register_frame.h"

#include <google/protobuf/util/message_differencer.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "services/pipeline/frame_files.h"
#include "services/pipeline/frame_folder.h"
#include "services/pipeline/frame_neighbors.h"
#include "services/pipeline/frame_stages.h"

namespace weft {
namespace {

using google::protobuf::util::MessageDifferencer;

// Largest resident size of this process so far; 0 where the system does not tell.
double PeakMemoryMib() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key; std::getline(status, key)) {
    double kib = 0;
    if (key == "VmHWM:" && status >> kib) return kib / 1024;
  }
  return 0;
}

// Of the frame's images, its scan and its start.
absl::StatusOr<std::string> Fingerprint(const RegistrationInputs& inputs, size_t index,
                                        const v1::RegistrationOptions& options) {
  absl::StatusOr<std::string> fingerprint = inputs.dump->Fingerprint(index);
  if (!fingerprint.ok()) return fingerprint;
  for (const std::string& file :
       {ScanPath(inputs, index, options.scans()), StartPath(inputs, index, options.starts())}) {
    if (file.empty()) continue;
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto written = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    absl::StrAppend(&*fingerprint, "+", bytes, "-", written);
  }
  return fingerprint;
}

// Frames that start from their own results would differ from run to run.
absl::Status CheckStarts(const std::string& starts, const std::string& out) {
  std::error_code error;
  if (starts.empty() || !std::filesystem::equivalent(starts, out, error)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("options.starts: ", starts, " is the folder of the results; give that of an earlier run"));
}

}  // namespace

absl::StatusOr<v1::FrameReport> RegisterFrame(const RegistrationInputs& inputs, size_t index,
                                              const JobOptions& options, const std::string& out,
                                              const FrameProgress& progress, std::stop_token stop) {
  const auto start = std::chrono::steady_clock::now();
  const v1::RegistrationOptions& asked = options.message;
  if (absl::Status status = CheckStarts(asked.starts(), out); !status.ok()) return status;
  // Taken first: images that change while they are read must not look like those that were read.
  const absl::StatusOr<std::string> fingerprint = Fingerprint(inputs, index, asked);
  if (!fingerprint.ok()) return fingerprint.status();

  const FrameOptions frame_options{options.pipeline, asked.scans(), asked.starts()};
  absl::StatusOr<FrameResult> frame = ComputeFrame(inputs, index, frame_options, progress, stop);
  if (!frame.ok()) return frame.status();
  v1::FrameReport& report = frame->report;
  report.set_frame(inputs.dump->frame_names()[index]);
  *report.mutable_inputs() = inputs.hashes;
  *report.mutable_options() = asked;
  report.set_images_fingerprint(*fingerprint);
  report.set_weft_version(WEFT_VERSION);
  report.set_peak_memory_mib(PeakMemoryMib());
  report.set_threads(tbb::this_task_arena::max_concurrency());
  const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
  report.set_total_ms(elapsed.count());
  if (absl::Status status = WriteFrame(out, inputs, *frame); !status.ok()) return status;
  if (progress) progress(1);
  return std::move(report);
}

absl::StatusOr<v1::FrameReport> FindCompleteFrame(const RegistrationInputs& inputs, size_t index,
                                                  const JobOptions& options, const std::string& out) {
  const absl::StatusOr<FrameFolder> folder =
      FrameFolder::Open(out, inputs.dump->frame_names()[index], ConfinedFolder::IfMissing::kFail);
  if (!folder.ok()) return folder.status();
  absl::StatusOr<v1::FrameReport> report = folder->Report();
  if (!report.ok()) return report.status();
  if (!FactsOf(*report).registered) return absl::NotFoundError(absl::StrCat(folder->path(), " failed"));
  const absl::StatusOr<std::string> fingerprint = Fingerprint(inputs, index, options.message);
  if (!fingerprint.ok()) return fingerprint.status();
  const bool same = report->frame() == inputs.dump->frame_names()[index] &&
                    report->weft_version() == WEFT_VERSION && report->images_fingerprint() == *fingerprint &&
                    MessageDifferencer::Equals(report->inputs(), inputs.hashes) &&
                    MessageDifferencer::Equals(Canonical(report->options()), options.message);
  if (!same) return absl::NotFoundError(absl::StrCat(folder->path(), " was computed from something else"));
  if (const std::string problem = folder->CheckAll(*report); !problem.empty()) {
    return absl::NotFoundError(absl::StrCat(folder->path(), ": ", problem));
  }
  // Whoever wrote it may have been killed before that.
  if (absl::Status status = folder->Sync(); !status.ok()) return status;
  return report;
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

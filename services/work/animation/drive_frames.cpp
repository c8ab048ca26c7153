#include "services/work/animation/drive_frames.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <future>
#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/animation/frame_driver.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/register_frame.h"

namespace weft {
namespace {

// Decodes the frame that is likely to be next, in a thread of its own, while another one is driven.
class DecodeAhead {
 public:
  DecodeAhead(const DriveInputs& inputs, const DriveFrameList& list, tbb::task_arena& arena,
              const std::stop_token& stop)
      : inputs_(inputs), list_(list), arena_(arena), stop_(stop) {}
  ~DecodeAhead() {
    if (coming_.valid()) coming_.wait();
  }
  DecodeAhead(const DecodeAhead&) = delete;
  DecodeAhead& operator=(const DecodeAhead&) = delete;

  SeenFrame Take(size_t at) {
    if (coming_.valid() && at_ == at) return coming_.get();
    return Decode(at);
  }
  void Begin(size_t at) {
    if (coming_.valid()) coming_.wait();
    at_ = at;
    coming_ = std::async(std::launch::async, [this, at] { return Decode(at); });
  }

 private:
  SeenFrame Decode(size_t at) {
    std::optional<SeenFrame> seen;
    arena_.execute(
        [&] { seen.emplace(SeeFrame(inputs_, *list_.dump, list_.indices[at], list_.time_ns[at], stop_)); });
    return *std::move(seen);
  }

  const DriveInputs& inputs_;
  const DriveFrameList& list_;
  tbb::task_arena& arena_;
  const std::stop_token& stop_;
  size_t at_ = 0;
  std::future<SeenFrame> coming_;
};

// A worker that crashed at a frame gave it up, and nothing is known of the driver then.
bool WasQuarantined(const std::string& out, const std::string& frame) {
  const auto folder = FrameFolder::Open(out, frame, ConfinedFolder::IfMissing::kFail);
  if (!folder.ok()) return false;
  const absl::StatusOr<v1::FrameReport> report = folder->Report();
  return report.ok() && report->set_aside();
}

class FrameRun {
 public:
  FrameRun(const v1::RegistrationSpec& spec, const DriveInputs& inputs, const DriveFrameList& list,
           const std::vector<size_t>& asked, const std::string& out, const RegistrationEvents& events,
           const std::stop_token& stop)
      : spec_(spec), inputs_(inputs), list_(list), asked_(asked), out_(out), events_(events), stop_(stop) {}

  absl::Status Run(FrameDriver driver, const StageKeys& keys, int threads) {
    FindCached(keys);
    tbb::task_arena decoding(threads), driving(threads);
    DecodeAhead ahead(inputs_, list_, decoding, stop_);
    for (size_t at = 0; at < standing_.size(); ++at) {
      if (stop_.stop_requested()) return Cancelled();
      std::optional<v1::FrameReport>& report = standing_[at];
      if (report && report->driven().follows() == MemoryChecksum(driver.memory()) &&
          driver.Restore(report->driven().memory(), list_.NameOf(at)).ok()) {
        TellFinished(at, *report, /*reused=*/true);
        report.reset();
        continue;
      }
      if (!IsAsked(at) && WasQuarantined(out_, list_.NameOf(at))) continue;
      report.reset();
      WEFT_RETURN_IF_ERROR(DriveOne(at, driver, ahead, driving));
    }
    return absl::OkStatus();
  }

 private:
  static absl::Status Cancelled() { return absl::CancelledError("the driving was cancelled"); }

  void FindCached(const StageKeys& keys) {
    const size_t end = asked_.empty() ? 0 : *std::ranges::max_element(asked_) + 1;
    for (size_t at = 0; at < end; ++at) {
      const absl::StatusOr<std::string> fingerprint = list_.dump->Fingerprint(list_.indices[at]);
      standing_.push_back(fingerprint.ok() ? CachedReport(out_, list_.NameOf(at), keys, *fingerprint,
                                                          spec_.options().write_observations())
                                           : std::nullopt);
    }
  }

  absl::Status DriveOne(size_t at, FrameDriver& driver, DecodeAhead& ahead, tbb::task_arena& arena) {
    if (IsAsked(at) && events_.started) events_.started(list_.NameOf(at));
    const Stopwatch watch;
    const SeenFrame seen = ahead.Take(at);
    if (stop_.stop_requested()) return Cancelled();
    size_t next = at + 1;
    while (next < standing_.size() && standing_[next]) ++next;
    if (next < standing_.size()) ahead.Begin(next);
    absl::StatusOr<FrameDriver::Driven> driven = Cancelled();
    arena.execute([&] { driven = driver.Drive(seen, watch); });
    if (!driven.ok()) return driven.status();
    WEFT_RETURN_IF_ERROR(driver.Write(seen, *driven));
    TellFinished(at, driven->report, /*reused=*/false);
    return absl::OkStatus();
  }

  bool IsAsked(size_t at) const { return std::ranges::binary_search(asked_, at); }
  void TellFinished(size_t at, const v1::FrameReport& report, bool reused) const {
    if (IsAsked(at) && events_.finished) events_.finished(SummaryOf(report, reused));
  }

  const v1::RegistrationSpec& spec_;
  const DriveInputs& inputs_;
  const DriveFrameList& list_;
  const std::vector<size_t>& asked_;
  const std::string& out_;
  const RegistrationEvents& events_;
  const std::stop_token& stop_;
  std::vector<std::optional<v1::FrameReport>> standing_;  // candidates, up to the last frame asked for
};

}  // namespace

absl::Status DriveFrames(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                         const DriveFrameList& list, const std::vector<size_t>& asked, const std::string& out,
                         int threads, const RegistrationEvents& events, const std::stop_token& stop) {
  const int cores = threads > 0 ? threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<size_t>(cores) + 1);
  const StageKeys keys = DriveKeys(spec, inputs);
  WEFT_ASSIGN_OR_RETURN(FrameDriver driver, FrameDriver::Create(spec, inputs, keys, out));
  return FrameRun(spec, inputs, list, asked, out, events, stop).Run(std::move(driver), keys, cores);
}

}  // namespace weft

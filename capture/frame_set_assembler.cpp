#include "capture/frame_set_assembler.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

constexpr size_t kMaxLosses = 1024;

std::string Milliseconds(int64_t ns) { return absl::StrFormat("%.3f ms", static_cast<double>(ns) / 1e6); }
std::string Seconds(int64_t ns) { return absl::StrFormat("%.3f s", static_cast<double>(ns) / 1e9); }

}  // namespace

absl::Status FrameSetOptions::Validate() const {
  if (period_ns < 0) return absl::InvalidArgumentError("period_ns must not be negative");
  if (tolerance_ns <= 0) return absl::InvalidArgumentError("tolerance_ns must be positive");
  if (period_ns > 0 && 2 * tolerance_ns >= period_ns) {
    return absl::InvalidArgumentError(absl::StrCat("tolerance_ns ", tolerance_ns,
                                                   " must be below half the period of ", period_ns,
                                                   " ns, or a frame fits two sets"));
  }
  if (max_wait_ns <= 0) return absl::InvalidArgumentError("max_wait_ns must be positive");
  if (clock_jump_ns <= 0) return absl::InvalidArgumentError("clock_jump_ns must be positive");
  return absl::OkStatus();
}

FrameSetAssembler::FrameSetAssembler(std::vector<std::string> camera_ids, const FrameSetOptions& options,
                                     uint64_t first_number)
    : camera_ids_(std::move(camera_ids)),
      options_(options),
      cameras_(camera_ids_.size()),
      next_number_(first_number) {
  for (Camera& camera : cameras_) camera.has_clock = options_.clocks == ClockDomain::kShared;
}

void FrameSetAssembler::Note(size_t camera, int64_t host_time_ns, const std::string& cause,
                             AssembledSets& out) const {
  out.entries.push_back({LedgerEvent::kNote, 0, 0, 0, host_time_ns, camera_ids_[camera], cause});
}

AssembledSets FrameSetAssembler::Add(size_t camera, CameraDelivery delivery, int64_t host_time_ns) {
  AssembledSets out;
  Camera& state = cameras_[camera];
  switch (delivery.kind) {
    case CameraDelivery::Kind::kFrame:
      AddFrame(camera, std::move(delivery.frame), host_time_ns, out);
      break;
    case CameraDelivery::Kind::kLostFrame:
      AddLoss(camera, delivery, host_time_ns);
      break;
    case CameraDelivery::Kind::kDisconnected:
      state.is_connected = false;
      Note(camera, host_time_ns, "disconnected: " + delivery.cause, out);
      break;
    case CameraDelivery::Kind::kReconnected:
      state.is_connected = true;
      state.last_device_ns.reset();
      state.has_clock = options_.clocks == ClockDomain::kShared;
      state.offset_ns = 0;
      Note(camera, host_time_ns, "reconnected: " + delivery.cause, out);
      break;
    case CameraDelivery::Kind::kNote:
      Note(camera, host_time_ns, delivery.cause, out);
      break;
  }
  Deliver(host_time_ns, false, out);
  return out;
}

void FrameSetAssembler::CheckClock(size_t camera, const RawFrame& frame, AssembledSets& out) {
  Camera& state = cameras_[camera];
  if (!state.has_clock) {  // matched to the sets by when it arrived
    state.offset_ns = frame.host_time_ns - frame.device_time_ns;
    state.has_clock = true;
  }
  if (!state.last_device_ns) return;
  if (options_.clocks == ClockDomain::kEstimated) {
    // Quartzes drift apart by some 10 ppm, arrivals scatter by milliseconds: follow slowly.
    const int64_t error_ns = frame.host_time_ns - frame.device_time_ns - state.offset_ns;
    state.offset_ns += std::clamp(error_ns, -options_.tolerance_ns, options_.tolerance_ns) / 64;
  }
  // Two witnesses of how much time has passed: the host's clock, which is late when frames arrive in a rush,
  // and the camera's own count, which is silent about pauses. A clock has jumped when it contradicts both.
  const int64_t by_device_ns = frame.device_time_ns - *state.last_device_ns;
  int64_t jump_ns = by_device_ns - (frame.host_time_ns - state.last_host_ns);
  int64_t limit_ns = options_.clock_jump_ns;
  if (options_.period_ns > 0 && frame.device_frame_id > state.last_id) {
    const int64_t by_count_ns =
        by_device_ns - options_.period_ns * static_cast<int64_t>(frame.device_frame_id - state.last_id);
    limit_ns = std::min(limit_ns, options_.period_ns / 2);
    if (std::abs(by_count_ns) <= limit_ns) return;
    if (std::abs(jump_ns) > limit_ns) jump_ns = by_count_ns;
  }
  if (std::abs(jump_ns) <= limit_ns) return;
  state.offset_ns -= jump_ns;
  Note(camera, frame.host_time_ns,
       absl::StrCat("its clock jumped by ", Seconds(jump_ns),
                    "; its frames are matched by the time before the jump"),
       out);
}

// Frames that the camera counted and that nobody saw.
void FrameSetAssembler::NoteGap(Camera& camera, const RawFrame& frame, int64_t time_ns) {
  if (!camera.last_device_ns || !camera.last_time_ns || frame.device_frame_id <= camera.last_id + 1) return;
  const uint64_t lost = std::min<uint64_t>(frame.device_frame_id - camera.last_id - 1, kMaxLosses);
  for (uint64_t i = 1; i <= lost; ++i) {
    const auto part = static_cast<double>(i) / static_cast<double>(frame.device_frame_id - camera.last_id);
    const auto at_ns =
        *camera.last_time_ns + std::llround(part * static_cast<double>(time_ns - *camera.last_time_ns));
    const bool known = std::any_of(camera.losses.begin(), camera.losses.end(), [&](const Loss& loss) {
      return std::abs(loss.time_ns - at_ns) <= std::max(options_.tolerance_ns, options_.period_ns / 4);
    });
    if (!known) {
      camera.losses.push_back({at_ns, absl::StrCat("the camera counted its frame ", camera.last_id + i,
                                                   ", and nothing of it arrived")});
    }
  }
}

void FrameSetAssembler::AddFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  CheckClock(camera, frame, out);
  const int64_t time_ns = frame.device_time_ns + state.offset_ns;
  NoteGap(state, frame, time_ns);
  state.last_device_ns = frame.device_time_ns;
  state.last_host_ns = frame.host_time_ns;
  state.last_id = frame.device_frame_id;
  state.last_time_ns = time_ns;

  if (last_delivered_ns_ && time_ns <= *last_delivered_ns_ + options_.tolerance_ns) {
    Note(camera, host_time_ns,
         absl::StrCat("frame ", frame.device_frame_id, " came ", Milliseconds(*last_delivered_ns_ - time_ns),
                      " after its set was closed"),
         out);
    return;
  }
  // The open set that is nearest in time and lacks this camera.
  OpenSet* nearest = nullptr;
  for (OpenSet& set : open_) {
    if (std::abs(set.time_ns - time_ns) > options_.tolerance_ns || set.frames.contains(camera)) continue;
    if (nearest == nullptr || std::abs(set.time_ns - time_ns) < std::abs(nearest->time_ns - time_ns))
      nearest = &set;
  }
  if (nearest == nullptr) {
    const auto after = std::upper_bound(open_.begin(), open_.end(), time_ns,
                                        [](int64_t t, const OpenSet& set) { return t < set.time_ns; });
    nearest = &*open_.insert(after, OpenSet{time_ns, host_time_ns, {}});
  }
  nearest->frames.emplace(camera, std::move(frame));
}

void FrameSetAssembler::AddLoss(size_t camera, const CameraDelivery& delivery, int64_t host_time_ns) {
  Camera& state = cameras_[camera];
  int64_t time_ns = host_time_ns;
  if (delivery.frame.device_time_ns != 0 && state.has_clock) {
    time_ns = delivery.frame.device_time_ns + state.offset_ns;
  } else if (state.last_time_ns && delivery.frame.device_frame_id > state.last_id) {
    time_ns = *state.last_time_ns +
              options_.period_ns * static_cast<int64_t>(delivery.frame.device_frame_id - state.last_id);
  }
  state.losses.push_back({time_ns, delivery.cause});
  if (state.losses.size() > kMaxLosses) state.losses.pop_front();
}

bool FrameSetAssembler::IsDecided(const OpenSet& set, size_t camera) const {
  const Camera& state = cameras_[camera];
  if (set.frames.contains(camera) || !state.is_connected) return true;
  if (state.last_time_ns && *state.last_time_ns > set.time_ns + options_.tolerance_ns) return true;
  return std::any_of(state.losses.begin(), state.losses.end(), [&](const Loss& loss) {
    return std::abs(loss.time_ns - set.time_ns) <= options_.tolerance_ns;
  });
}

std::string FrameSetAssembler::WhyMissing(const OpenSet& set, size_t camera, bool timed_out) {
  Camera& state = cameras_[camera];
  const int64_t reach_ns = options_.period_ns > 0 ? options_.period_ns / 2 : options_.tolerance_ns;
  while (!state.losses.empty() && state.losses.front().time_ns < set.time_ns - reach_ns)
    state.losses.pop_front();
  for (auto loss = state.losses.begin(); loss != state.losses.end(); ++loss) {
    if (std::abs(loss->time_ns - set.time_ns) > reach_ns) continue;
    std::string cause = std::move(loss->cause);
    state.losses.erase(loss);
    return cause;
  }
  if (!state.is_connected) return "the camera is disconnected";
  if (!state.last_time_ns) return "the camera has not delivered yet";
  const int64_t off_ns = *state.last_time_ns - set.time_ns;
  if (off_ns > options_.tolerance_ns && off_ns < std::max(4 * options_.tolerance_ns, options_.period_ns)) {
    return absl::StrCat("its frame is ", Milliseconds(off_ns), " late, the tolerance is ",
                        Milliseconds(options_.tolerance_ns));
  }
  if (timed_out) return absl::StrCat("no frame within ", Milliseconds(options_.max_wait_ns));
  return "the camera took no frame at this trigger";
}

void FrameSetAssembler::DeliverFirst(int64_t host_time_ns, AssembledSets& out) {
  OpenSet open = std::move(open_.front());
  open_.pop_front();
  uint64_t steps = 1;
  if (last_delivered_ns_ && options_.period_ns > 0) {
    const double periods =
        static_cast<double>(open.time_ns - *last_delivered_ns_) / static_cast<double>(options_.period_ns);
    steps = static_cast<uint64_t>(std::max<int64_t>(1, std::llround(periods)));
  }
  const uint64_t number = last_delivered_ns_ ? next_number_ + steps - 1 : next_number_;
  if (number > next_number_) {
    out.entries.push_back({LedgerEvent::kDropped, next_number_, number - 1,
                           *last_delivered_ns_ + options_.period_ns, host_time_ns, "",
                           "no camera delivered a frame"});
  }
  const bool timed_out = host_time_ns - open.opened_host_ns >= options_.max_wait_ns;
  RawFrameSet set;
  set.number = number;
  set.device_time_ns = open.time_ns;
  for (size_t camera = 0; camera < cameras_.size(); ++camera) {
    const auto frame = open.frames.find(camera);
    if (frame != open.frames.end()) {
      set.frames.push_back(std::move(frame->second));
    } else {
      set.missing.push_back({camera_ids_[camera], WhyMissing(open, camera, timed_out)});
    }
  }
  next_number_ = number + 1;
  last_delivered_ns_ = open.time_ns;
  if (set.missing.empty() || !options_.drop_incomplete) {
    out.sets.push_back(std::move(set));
    return;
  }
  std::string cause = "incomplete:";
  for (const MissingFrame& missing : set.missing)
    absl::StrAppend(&cause, " ", missing.camera_id, ": ", missing.reason, ";");
  cause.pop_back();
  out.entries.push_back({LedgerEvent::kDropped, number, number, set.device_time_ns, host_time_ns, "", cause});
}

void FrameSetAssembler::Deliver(int64_t host_time_ns, bool all, AssembledSets& out) {
  while (!open_.empty()) {
    const OpenSet& first = open_.front();
    bool decided =
        all || open_.size() > kMaxOpenSets || host_time_ns - first.opened_host_ns >= options_.max_wait_ns;
    if (!decided) {
      decided = true;
      for (size_t camera = 0; camera < cameras_.size() && decided; ++camera)
        decided = IsDecided(first, camera);
    }
    if (!decided) return;
    DeliverFirst(host_time_ns, out);
  }
}

AssembledSets FrameSetAssembler::Advance(int64_t host_time_ns) {
  AssembledSets out;
  Deliver(host_time_ns, false, out);
  return out;
}

AssembledSets FrameSetAssembler::Finish(int64_t host_time_ns) {
  AssembledSets out;
  Deliver(host_time_ns, true, out);
  return out;
}

}  // namespace weft

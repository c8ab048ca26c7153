#include "capture/sync/frame_set_assembler.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

constexpr size_t kMaxLosses = 1024;
constexpr uint64_t kArrivalsThatTell = 10;     // of a clock that is not read
constexpr int64_t kSureJump_ns = 100'000'000;  // no frame that is on its way is so late by chance

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
  if (start_wait_ns < 0) return absl::InvalidArgumentError("start_wait_ns must not be negative");
  if (clock_jump_ns <= 0) return absl::InvalidArgumentError("clock_jump_ns must be positive");
  for (const CameraTiming& timing : cameras)
    if (timing.unsynchronized && period_ns == 0)
      return absl::InvalidArgumentError("an unsynchronized camera needs the rate of the others");
  return absl::OkStatus();
}

FrameSetAssembler::FrameSetAssembler(std::vector<std::string> camera_ids, const FrameSetOptions& options,
                                     uint64_t first_number)
    : camera_ids_(std::move(camera_ids)),
      options_(options),
      cameras_(camera_ids_.size()),
      next_number_(first_number),
      first_number_(first_number) {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].clock = NewClock();
    if (i < options_.cameras.size()) cameras_[i].timing = options_.cameras[i];
    if (cameras_[i].timing.unsynchronized) cameras_[i].unsynchronized.emplace(options_.period_ns);
  }
}

ClockTrack FrameSetAssembler::NewClock() const {
  const int64_t half_ns = options_.period_ns > 0 ? options_.period_ns / 2 : kSureJump_ns;
  return {options_.period_ns, std::min(options_.clock_jump_ns, half_ns), std::min(kSureJump_ns, half_ns)};
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
      state.is_silent = false;
      AddFrame(camera, std::move(delivery.frame), host_time_ns, out);
      break;
    case CameraDelivery::Kind::kLostFrame:
      AddLoss(camera, delivery, host_time_ns);
      break;
    case CameraDelivery::Kind::kDisconnected:
      state.is_connected = false;
      Note(camera, host_time_ns, "disconnected: " + delivery.cause, out);
      break;
    case CameraDelivery::Kind::kEnded:
      state.is_connected = false;
      state.has_ended = true;
      Note(camera, host_time_ns, "ended: " + delivery.cause, out);
      break;
    case CameraDelivery::Kind::kReconnected: {
      state.is_connected = true;
      state.is_silent = state.is_clock_doubt_noted = state.is_hold_over = false;
      state.held.clear();
      ClockTrack clock = NewClock();
      clock.ExpectLatencyOf(*state.clock);
      state.clock = clock;
      state.is_clock_known = false;
      state.clock_since_ns.reset();
      state.unplaced_ns.clear();
      state.last_id.reset();
      if (state.unsynchronized) state.unsynchronized->Restart();
      // A camera whose clock had jumped comes back with that clock.
      if (options_.clocks == ClockDomain::kShared && !state.timing.own_clock)
        if (const std::optional<int64_t> offset_ns = SharedOffset_ns()) state.clock->Expect(*offset_ns);
      Note(camera, host_time_ns, "reconnected: " + delivery.cause, out);
      break;
    }
    case CameraDelivery::Kind::kClock:
      state.is_silent = false;
      AddReading(camera, delivery.clock, host_time_ns, out);
      break;
    case CameraDelivery::Kind::kSilent:
      state.is_silent = true;
      break;
    case CameraDelivery::Kind::kAnswers:
      state.is_silent = false;
      break;
    case CameraDelivery::Kind::kNote:
      Note(camera, host_time_ns, delivery.cause, out);
      break;
  }
  Deliver(host_time_ns, out);
  return out;
}

// A camera that is there tells of the shared clock, best one whose clock was read; where none is, one that
// was there.
const ClockTrack* FrameSetAssembler::SharedClock() const {
  const ClockTrack* best = nullptr;
  bool is_best_there = false;
  for (const Camera& camera : cameras_) {
    if (camera.timing.own_clock || !camera.clock->offset_ns()) continue;
    const bool is_better = camera.is_connected != is_best_there
                               ? camera.is_connected
                               : camera.clock->uncertainty_ns() && !best->uncertainty_ns();
    if (best != nullptr && !is_better) continue;
    best = &*camera.clock;
    is_best_there = camera.is_connected;
  }
  return best;
}

// Host time minus the shared clock.
std::optional<int64_t> FrameSetAssembler::SharedOffset_ns() const {
  const ClockTrack* clock = SharedClock();
  return clock != nullptr ? clock->offset_ns() : std::nullopt;
}

int64_t FrameSetAssembler::CommonTime_ns(const Camera& camera, int64_t device_ns) const {
  const int64_t steady_ns = camera.clock->Steady_ns(device_ns),
                own_ns = camera.clock->offset_ns().value_or(0);
  if (options_.clocks == ClockDomain::kEstimated) return steady_ns + own_ns;
  return camera.timing.own_clock ? steady_ns + own_ns - SharedOffset_ns().value_or(0) : steady_ns;
}

// A clock of whose jump readings alone tell is no longer exactly the others'.
void FrameSetAssembler::FollowJump(size_t camera, int64_t jump_ns, int64_t host_time_ns, AssembledSets& out) {
  if (jump_ns == 0) return;
  Camera& state = cameras_[camera];
  state.has_jumped = true;
  const bool is_vague = state.clock->IsJumpVague();
  Note(camera, host_time_ns,
       absl::StrCat("its clock jumped by ", Seconds(jump_ns), "; its frames are matched by ",
                    is_vague ? "readings of its clock" : "the time before the jump"),
       out);
  PlaceAnew(camera, host_time_ns, out);
  if (!is_vague) return;
  state.is_clock_known = false;
  state.clock_since_ns.reset();
  if (options_.clocks != ClockDomain::kShared || state.timing.own_clock) return;
  state.timing.own_clock = true;  // if another one's tells of the shared clock as well as this
  if (const ClockTrack* shared = SharedClock(); shared == nullptr || !shared->uncertainty_ns())
    state.timing.own_clock = false;
}

void FrameSetAssembler::NoteUnreadableClock(size_t camera, int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  if (!state.clock->contradiction_ns() || std::exchange(state.is_clock_doubt_noted, true)) return;
  Note(camera, host_time_ns,
       absl::StrCat("its clock cannot be read: readings are ", Seconds(*state.clock->contradiction_ns()),
                    " off the times of its frames; arrival times are used instead"),
       out);
}

// Frames that the camera counted and that nobody saw.
void FrameSetAssembler::NoteGap(Camera& camera, const RawFrame& frame, int64_t time_ns) {
  if (!camera.last_id || !camera.last_time_ns || frame.device_frame_id <= *camera.last_id + 1) return;
  const uint64_t last_id = *camera.last_id;
  const uint64_t lost = std::min<uint64_t>(frame.device_frame_id - last_id - 1, kMaxLosses);
  for (uint64_t i = 1; i <= lost; ++i) {
    const auto part = static_cast<double>(i) / static_cast<double>(frame.device_frame_id - last_id);
    const auto at_ns =
        *camera.last_time_ns + std::llround(part * static_cast<double>(time_ns - *camera.last_time_ns));
    const bool known = std::any_of(camera.losses.begin(), camera.losses.end(), [&](const Loss& loss) {
      return std::abs(loss.time_ns - at_ns) <= std::max(options_.tolerance_ns, options_.period_ns / 4);
    });
    if (!known) {
      camera.losses.push_back(
          {at_ns, absl::StrCat("the camera counted its frame ", last_id + i, ", and nothing of it arrived")});
    }
  }
}

// A reading that took long may put a frame to the trigger before or after its own.
bool FrameSetAssembler::IsClockKnown(Camera& camera, int64_t host_time_ns) const {
  if (camera.is_clock_known) return true;
  if (!camera.clock_since_ns) camera.clock_since_ns = host_time_ns;
  const std::optional<int64_t> uncertainty_ns = camera.clock->uncertainty_ns();
  const bool is_read = uncertainty_ns ? *uncertainty_ns <= options_.tolerance_ns / 2
                                      : camera.clock->frames() >= kArrivalsThatTell;
  const bool is_shared = options_.clocks == ClockDomain::kShared;
  const bool is_known = is_shared && (!camera.timing.own_clock || (SharedOffset_ns() && is_read));
  camera.is_clock_known =
      is_known || (!is_shared && is_read) || host_time_ns - *camera.clock_since_ns >= options_.start_wait_ns;
  if (!camera.is_clock_known) return false;
  for (const int64_t device_ns : camera.unplaced_ns)
    camera.losses.push_back({CommonTime_ns(camera, device_ns), ClockCause()});
  camera.unplaced_ns.clear();
  return true;
}

std::string FrameSetAssembler::ClockCause() const {
  return absl::StrCat("the camera's clock was not yet known to within half the tolerance of ",
                      Milliseconds(options_.tolerance_ns));
}

void FrameSetAssembler::AddReading(size_t camera, const ClockReading& reading, int64_t host_time_ns,
                                   AssembledSets& out) {
  ClockTrack& clock = *cameras_[camera].clock;
  const int64_t jump_ns = clock.AddReading(reading);
  FollowJump(camera, jump_ns, host_time_ns, out);
  NoteUnreadableClock(camera, host_time_ns, out);
  if (!clock.IsInDoubt()) PlaceHeld(camera, host_time_ns, out, jump_ns);
}

void FrameSetAssembler::AddFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  if (!first_host_ns_) first_host_ns_ = host_time_ns;
  const int64_t jump_ns =
      state.clock->AddFrame(frame.device_time_ns, frame.host_time_ns, frame.device_frame_id);
  FollowJump(camera, jump_ns, frame.host_time_ns, out);
  NoteUnreadableClock(camera, host_time_ns, out);
  if (state.clock->IsInDoubt()) {
    if (state.held.empty()) state.held_since_ns = host_time_ns;
    state.held.push_back(std::move(frame));
    EndHolding(host_time_ns, out);
    return;
  }
  PlaceHeld(camera, host_time_ns, out, jump_ns);
  PlaceFrame(camera, std::move(frame), host_time_ns, out);
}

void FrameSetAssembler::PlaceFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out,
                                   int64_t jump_ns) {
  Camera& state = cameras_[camera];
  if (!IsClockKnown(state, host_time_ns)) {
    state.unplaced_ns.push_back(frame.device_time_ns);
    state.unplaced_before_begin += !begin_ns_;
    if (state.unplaced_ns.size() > kMaxLosses) state.unplaced_ns.pop_front();
    return;
  }
  const int64_t time_ns = CommonTime_ns(state, frame.device_time_ns + jump_ns);
  NoteGap(state, frame, time_ns);
  state.last_id = frame.device_frame_id;
  if (!state.first_time_ns) state.first_time_ns = time_ns;
  state.last_time_ns = time_ns;
  state.last_host_ns = host_time_ns;

  if (state.unsynchronized) {
    state.unsynchronized->Add(std::move(frame), time_ns);
    return;
  }
  if (begin_ns_ && time_ns < *begin_ns_ - options_.tolerance_ns) return;
  if (last_delivered_ns_ && time_ns <= *last_delivered_ns_ + options_.tolerance_ns) {
    NoteAfterClosing(camera, frame.device_frame_id, host_time_ns, out);
    return;
  }
  PutIntoSet(camera, {std::move(frame), time_ns}, host_time_ns);
}

// Into the open set that is nearest in time and lacks this camera, or into a new one. A camera whose clock
// jumped says nothing of a trigger's time where another one does.
void FrameSetAssembler::PutIntoSet(size_t camera, TimedFrame frame, int64_t host_time_ns) {
  OpenSet* nearest = nullptr;
  for (OpenSet& set : open_) {
    if (std::abs(set.time_ns - frame.time_ns) > options_.tolerance_ns || set.frames.contains(camera))
      continue;
    if (nearest == nullptr ||
        std::abs(set.time_ns - frame.time_ns) < std::abs(nearest->time_ns - frame.time_ns))
      nearest = &set;
  }
  const auto by_time = [](const OpenSet& a, const OpenSet& b) { return a.time_ns < b.time_ns; };
  if (nearest == nullptr) {
    OpenSet set{frame.time_ns, host_time_ns, {}};
    set.frames.emplace(camera, std::move(frame));
    open_.insert(std::upper_bound(open_.begin(), open_.end(), set, by_time), std::move(set));
    return;
  }
  const bool is_sound = !cameras_[camera].has_jumped;
  const bool knows_better =
      is_sound && std::all_of(nearest->frames.begin(), nearest->frames.end(),
                              [&](const auto& entry) { return cameras_[entry.first].has_jumped; });
  if (knows_better) nearest->time_ns = frame.time_ns;
  nearest->frames.emplace(camera, std::move(frame));
  if (knows_better) std::stable_sort(open_.begin(), open_.end(), by_time);
}

void FrameSetAssembler::AddLoss(size_t camera, const CameraDelivery& delivery, int64_t host_time_ns) {
  Camera& state = cameras_[camera];
  int64_t time_ns = host_time_ns;
  if (delivery.frame.device_time_ns != 0 && state.last_id) {
    time_ns = CommonTime_ns(state, delivery.frame.device_time_ns);
  } else if (state.last_time_ns && state.last_id && delivery.frame.device_frame_id > *state.last_id) {
    time_ns = *state.last_time_ns +
              options_.period_ns * static_cast<int64_t>(delivery.frame.device_frame_id - *state.last_id);
  }
  state.losses.push_back({time_ns, delivery.cause});
  if (state.losses.size() > kMaxLosses) state.losses.pop_front();
}

}  // namespace weft

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
constexpr size_t kMaxSetsBeforeBegin = 8;  // that wait for the cameras to start

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
    if (timing.own_pace && period_ns == 0)
      return absl::InvalidArgumentError("a camera at its own pace needs the rate of the others");
  return absl::OkStatus();
}

FrameSetAssembler::FrameSetAssembler(std::vector<std::string> camera_ids, const FrameSetOptions& options,
                                     uint64_t first_number)
    : camera_ids_(std::move(camera_ids)),
      options_(options),
      cameras_(camera_ids_.size()),
      next_number_(first_number) {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].clock = NewClock();
    if (i < options_.cameras.size()) cameras_[i].timing = options_.cameras[i];
    if (cameras_[i].timing.own_pace) cameras_[i].own_pace.emplace(options_.period_ns);
  }
}

ClockTrack FrameSetAssembler::NewClock() const {
  const int64_t half_ns = options_.period_ns > 0 ? options_.period_ns / 2 : options_.clock_jump_ns;
  return {options_.period_ns, std::min(options_.clock_jump_ns, half_ns)};
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
      state.clock = NewClock();
      state.is_clock_known = false;
      state.clock_since_ns.reset();
      state.unplaced_ns.clear();
      state.last_id.reset();
      if (state.own_pace) state.own_pace->Restart();
      // A camera whose clock had jumped comes back with that clock.
      if (options_.clocks == ClockDomain::kShared && !state.timing.own_clock)
        if (const std::optional<int64_t> offset_ns = SharedOffset_ns()) state.clock->Expect(*offset_ns);
      Note(camera, host_time_ns, "reconnected: " + delivery.cause, out);
      break;
    case CameraDelivery::Kind::kClock:
      NoteJump(camera, state.clock->AddReading(delivery.clock), host_time_ns, out);
      break;
    case CameraDelivery::Kind::kNote:
      Note(camera, host_time_ns, delivery.cause, out);
      break;
  }
  Deliver(host_time_ns, out);
  return out;
}

// Host time minus the shared clock, as a camera says that is there or, where none is, as one has said.
std::optional<int64_t> FrameSetAssembler::SharedOffset_ns() const {
  std::optional<int64_t> said_ns;
  for (const Camera& camera : cameras_) {
    const std::optional<int64_t> offset_ns = camera.clock->offset_ns();
    if (camera.timing.own_clock || !offset_ns) continue;
    if (camera.is_connected) return offset_ns;
    said_ns = offset_ns;
  }
  return said_ns;
}

int64_t FrameSetAssembler::CommonTime_ns(const Camera& camera, int64_t device_ns) const {
  const int64_t steady_ns = camera.clock->Steady_ns(device_ns),
                own_ns = camera.clock->offset_ns().value_or(0);
  if (options_.clocks == ClockDomain::kEstimated) return steady_ns + own_ns;
  return camera.timing.own_clock ? steady_ns + own_ns - SharedOffset_ns().value_or(0) : steady_ns;
}

void FrameSetAssembler::NoteJump(size_t camera, int64_t jump_ns, int64_t host_time_ns,
                                 AssembledSets& out) const {
  if (jump_ns == 0) return;
  Note(camera, host_time_ns,
       absl::StrCat("its clock jumped by ", Seconds(jump_ns),
                    "; its frames are matched by the time before the jump"),
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
  const bool is_known = options_.clocks == ClockDomain::kShared
                            ? !camera.timing.own_clock || SharedOffset_ns()
                            : camera.clock->uncertainty_ns().value_or(0) <= options_.tolerance_ns / 2;
  camera.is_clock_known = is_known || host_time_ns - *camera.clock_since_ns >= options_.start_wait_ns;
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

void FrameSetAssembler::AddFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  if (!first_host_ns_) first_host_ns_ = host_time_ns;
  const int64_t jump_ns =
      state.clock->AddFrame(frame.device_time_ns, frame.host_time_ns, frame.device_frame_id);
  NoteJump(camera, jump_ns, frame.host_time_ns, out);
  if (!IsClockKnown(state, host_time_ns)) {
    state.unplaced_ns.push_back(frame.device_time_ns);
    if (state.unplaced_ns.size() > kMaxLosses) state.unplaced_ns.pop_front();
    return;
  }
  const int64_t time_ns = CommonTime_ns(state, frame.device_time_ns);
  NoteGap(state, frame, time_ns);
  state.last_id = frame.device_frame_id;
  if (!state.first_time_ns) state.first_time_ns = time_ns;
  state.last_time_ns = time_ns;

  if (state.own_pace) {
    state.own_pace->Add(std::move(frame), time_ns);
    return;
  }
  if (begin_ns_ && time_ns < *begin_ns_ - options_.tolerance_ns) return;
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
  if (delivery.frame.device_time_ns != 0 && state.last_id) {
    time_ns = CommonTime_ns(state, delivery.frame.device_time_ns);
  } else if (state.last_time_ns && state.last_id && delivery.frame.device_frame_id > *state.last_id) {
    time_ns = *state.last_time_ns +
              options_.period_ns * static_cast<int64_t>(delivery.frame.device_frame_id - *state.last_id);
  }
  state.losses.push_back({time_ns, delivery.cause});
  if (state.losses.size() > kMaxLosses) state.losses.pop_front();
}

bool FrameSetAssembler::IsDecided(const OpenSet& set, size_t camera) const {
  const Camera& state = cameras_[camera];
  if (set.frames.contains(camera) || !state.is_connected) return true;
  if (state.own_pace) return state.own_pace->Knows(set.time_ns);
  if (state.last_time_ns && *state.last_time_ns > set.time_ns + options_.tolerance_ns) return true;
  return std::any_of(state.losses.begin(), state.losses.end(), [&](const Loss& loss) {
    return std::abs(loss.time_ns - set.time_ns) <= options_.tolerance_ns;
  });
}

std::string FrameSetAssembler::WhyMissing(const OpenSet& set, size_t camera, bool timed_out) {
  Camera& state = cameras_[camera];
  const int64_t reach_ns = state.own_pace           ? options_.period_ns
                           : options_.period_ns > 0 ? options_.period_ns / 2
                                                    : options_.tolerance_ns;
  while (!state.losses.empty() && state.losses.front().time_ns < set.time_ns - reach_ns)
    state.losses.pop_front();
  const int64_t expected_ns = state.own_pace ? state.own_pace->Expected_ns(set.time_ns) : set.time_ns;
  for (auto loss = state.losses.begin(); loss != state.losses.end(); ++loss) {
    if (std::abs(loss->time_ns - expected_ns) > reach_ns) continue;
    std::string cause = std::move(loss->cause);
    state.losses.erase(loss);
    return cause;
  }
  if (!state.is_connected) return "the camera is disconnected";
  if (!state.unplaced_ns.empty()) return ClockCause();
  if (!state.last_time_ns) return "the camera has not delivered yet";
  if (state.own_pace && !timed_out) return "no frame of the camera, at its own pace, is near this trigger";
  const int64_t off_ns =
      *state.last_time_ns - set.time_ns;  // later than half a period it is the next trigger's
  if (off_ns > options_.tolerance_ns &&
      off_ns < (options_.period_ns > 0 ? options_.period_ns / 2 : 4 * options_.tolerance_ns)) {
    return absl::StrCat("its frame is ", Milliseconds(off_ns), " late, the tolerance is ",
                        Milliseconds(options_.tolerance_ns));
  }
  if (timed_out) return absl::StrCat("no frame within ", Milliseconds(options_.max_wait_ns));
  return "the camera took no frame at this trigger";
}

std::optional<RawFrame> FrameSetAssembler::TakeFrame(OpenSet& set, size_t camera) {
  if (cameras_[camera].own_pace) return cameras_[camera].own_pace->Take(set.time_ns);
  const auto frame = set.frames.find(camera);
  return frame != set.frames.end() ? std::optional(std::move(frame->second)) : std::nullopt;
}

void FrameSetAssembler::NoteLeftOver(size_t camera, int64_t host_time_ns, AssembledSets& out) {
  if (!cameras_[camera].own_pace) return;
  const std::string text = cameras_[camera].own_pace->TakeLeftOver();
  if (!text.empty() && last_delivered_ns_) Note(camera, host_time_ns, text, out);
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
    if (std::optional<RawFrame> frame = TakeFrame(open, camera)) {
      set.frames.push_back(*std::move(frame));
      NoteLeftOver(camera, host_time_ns, out);
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

bool FrameSetAssembler::HasBegun(int64_t host_time_ns, AssembledSets& out) {
  if (begin_ns_ || options_.start_wait_ns == 0) return true;
  int64_t begin_ns = left_out_until_ns_;
  bool all = true;
  for (const Camera& camera : cameras_) {
    begin_ns = std::max(begin_ns, camera.first_time_ns.value_or(INT64_MIN));
    all = all && (camera.first_time_ns || !camera.is_connected);
  }
  if (!all && (!first_host_ns_ || host_time_ns - *first_host_ns_ < options_.start_wait_ns)) {
    while (open_.size() > kMaxSetsBeforeBegin) LeaveOutFirst();
    return false;
  }
  while (!open_.empty() && open_.front().time_ns + options_.tolerance_ns < begin_ns) LeaveOutFirst();
  if (open_.empty()) return false;
  begin_ns_ = open_.front().time_ns;
  if (left_out_ > 0) {
    out.entries.push_back({LedgerEvent::kNote, 0, 0, *begin_ns_, host_time_ns, "",
                           absl::StrCat("the take begins when every camera delivers: ", left_out_,
                                        " triggers before that are not in it")});
  }
  return true;
}

void FrameSetAssembler::LeaveOutFirst() {
  left_out_until_ns_ = std::max(left_out_until_ns_, open_.front().time_ns + 2 * options_.tolerance_ns);
  open_.pop_front();
  ++left_out_;
}

void FrameSetAssembler::Deliver(int64_t host_time_ns, AssembledSets& out) {
  if (!HasBegun(host_time_ns, out)) return;
  while (!open_.empty()) {
    const OpenSet& first = open_.front();
    bool decided = open_.size() > kMaxOpenSets || host_time_ns - first.opened_host_ns >= options_.max_wait_ns;
    if (!decided) {
      decided = true;
      for (size_t camera = 0; camera < cameras_.size() && decided; ++camera)
        decided = IsDecided(first, camera);
    }
    if (!decided) return;
    DeliverFirst(host_time_ns, out);
  }
}

bool FrameSetAssembler::IsWaiting(int64_t before_host_ns) const {
  return std::any_of(open_.begin(), open_.end(),
                     [&](const OpenSet& set) { return set.opened_host_ns < before_host_ns; });
}

AssembledSets FrameSetAssembler::Advance(int64_t host_time_ns) {
  AssembledSets out;
  Deliver(host_time_ns, out);
  return out;
}

AssembledSets FrameSetAssembler::Finish(int64_t host_time_ns) {
  AssembledSets out;
  Deliver(host_time_ns, out);
  for (size_t camera = 0; camera < cameras_.size(); ++camera) NoteLeftOver(camera, host_time_ns, out);
  if (open_.empty()) return out;
  out.entries.push_back({LedgerEvent::kNote, 0, 0, open_.front().time_ns, host_time_ns, "",
                         absl::StrCat("the take ended while ", open_.size(),
                                      " frame sets waited for a camera: they are not in it")});
  open_.clear();
  return out;
}

}  // namespace weft

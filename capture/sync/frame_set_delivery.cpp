// Frame sets from the frames that came: which are due, what they lack and why, and what was never seen.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/sync/frame_set_assembler.h"

namespace weft {
namespace {

constexpr size_t kMaxSetsBeforeBegin = 8;          // that wait for the cameras to start
constexpr int64_t kWorstDriftDivisor = 1000;       // clocks of cameras keep to that at the very least
constexpr int64_t kCountAfter_ns = 1'000'000'000;  // a line of the ledger each time, while all are away
constexpr const char* kNoFrame = "no camera delivered a frame";

std::string TenthsOfMs(int64_t ns) { return absl::StrFormat("%.1f ms", static_cast<double>(ns) / 1e6); }
std::string SecondsText(int64_t ns) { return absl::StrFormat("%.3f s", static_cast<double>(ns) / 1e9); }

}  // namespace

bool FrameSetAssembler::IsDecided(const OpenSet& set, size_t camera) const {
  const Camera& state = cameras_[camera];
  if (set.frames.contains(camera) || !state.is_connected || state.is_hold_over) return true;
  if (!state.held.empty()) return false;
  if (state.unsynchronized) return state.unsynchronized->Knows(set.time_ns);
  if (state.last_time_ns && *state.last_time_ns > set.time_ns + options_.tolerance_ns) return true;
  return std::any_of(state.losses.begin(), state.losses.end(), [&](const Loss& loss) {
    return std::abs(loss.time_ns - set.time_ns) <= options_.tolerance_ns;
  });
}

std::string FrameSetAssembler::WhyMissing(const OpenSet& set, size_t camera, bool timed_out) {
  Camera& state = cameras_[camera];
  const int64_t reach_ns = state.unsynchronized     ? options_.period_ns
                           : options_.period_ns > 0 ? options_.period_ns / 2
                                                    : options_.tolerance_ns;
  while (!state.losses.empty() && state.losses.front().time_ns < set.time_ns - reach_ns)
    state.losses.pop_front();
  const int64_t expected_ns =
      state.unsynchronized ? state.unsynchronized->Expected_ns(set.time_ns) : set.time_ns;
  for (auto loss = state.losses.begin(); loss != state.losses.end(); ++loss) {
    if (std::abs(loss->time_ns - expected_ns) > reach_ns) continue;
    std::string cause = std::move(loss->cause);
    state.losses.erase(loss);
    return cause;
  }
  if (state.has_ended) return "the camera's source has ended";
  if (!state.is_connected) return "the camera is disconnected";
  if (state.is_silent) return "the camera does not answer: disconnected or without power";
  if (!state.unplaced_ns.empty()) return ClockCause();
  if (!state.astray_cause.empty()) return state.astray_cause;
  if (!state.last_time_ns) return "the camera has not delivered yet";
  if (state.unsynchronized && !timed_out) return "no frame of the unsynchronized camera is near this trigger";
  const int64_t off_ns =
      *state.last_time_ns - set.time_ns;  // later than half a period it is the next trigger's
  if (off_ns > options_.tolerance_ns &&
      off_ns < (options_.period_ns > 0 ? options_.period_ns / 2 : 4 * options_.tolerance_ns)) {
    return absl::StrFormat("%s late (tolerance %g ms)", TenthsOfMs(off_ns),
                           static_cast<double>(options_.tolerance_ns) / 1e6);
  }
  if (timed_out) return absl::StrCat("no frame within ", options_.max_wait_ns / 1'000'000, " ms");
  return "the camera took no frame at this trigger";
}

std::optional<RawFrame> FrameSetAssembler::TakeFrame(OpenSet& set, size_t camera) {
  if (cameras_[camera].unsynchronized) return cameras_[camera].unsynchronized->Take(set.time_ns);
  const auto frame = set.frames.find(camera);
  return frame != set.frames.end() ? std::optional(std::move(frame->second.frame)) : std::nullopt;
}

void FrameSetAssembler::NoteLeftOver(size_t camera, int64_t host_time_ns, AssembledSets& out) {
  if (!cameras_[camera].unsynchronized) return;
  const std::string text = cameras_[camera].unsynchronized->TakeLeftOver();
  if (!text.empty() && last_delivered_ns_) Note(camera, host_time_ns, text, out);
}

// Device times say how many; no more than the host's clock had room for since the first set.
uint64_t FrameSetAssembler::StepsTo(const OpenSet& open, int64_t host_time_ns, AssembledSets& out) const {
  if (!last_delivered_ns_ || options_.period_ns == 0) return 1;
  const int64_t gap_ns = open.time_ns - *last_delivered_ns_;
  const auto steps = static_cast<uint64_t>(std::max<int64_t>(
      1, std::llround(static_cast<double>(gap_ns) / static_cast<double>(options_.period_ns))));
  const int64_t elapsed_ns = std::max<int64_t>(0, open.opened_host_ns - *numbers_from_ns_);
  const int64_t room_ns = elapsed_ns + elapsed_ns / kWorstDriftDivisor + options_.max_wait_ns;
  const uint64_t last_number = first_number_ + static_cast<uint64_t>(room_ns / options_.period_ns) + 1;
  const uint64_t most = last_number > next_number_ ? last_number - next_number_ + 1 : 1;
  if (steps <= most) return steps;
  out.entries.push_back(
      {LedgerEvent::kNote, 0, 0, open.time_ns, host_time_ns, "",
       absl::StrCat("the times of the frames went on by ", SecondsText(gap_ns), ", the host's clock by ",
                    SecondsText(open.opened_host_ns - last_delivered_host_ns_),
                    ": no trigger is counted for the difference")});
  return most;
}

// The triggers up to this number, of which no camera told.
void FrameSetAssembler::AddDropped(uint64_t last, int64_t host_time_ns, const std::string& cause,
                                   AssembledSets& out) const {
  out.entries.push_back({LedgerEvent::kDropped, next_number_, last, *last_delivered_ns_ + options_.period_ns,
                         host_time_ns, "", cause});
  for (size_t camera = 0; camera < cameras_.size(); ++camera) out.lost[camera] += last + 1 - next_number_;
}

void FrameSetAssembler::DeliverFirst(int64_t host_time_ns, AssembledSets& out) {
  OpenSet open = std::move(open_.front());
  open_.pop_front();
  const uint64_t steps = StepsTo(open, host_time_ns, out);
  const uint64_t number = last_delivered_ns_ ? next_number_ + steps - 1 : next_number_;
  if (number > next_number_) AddDropped(number - 1, host_time_ns, kNoFrame, out);
  const bool timed_out = host_time_ns - open.opened_host_ns >= options_.max_wait_ns;
  last_closed_host_ns_ = host_time_ns;
  last_delivered_of_ = CamerasOf(open);
  for (const size_t camera : last_delivered_of_) NoteInStep(camera, host_time_ns, out);
  RawFrameSet set;
  set.number = number;
  set.device_time_ns = open.time_ns;
  for (size_t camera = 0; camera < cameras_.size(); ++camera) {
    if (std::optional<RawFrame> frame = TakeFrame(open, camera)) {
      set.frames.push_back(*std::move(frame));
      NoteLeftOver(camera, host_time_ns, out);
    } else {
      set.missing.push_back({camera_ids_[camera], WhyMissing(open, camera, timed_out)});
      ++out.lost[camera];
    }
  }
  next_number_ = number + 1;
  last_delivered_ns_ = open.time_ns;
  last_delivered_host_ns_ = open.opened_host_ns;
  if (!numbers_from_ns_) numbers_from_ns_ = open.opened_host_ns;
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
  for (const Camera& camera : cameras_) left_out_ = std::max(left_out_, camera.unplaced_before_begin);
  if (left_out_ > 0) {
    out.entries.push_back({LedgerEvent::kNote, 0, 0, *begin_ns_, host_time_ns, "",
                           absl::StrCat("recording began once all cameras delivered; ", left_out_,
                                        " earlier ", left_out_ == 1 ? "trigger" : "triggers", " left out")});
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
    Regroup();
    const OpenSet& first = open_.front();
    bool decided = open_.size() > kMaxOpenSets || host_time_ns - first.opened_host_ns >= options_.max_wait_ns;
    if (!decided) {
      decided = true;
      for (size_t camera = 0; camera < cameras_.size() && decided; ++camera)
        decided = IsDecided(first, camera);
    }
    if (!decided) return;
    const bool timed_out = host_time_ns - first.opened_host_ns >= options_.max_wait_ns;
    if (!LeaveAstray(timed_out, host_time_ns, out)) DeliverFirst(host_time_ns, out);
  }
}

bool FrameSetAssembler::IsWaiting(int64_t before_host_ns) const {
  return std::any_of(open_.begin(), open_.end(),
                     [&](const OpenSet& set) { return set.opened_host_ns < before_host_ns; });
}

bool FrameSetAssembler::AreAllAway() const {
  return std::all_of(cameras_.begin(), cameras_.end(),
                     [](const Camera& camera) { return !camera.is_connected || camera.is_silent; });
}

// Follows "no camera delivered a frame".
std::string FrameSetAssembler::WhyNoCamera() const {
  if (!AreAllAway()) return "";
  const auto ended =
      std::count_if(cameras_.begin(), cameras_.end(), [](const Camera& c) { return c.has_ended; });
  if (ended == 0) return ": all are disconnected";
  return static_cast<size_t>(ended) == cameras_.size() ? ": all have ended"
                                                       : ": all have ended or are disconnected";
}

void FrameSetAssembler::CountUntil(int64_t until_host_ns, int64_t host_time_ns, AssembledSets& out) {
  const int64_t triggers = (until_host_ns - last_delivered_host_ns_) / options_.period_ns;
  if (triggers < 1) return;
  const uint64_t last = next_number_ + static_cast<uint64_t>(triggers) - 1;
  AddDropped(last, host_time_ns, absl::StrCat(kNoFrame, WhyNoCamera()), out);
  next_number_ = last + 1;
  *last_delivered_ns_ += triggers * options_.period_ns;
  last_delivered_host_ns_ += triggers * options_.period_ns;
}

AssembledSets FrameSetAssembler::Advance(int64_t host_time_ns) {
  AssembledSets out;
  EndHolding(host_time_ns, out);
  Deliver(host_time_ns, out);
  // What a camera that comes back films is later than what was counted.
  const int64_t until_ns = host_time_ns - 2 * options_.period_ns - options_.tolerance_ns;
  if (options_.period_ns > 0 && last_delivered_ns_ && open_.empty() && AreAllAway() &&
      until_ns - last_delivered_host_ns_ >= kCountAfter_ns)
    CountUntil(until_ns, host_time_ns, out);
  return out;
}

AssembledSets FrameSetAssembler::Finish(int64_t host_time_ns, int64_t end_host_ns) {
  AssembledSets out;
  EndHolding(host_time_ns, out);
  Deliver(host_time_ns, out);
  for (size_t camera = 0; camera < cameras_.size(); ++camera) {
    NoteLeftOver(camera, host_time_ns, out);
    NoteInStep(camera, host_time_ns, out);
  }
  if (!open_.empty()) {
    out.entries.push_back({LedgerEvent::kNote, 0, 0, open_.front().time_ns, host_time_ns, "",
                           absl::StrCat("the take ended while ", open_.size(),
                                        " frame sets waited for a camera: they are not in it")});
    open_.clear();
  } else if (options_.period_ns > 0 && last_delivered_ns_) {
    // A frame may take max_wait_ns to come.
    const int64_t quiet_ns = end_host_ns - last_delivered_host_ns_;
    if (AreAllAway() || quiet_ns > options_.max_wait_ns + options_.period_ns)
      CountUntil(end_host_ns, host_time_ns, out);
  }
  return out;
}

}  // namespace weft

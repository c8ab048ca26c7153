// Frames whose times cannot be right: held while their camera's clock is in doubt, set aside where they
// contradict the other cameras.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/sync/frame_set_assembler.h"

namespace weft {
namespace {

constexpr size_t kMostHeld = 64;
constexpr int64_t kHoldDivisor = 4;       // of the longest wait: the held ones still find their sets open
constexpr int64_t kRecentPeriods = 3;     // a camera that delivered since then goes on
constexpr int64_t kPeriodsThatHold = 10;  // over which the nominal rate tells the triggers' times
constexpr int kAstrayBeforeSetAside =
    1;  // sets: a frame off the others' time is kept, where clocks are sound

std::string InMilliseconds(int64_t ns) { return absl::StrFormat("%.1f ms", static_cast<double>(ns) / 1e6); }

}  // namespace

void FrameSetAssembler::PlaceHeld(size_t camera, int64_t host_time_ns, AssembledSets& out, int64_t jump_ns) {
  Camera& state = cameras_[camera];
  state.is_hold_over = false;
  for (std::deque<RawFrame> held = std::exchange(state.held, {}); !held.empty(); held.pop_front()) {
    const bool is_before = held.front().device_frame_id < state.clock->jumped_since_id();
    PlaceFrame(camera, std::move(held.front()), host_time_ns, out, is_before ? jump_ns : 0);
  }
}

// Frames that came after a jump and before it was known are in sets of other triggers.
void FrameSetAssembler::PlaceAnew(size_t camera, int64_t host_time_ns, AssembledSets& out) {
  std::vector<RawFrame> misplaced;
  for (OpenSet& set : open_) {
    const auto own = set.frames.find(camera);
    if (own == set.frames.end() ||
        own->second.frame.device_frame_id < cameras_[camera].clock->jumped_since_id())
      continue;
    misplaced.push_back(std::move(own->second.frame));
    set.frames.erase(own);
  }
  std::erase_if(open_, [](const OpenSet& set) { return set.frames.empty(); });
  for (RawFrame& frame : misplaced) {
    const int64_t time_ns = CommonTime_ns(cameras_[camera], frame.device_time_ns);
    if (last_delivered_ns_ && time_ns <= *last_delivered_ns_ + options_.tolerance_ns) {
      NoteAfterClosing(camera, frame.device_frame_id, host_time_ns, out);
    } else {
      PutIntoSet(camera, {std::move(frame), time_ns}, host_time_ns);
    }
  }
}

// Late frames count as held up, and are placed. Those whose times are wrong belong to no set.
void FrameSetAssembler::EndHolding(int64_t host_time_ns, AssembledSets& out) {
  for (size_t camera = 0; camera < cameras_.size(); ++camera) {
    Camera& state = cameras_[camera];
    const bool is_due = host_time_ns - state.held_since_ns >= options_.max_wait_ns / kHoldDivisor ||
                        state.held.size() > kMostHeld || state.is_hold_over;
    if (state.held.empty() || !is_due) continue;
    if (!state.clock->AreTimesWrong()) {
      state.clock->EndDoubt();
      PlaceHeld(camera, host_time_ns, out);
      continue;
    }
    state.is_hold_over = true;
    for (; !state.held.empty(); state.held.pop_front())
      Quarantine(camera, host_time_ns, "the times of its frames contradict their arrival", host_time_ns, out);
  }
}

void FrameSetAssembler::Quarantine(size_t camera, int64_t time_ns, const std::string& cause,
                                   int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  ++state.set_aside;
  if (state.astray_cause.empty()) Note(camera, host_time_ns, cause + "; they are set aside", out);
  state.astray_cause = cause;
  state.losses.push_back({time_ns, cause});
}

// A frame of the camera is in a set with the others, or the take ends.
void FrameSetAssembler::NoteInStep(size_t camera, int64_t host_time_ns, AssembledSets& out) {
  Camera& state = cameras_[camera];
  if (const uint64_t count = std::exchange(state.closed_before, 0); count > 1)
    Note(camera, host_time_ns,
         absl::StrCat("frames ", state.closed_first_id, " to ", state.closed_last_id, " (", count,
                      ") came after their sets were closed"),
         out);
  if (const uint64_t count = std::exchange(state.set_aside, 0); count > 1)
    Note(camera, host_time_ns, absl::StrCat(count, " of its frames were set aside"), out);
  state.astray_cause.clear();
  if (last_delivered_of_.size() > 1 || cameras_.size() == 1) state.astray = 0;
}

void FrameSetAssembler::NoteAfterClosing(size_t camera, uint64_t id, int64_t host_time_ns,
                                         AssembledSets& out) {
  Camera& state = cameras_[camera];
  state.closed_last_id = id;
  if (state.closed_before++ > 0) return;
  state.closed_first_id = id;
  Note(camera, host_time_ns,
       absl::StrFormat("frame %d came %.3f ms after its set was closed", id,
                       static_cast<double>(host_time_ns - last_closed_host_ns_) / 1e6),
       out);
}

// More cameras than it has are on their way to its time, and deliver all the while.
bool FrameSetAssembler::IsAhead(const OpenSet& set, int64_t host_time_ns) const {
  const int64_t recent_ns = std::max(options_.max_wait_ns, kRecentPeriods * options_.period_ns);
  size_t behind = 0;
  for (size_t camera = 0; camera < cameras_.size(); ++camera) {
    const Camera& state = cameras_[camera];
    if (set.frames.contains(camera) || state.unsynchronized || !state.is_connected || !state.last_time_ns)
      continue;
    behind += *state.last_time_ns < set.time_ns - options_.tolerance_ns &&
              host_time_ns - *state.last_host_ns <= recent_ns;
  }
  return behind > set.frames.size();
}

std::set<size_t> FrameSetAssembler::CamerasOf(const OpenSet& set) {
  std::set<size_t> cameras;
  for (const auto& [camera, _] : set.frames) cameras.insert(camera);
  return cameras;
}

// A set of more other cameras is nearer than two triggers are.
bool FrameSetAssembler::IsBetweenTriggers(const OpenSet& set) const {
  const auto outvotes = [&](int64_t time_ns, const std::set<size_t>& cameras) {
    const auto others =
        std::count_if(cameras.begin(), cameras.end(), [&](size_t c) { return !set.frames.contains(c); });
    return std::abs(time_ns - set.time_ns) < options_.period_ns / 4 * 3 &&
           static_cast<size_t>(others) > set.frames.size();
  };
  if (last_delivered_ns_ && outvotes(*last_delivered_ns_, last_delivered_of_)) return true;
  return std::any_of(open_.begin(), open_.end(), [&](const OpenSet& other) {
    return &other != &set && outvotes(other.time_ns, CamerasOf(other));
  });
}

std::string FrameSetAssembler::WhyAstray(const OpenSet& set, bool is_ahead) const {
  std::optional<int64_t> others_ns;  // the nearest time that more cameras have
  const auto look = [&](int64_t time_ns) {
    if (!others_ns || std::abs(time_ns - set.time_ns) < std::abs(*others_ns - set.time_ns))
      others_ns = time_ns;
  };
  for (size_t camera = 0; camera < cameras_.size() && is_ahead; ++camera)
    if (!set.frames.contains(camera) && cameras_[camera].last_time_ns) look(*cameras_[camera].last_time_ns);
  if (!is_ahead && last_delivered_ns_) look(*last_delivered_ns_);
  for (const OpenSet& other : open_)
    if (!is_ahead && &other != &set) look(other.time_ns);
  const int64_t off_ns = set.time_ns - others_ns.value_or(set.time_ns);
  return absl::StrCat("its frames are ", InMilliseconds(std::abs(off_ns)), off_ns > 0 ? " after" : " before",
                      " those of the other cameras");
}

// Frames that were set aside before, and are still not at a trigger of the others.
bool FrameSetAssembler::IsStillOff(const OpenSet& set) const {
  if (!last_delivered_ns_ || last_delivered_of_.size() <= set.frames.size()) return false;
  const int64_t since_ns = set.time_ns - *last_delivered_ns_;
  const int64_t off_ns =
      since_ns - (since_ns + options_.period_ns / 2) / options_.period_ns * options_.period_ns;
  return std::abs(off_ns) > options_.tolerance_ns && since_ns < kPeriodsThatHold * options_.period_ns &&
         std::all_of(set.frames.begin(), set.frames.end(),
                     [&](const auto& frame) { return !cameras_[frame.first].astray_cause.empty(); });
}

// Where two sets reach for the same frame, the one of more cameras has it: a camera that is off takes none
// of the others along.
void FrameSetAssembler::Regroup() {
  for (size_t i = 1; i < open_.size(); ++i) {
    OpenSet* few = &open_.front();
    OpenSet* many = &open_[i];
    if (many->time_ns - few->time_ns > 2 * options_.tolerance_ns) return;
    const bool is_first_of_few = many->frames.size() >= few->frames.size();
    if (!is_first_of_few) std::swap(few, many);
    std::erase_if(few->frames, [&](auto& entry) {
      auto& [camera, timed] = entry;
      const bool fits = std::abs(timed.time_ns - many->time_ns) <= options_.tolerance_ns;
      return fits && many->frames.try_emplace(camera, std::move(timed)).second;
    });
    if (!few->frames.empty()) continue;
    open_.erase(open_.begin() + (is_first_of_few ? 0 : static_cast<ptrdiff_t>(i)));
    i = 0;
  }
}

bool FrameSetAssembler::LeaveAstray(bool timed_out, int64_t host_time_ns, AssembledSets& out) {
  const OpenSet& set = open_.front();
  const bool is_ahead = timed_out && IsAhead(set, host_time_ns);
  const bool is_off = options_.period_ns > 0 && (IsBetweenTriggers(set) || IsStillOff(set));
  if (!is_ahead && !is_off) return false;
  bool is_first = !is_ahead;
  for (const auto& [camera, _] : set.frames) {
    is_first = is_first && cameras_[camera].astray < kAstrayBeforeSetAside && !cameras_[camera].has_jumped &&
               !cameras_[camera].clock->IsUneven();
    ++cameras_[camera].astray;
  }
  if (is_first) return false;
  const std::string cause = WhyAstray(set, is_ahead);
  for (const auto& [camera, _] : set.frames) Quarantine(camera, set.time_ns, cause, host_time_ns, out);
  open_.pop_front();
  return true;
}

}  // namespace weft

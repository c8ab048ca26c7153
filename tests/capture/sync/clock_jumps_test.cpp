// A camera's clock jumps while others film: it is named, and it alone loses frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/sync/frame_set_assembler.h"

namespace weft {
namespace {

constexpr int64_t kMilli = 1'000'000;
constexpr int64_t kSecond = 1000 * kMilli;
constexpr int64_t kBegin_ns = int64_t{1'700'000'000} * kSecond;

struct Jump {
  size_t camera = 0;
  int64_t at_ns = 0;  // since the beginning
  int64_t by_ns = 0;
};

struct Room {
  size_t cameras = 4;
  int64_t period_ns = 100 * kMilli;
  int64_t length_ns = 6 * kSecond;
  ClockDomain clocks = ClockDomain::kShared;
  bool has_readings = true;
  // False: triggers come from outside, and the jump changes times alone. True: frames are taken when the
  // camera's own clock says; it repeats what it has done, or catches up on what it has not.
  bool follows_clock = false;
  int64_t latency_ns = 3 * kMilli, scatter_ns = kMilli;
  int64_t stall_ns = 0;  // arrivals are held up by up to so much, in rushes
  double drift_ppm = 0;  // of estimated clocks, up to
  std::vector<Jump> jumps;
  unsigned seed = 0;
};

std::string Describe(const Room& room) {
  std::string text = absl::StrFormat(
      "%d cameras, period %d ms, %s, %s, %s, latency %d ms, stalls %d ms, seed %d:", room.cameras,
      room.period_ns / kMilli, room.clocks == ClockDomain::kShared ? "shared" : "estimated",
      room.has_readings ? "readings" : "arrivals",
      room.follows_clock ? "frames follow the clock" : "triggered", room.latency_ns / kMilli,
      room.stall_ns / kMilli, room.seed);
  for (const Jump& jump : room.jumps)
    absl::StrAppendFormat(&text, " c%02d at %d by %d ms", jump.camera, jump.at_ns / kMilli,
                          jump.by_ns / kMilli);
  return text;
}

struct Event {
  int64_t host_ns = 0;
  uint64_t order = 0;
  size_t camera = 0;
  CameraDelivery delivery;
  bool operator<(const Event& other) const {
    return std::pair(host_ns, order) > std::pair(other.host_ns, other.order);
  }
};

class Film {
 public:
  explicit Film(const Room& room) : room_(room), random_(room.seed) {
    for (size_t i = 0; i < room.cameras; ++i) {
      ids_.push_back(absl::StrFormat("c%02d", i));
      const bool own = room.clocks == ClockDomain::kEstimated;
      offset_ns_.push_back(own ? static_cast<int64_t>(random_() % 100'000) * kMilli : 0);
      drift_ppm_.push_back(own ? room.drift_ppm * (static_cast<double>(random_() % 2001) / 1000 - 1) : 0);
    }
    FrameSetOptions options;
    options.period_ns = room.period_ns;
    options.tolerance_ns = std::min(2 * kMilli, room.period_ns / 5);
    options.clocks = room.clocks;
    options.start_wait_ns = 5 * kSecond;
    if (!room.has_readings) options.tolerance_ns = std::min(8 * kMilli, room.period_ns / 3);
    tolerance_ns_ = options.tolerance_ns;
    assembler_ = std::make_unique<FrameSetAssembler>(ids_, options);
    for (size_t i = 0; i < room.cameras; ++i) Schedule(i);
    Run();
  }

  const std::vector<RawFrameSet>& sets() const { return sets_; }
  std::string NotesOf(size_t camera) const {
    std::string notes;
    for (const LedgerEntry& entry : entries_)
      if (entry.event == LedgerEvent::kNote && entry.camera_id == ids_[camera])
        absl::StrAppend(&notes, entry.cause, "\n");
    return notes;
  }
  const std::vector<LedgerEntry>& entries() const { return entries_; }
  const std::vector<std::string>& ids() const { return ids_; }
  int64_t TrueTime_ns(const RawFrame& frame) const {
    return true_ns_.at({frame.camera_id, frame.device_frame_id});
  }
  int64_t tolerance_ns() const { return tolerance_ns_; }

 private:
  int64_t Jumped_ns(size_t camera, int64_t host_ns) const {
    int64_t by_ns = 0;
    for (const Jump& jump : room_.jumps)
      if (jump.camera == camera && host_ns - kBegin_ns >= jump.at_ns) by_ns += jump.by_ns;
    return by_ns;
  }
  int64_t Device_ns(size_t camera, int64_t host_ns) const {
    return host_ns + offset_ns_[camera] + Jumped_ns(camera, host_ns) +
           std::llround(1e-6 * drift_ppm_[camera] * static_cast<double>(host_ns - kBegin_ns));
  }
  void Schedule(size_t camera) {
    int64_t busy_ns = 0, arrived_ns = 0;
    uint64_t id = 1;
    const auto film = [&](int64_t taken_ns, int64_t device_ns) {
      CameraDelivery delivery;
      delivery.frame.camera_id = ids_[camera];
      delivery.frame.device_frame_id = id;
      delivery.frame.device_time_ns = device_ns;
      int64_t host_ns = taken_ns + room_.latency_ns + static_cast<int64_t>(random_() % room_.scatter_ns);
      if (room_.stall_ns > 0 && random_() % 40 == 0)
        busy_ns = host_ns + static_cast<int64_t>(random_() % room_.stall_ns);
      host_ns = std::max({host_ns, busy_ns, arrived_ns + 1000});
      arrived_ns = delivery.frame.host_time_ns = host_ns;
      true_ns_[{ids_[camera], id++}] = taken_ns;
      events_.push({host_ns, order_++, camera, std::move(delivery)});
    };
    const int64_t begin_ns = kBegin_ns / room_.period_ns * room_.period_ns + room_.period_ns;
    if (room_.follows_clock) {
      int64_t next_ns = begin_ns;  // by its clock, which is the host's before the jump
      for (int64_t host_ns = kBegin_ns; host_ns < kBegin_ns + room_.length_ns; host_ns += kMilli)
        for (; next_ns <= host_ns + Jumped_ns(camera, host_ns); next_ns += room_.period_ns)
          film(host_ns - host_ns % kMilli, next_ns + offset_ns_[camera]);
    } else {
      for (int64_t taken_ns = begin_ns; taken_ns < kBegin_ns + room_.length_ns; taken_ns += room_.period_ns)
        film(taken_ns, Device_ns(camera, taken_ns) + static_cast<int64_t>(random_() % 20'000) - 10'000);
    }
    if (!room_.has_readings) return;
    for (int64_t host_ns = kBegin_ns + static_cast<int64_t>(random_() % 1000) * kMilli / 100;
         host_ns < kBegin_ns + room_.length_ns; host_ns += kSecond)
      AddReading(camera, host_ns);
  }
  void AddReading(size_t camera, int64_t host_ns) {
    CameraDelivery delivery;
    delivery.kind = CameraDelivery::Kind::kClock;
    const int64_t half_ns = 50'000 + static_cast<int64_t>(random_() % 300'000);
    const int64_t error_ns = static_cast<int64_t>(random_() % (2 * half_ns)) - half_ns;
    delivery.clock = {host_ns, Device_ns(camera, host_ns) - host_ns + error_ns, half_ns, "", {}};
    events_.push({host_ns + half_ns, order_++, camera, std::move(delivery)});
  }
  void Collect(AssembledSets out) {
    for (RawFrameSet& set : out.sets) sets_.push_back(std::move(set));
    for (LedgerEntry& entry : out.entries) entries_.push_back(std::move(entry));
  }
  void Run() {
    int64_t tick_ns = kBegin_ns, now_ns = kBegin_ns;
    std::map<size_t, int64_t> asked_ns;
    while (!events_.empty()) {
      Event event = events_.top();
      events_.pop();
      now_ns = event.host_ns;
      for (; tick_ns < now_ns; tick_ns += 50 * kMilli) Collect(assembler_->Advance(tick_ns));
      Collect(assembler_->Add(event.camera, std::move(event.delivery), now_ns));
      if (assembler_->WantsReading(event.camera) && now_ns - asked_ns[event.camera] > 100 * kMilli) {
        asked_ns[event.camera] = now_ns;
        AddReading(event.camera, now_ns + 2 * kMilli);
      }
    }
    for (int i = 0; i < 20; ++i) Collect(assembler_->Advance(now_ns += 50 * kMilli));
    Collect(assembler_->Finish(now_ns, kBegin_ns + room_.length_ns));
  }

  const Room room_;
  std::mt19937 random_;
  std::vector<std::string> ids_;
  std::vector<int64_t> offset_ns_;
  std::vector<double> drift_ppm_;
  int64_t tolerance_ns_ = 0;
  uint64_t order_ = 0;
  std::priority_queue<Event> events_;
  std::map<std::pair<std::string, uint64_t>, int64_t> true_ns_;
  std::unique_ptr<FrameSetAssembler> assembler_;
  std::vector<RawFrameSet> sets_;
  std::vector<LedgerEntry> entries_;
};

// The jump that the notes name, in ns; nothing where they name none.
std::vector<double> NamedJumps_ms(const std::string& notes) {
  std::vector<double> found;
  const std::string words = "its clock jumped by ";
  for (size_t at = notes.find(words); at != std::string::npos; at = notes.find(words, at + 1))
    found.push_back(1e3 * std::stod(notes.substr(at + words.size())));
  return found;
}

// A frame that the jump of a clock set off was taken between two triggers, and nothing says when.
bool IsOfTheJump(const RawFrame& frame, const Film& film, const Room& room) {
  return room.follows_clock && std::any_of(room.jumps.begin(), room.jumps.end(), [&](const Jump& jump) {
           return frame.camera_id == film.ids()[jump.camera] &&
                  std::abs(film.TrueTime_ns(frame) - kBegin_ns - jump.at_ns) <= kMilli;
         });
}

// What must hold whatever jumps: who is innocent loses nothing, and no set has frames of two moments.
void ExpectInnocentsWhole(const Film& film, const Room& room) {
  std::set<size_t> guilty;
  for (const Jump& jump : room.jumps) guilty.insert(jump.camera);
  std::map<std::string, std::string> missing;
  std::set<uint64_t> numbers;
  int64_t worst_ns = 0;
  for (const RawFrameSet& set : film.sets()) {
    numbers.insert(set.number);
    // At the very end a camera that is off may take a frame for a trigger that no other reaches.
    for (const MissingFrame& one :
         set.number == film.sets().back().number ? std::vector<MissingFrame>() : set.missing)
      absl::StrAppend(&missing[one.camera_id], set.number, ": ", one.reason, "\n");
    std::vector<int64_t> times_ns;
    for (const RawFrame& frame : set.frames)
      if (!IsOfTheJump(frame, film, room)) times_ns.push_back(film.TrueTime_ns(frame));
    const auto [least, most] = std::minmax_element(times_ns.begin(), times_ns.end());
    if (!times_ns.empty()) worst_ns = std::max(worst_ns, *most - *least);
  }
  for (size_t camera = 0; camera < room.cameras; ++camera) {
    if (guilty.contains(camera)) continue;
    ASSERT_EQ(missing[film.ids()[camera]] + film.NotesOf(camera), "") << "camera " << camera;
  }
  EXPECT_LE(worst_ns, film.tolerance_ns() + kMilli);
  for (const LedgerEntry& entry : film.entries())
    EXPECT_NE(entry.event, LedgerEvent::kDropped) << entry.cause;
  const auto triggers = static_cast<double>(room.length_ns / room.period_ns);
  // Without readings ten arrivals of each tell of its clock.
  EXPECT_GE(static_cast<double>(numbers.size()), triggers - (room.has_readings ? 0 : 11) - 2 -
                                                     500.0 * kMilli / static_cast<double>(room.period_ns));
  EXPECT_LE(static_cast<double>(numbers.size()), triggers);
}

void ExpectNamed(const Film& film, const Jump& jump) {
  const std::vector<double> named_ms = NamedJumps_ms(film.NotesOf(jump.camera));
  ASSERT_EQ(named_ms.size(), 1u) << film.NotesOf(jump.camera);
  EXPECT_NEAR(named_ms[0], static_cast<double>(jump.by_ns) / kMilli, 2);
}

Room RandomRoom(unsigned seed) {
  std::mt19937 random(seed);
  const auto up_to = [&](int64_t n) { return static_cast<int64_t>(random() % static_cast<uint64_t>(n)); };
  Room room;
  room.seed = seed;
  room.cameras = 3 + static_cast<size_t>(up_to(14));
  const int64_t fps[] = {10, 25, 30, 60};
  room.period_ns = kSecond / fps[up_to(4)];
  room.clocks = up_to(2) == 0 ? ClockDomain::kShared : ClockDomain::kEstimated;
  room.latency_ns = kMilli + up_to(30 * kMilli);
  room.drift_ppm = 40;
  const double size = std::exp(std::log(20.0) + static_cast<double>(up_to(1000)) / 1000 * std::log(100.0));
  room.jumps = {{static_cast<size_t>(up_to(static_cast<int64_t>(room.cameras))),
                 2 * kSecond + up_to(2 * kSecond), std::llround(size * kMilli) * (up_to(2) == 0 ? 1 : -1)}};
  return room;
}

TEST(ClockJumps, CostTheCameraThatJumpedAlone) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Room room = RandomRoom(seed);
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    ExpectNamed(film, room.jumps[0]);
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, CostTheCameraAloneWhereItsFramesFollowItsClock) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Room room = RandomRoom(seed);
    room.follows_clock = true;
    room.drift_ppm = 0;
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    ExpectNamed(film, room.jumps[0]);
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, CostTheCameraAloneWhereNoClockIsRead) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    Room room = RandomRoom(seed);
    room.has_readings = false;
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    ExpectNamed(film, room.jumps[0]);
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, CostTheCameraAloneWhereFramesAreHeldUpOnTheirWay) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    Room room = RandomRoom(seed);
    room.stall_ns = 150 * kMilli;
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    ExpectNamed(film, room.jumps[0]);
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, OfTwoCamerasAtOnceCostThoseTwo) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    Room room = RandomRoom(seed);
    room.cameras += 2;
    room.jumps.push_back(RandomRoom(seed + 1000).jumps[0]);
    room.jumps[1].camera = (room.jumps[0].camera + 1) % room.cameras;
    room.jumps[1].at_ns = room.jumps[0].at_ns;
    if (seed % 3 == 0) room.jumps[1].by_ns = room.jumps[0].by_ns;
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    for (const Jump& jump : room.jumps) ExpectNamed(film, jump);
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, OfAllCamerasAtOnceCostNothing) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Room room = RandomRoom(seed);
    const Jump jump = room.jumps[0];
    room.jumps.clear();
    for (size_t camera = 0; camera < room.cameras; ++camera)
      room.jumps.push_back({camera, jump.at_ns, jump.by_ns});
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    for (const Jump& one : room.jumps) ExpectNamed(film, one);
    for (const RawFrameSet& set : film.sets()) EXPECT_EQ(set.frames.size(), room.cameras) << set.number;
    if (HasFailure()) FAIL();
  }
}

// A counter of 32 bits of nanoseconds begins anew every 4.3 s.
TEST(ClockJumps, OfCountersThatBeginAnewCostNothing) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Room room = RandomRoom(seed);
    room.length_ns = 10 * kSecond;
    constexpr int64_t kWrap_ns = int64_t{1} << 32;
    const size_t camera = room.jumps[0].camera;
    room.jumps = {{camera, 2 * kSecond, -kWrap_ns}, {camera, 2 * kSecond + kWrap_ns, -kWrap_ns}};
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    EXPECT_EQ(NamedJumps_ms(film.NotesOf(camera)).size(), 2u) << film.NotesOf(camera);
    for (const RawFrameSet& set : film.sets()) EXPECT_EQ(set.frames.size(), room.cameras) << set.number;
    if (HasFailure()) FAIL();
  }
}

TEST(ClockJumps, AreNotSeenInClocksThatDriftOrInFramesThatAreHeldUp) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Room room = RandomRoom(seed);
    room.jumps.clear();
    room.length_ns = 20 * kSecond;
    room.has_readings = seed % 2 == 0;
    room.drift_ppm = room.has_readings ? 500 : 50;  // as a host whose own clock is being slewed
    room.stall_ns = seed % 4 < 2 ? 0 : 150 * kMilli;
    SCOPED_TRACE(Describe(room));
    const Film film(room);
    ExpectInnocentsWhole(film, room);
    if (HasFailure()) FAIL();
  }
}

}  // namespace
}  // namespace weft

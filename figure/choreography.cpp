#include "figure/choreography.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/angles.h"
#include "base/counter_random.h"

namespace weft {
namespace {

// Smooth from 0 to 1, at rest at both ends.
double Ease(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// What the seed decides: `k` numbers one use.
struct Whims {
  uint64_t key;
  double Phase(uint64_t k) const { return kTurn * UniformOf(key, 3 * k); }
  double Size(uint64_t k) const { return 0.85 + 0.3 * UniformOf(key, 3 * k + 1); }
  double Uniform(uint64_t k) const { return UniformOf(key, 3 * k + 2); }
};

using enum JointAngle;

constexpr std::array<BodySide, 2> kSides = {BodySide::kLeft, BodySide::kRight};

BodyMoment Stand(double t, const Whims& w) {
  BodyMoment out;
  const auto sway = [&](double size, double period_s, uint64_t k) {
    return size * w.Size(k) * std::sin(kTurn * t / period_s + w.Phase(k));
  };
  out.angles.Of(kSpineTwist) += sway(2, 4.7, 0);
  out.angles.Of(kChestTwist) += sway(2, 5.9, 1);
  out.angles.Of(kSpineLean) += sway(1.2, 3.9, 2);
  out.angles.Of(kSpineSide) += sway(1.5, 5.3, 3);
  out.angles.Of(kHeadTurn) += sway(9, 6.1, 4);
  out.angles.Of(kHeadNod) += sway(4, 4.3, 5);
  out.angles.Of(kChestLean) += sway(0.8, 3.4, 6);
  for (const BodySide side : kSides) {
    const uint64_t k = 7 + 3 * static_cast<uint64_t>(side);
    out.angles.Of(kArmOut, side) += sway(5, 4.1, k) - 8;
    out.angles.Of(kArmForward, side) += sway(5, 5.1, k + 1);
    out.angles.Of(kElbow, side) += sway(6, 3.7, k + 2);
  }
  return out;
}

BodyMoment Twist(double t, const Whims& w) {
  BodyMoment out;
  const double swing = std::sin(kTurn * t / (2.6 * w.Size(0)) + w.Phase(0));
  out.angles.Of(kSpineTwist) = 13 * w.Size(1) * swing;
  out.angles.Of(kChestTwist) = 19 * w.Size(1) * swing;
  out.angles.Of(kPelvisTurn) = 6 * swing;
  out.angles.Of(kSpineLean) = 4 * std::sin(kTurn * t / 3.7 + w.Phase(2));
  for (const BodySide side : kSides) {
    out.angles.Of(kArmOut, side) = 52 * w.Size(3);
    out.angles.Of(kArmForward, side) = (side == BodySide::kLeft ? 12 : -12) * swing;
  }
  return out;
}

BodyMoment Jog(double t, const Whims& w) {
  BodyMoment out;
  const double stride = kTurn * t * 1.25 * w.Size(0) + w.Phase(0), swing = std::sin(stride);
  const double size = w.Size(1);
  out.lift_mm = 40 * size * std::cos(stride) * std::cos(stride);
  out.angles.Of(kSpineLean) = 6;
  out.angles.Of(kChestTwist) = 9 * size * swing;
  out.angles.Of(kPelvisTurn) = -4 * swing;
  for (const BodySide side : kSides) {
    const double sign = side == BodySide::kLeft ? 1 : -1;
    out.angles.Of(kArmOut, side) = 30 * w.Size(2);
    out.angles.Of(kArmForward, side) = sign * 32 * size * swing;
    out.angles.Of(kElbow, side) = 80 * w.Size(3) + sign * 8 * swing;
    out.angles.Of(kLegForward, side) = 8 - sign * 32 * size * swing;
    out.angles.Of(kKnee, side) = 35 + 30 * sign * std::cos(stride);
  }
  return out;
}

BodyMoment Walk(double t, const Whims& w) {
  BodyMoment out;
  const double stride = kTurn * t * 0.9 * w.Size(0) + w.Phase(0), swing = std::sin(stride);
  const double size = w.Size(1);
  out.angles.Of(kPelvisTurn) = -6 * size * swing;
  out.angles.Of(kPelvisList) = 3 * size * std::cos(stride);
  out.angles.Of(kSpineLean) = 3;
  out.angles.Of(kSpineTwist) = 3 * size * swing;
  out.angles.Of(kChestTwist) = 8 * size * swing;
  out.angles.Of(kHeadTurn) = 6 * std::sin(kTurn * t / 5.2 + w.Phase(2));
  for (const BodySide side : kSides) {
    const double sign = side == BodySide::kLeft ? 1 : -1;
    out.angles.Of(kArmOut, side) = 20 * w.Size(3);
    out.angles.Of(kArmForward, side) = sign * 24 * size * swing;
    out.angles.Of(kElbow, side) = 22 + sign * 10 * swing;
    out.angles.Of(kLegForward, side) = 4 - sign * 24 * size * swing;
    // The knee bends while its leg swings forwards.
    const double forwards = std::max(0.0, sign * -std::cos(stride));
    out.angles.Of(kKnee, side) = 6 + 46 * size * forwards * forwards;
  }
  return out;
}

// One arm at a time, in rounds.
BodyMoment Wave(double t, const Whims& w) {
  BodyMoment out = Stand(t, w);
  constexpr double kRoundS = 3.4;
  const double round = std::floor(t / kRoundS), since = t - kRoundS * round;
  const Whims own = {MixBits(w.key + static_cast<uint64_t>(round))};
  const double raised = Ease(since / 0.9) - Ease((since - 2.5) / 0.9);
  const BodySide side = own.Uniform(0) < 0.5 ? BodySide::kLeft : BodySide::kRight;
  const double to_and_fro = std::sin(kTurn * since * 1.5 * own.Size(0));
  const auto to = [&](JointAngle angle, double goal) {
    double& value = out.angles.Of(angle, side);
    value += raised * (goal - value);
  };
  to(kArmOut, 98 * own.Size(1)), to(kArmForward, 22), to(kClavicleRaise, 16);
  to(kElbow, 62 + 26 * to_and_fro), to(kArmInward, -20);
  out.angles.Of(kChestSide) += raised * (side == BodySide::kLeft ? 5 : -5);
  return out;
}

BodyMoment Squat(double t, const Whims& w) {
  BodyMoment out;
  const double period_s = 2.9 * w.Size(0);
  const double depth = w.Size(1) * 0.45 * (1 - std::cos(kTurn * t / period_s));
  out.angles.Of(kPelvisTilt) = 36 * depth;
  out.angles.Of(kSpineLean) = 14 * depth;
  out.angles.Of(kChestTwist) = 4 * std::sin(kTurn * t / 3.3 + w.Phase(2));
  for (const BodySide side : kSides) {
    out.angles.Of(kLegForward, side) = 96 * depth, out.angles.Of(kLegOut, side) = 4 + 12 * depth;
    out.angles.Of(kKnee, side) = 115 * depth;
    out.angles.Of(kArmForward, side) = 72 * w.Size(3) * depth;
    out.angles.Of(kArmOut, side) = 26 - 8 * depth, out.angles.Of(kElbow, side) = 14 + 20 * depth;
  }
  return out;
}

// Up, across the body, or with the hand before the chest; one arm at a time, in rounds.
BodyMoment Reach(double t, const Whims& w) {
  BodyMoment out = Stand(t, w);
  constexpr double kRoundS = 3;
  const double round = std::floor(t / kRoundS), since = t - kRoundS * round;
  const Whims own = {MixBits(w.key + 77 + static_cast<uint64_t>(round))};
  const double there = Ease(since / 1.1) - Ease((since - 1.9) / 1.1);
  const BodySide side = own.Uniform(0) < 0.5 ? BodySide::kLeft : BodySide::kRight;
  const double inwards = side == BodySide::kLeft ? -1 : 1;  // sense of a twist that brings the arm forwards
  const auto to = [&](JointAngle angle, double goal) {
    double& value = out.angles.Of(angle, side);
    value += there * (goal - value);
  };
  // Every third round shows the hand before the shirt.
  const int what = static_cast<int>(std::fmod(round + std::floor(3 * w.Uniform(9)), 3));
  if (what == 0) {
    to(kArmForward, 132 * own.Size(1)), to(kArmOut, 20), to(kElbow, 12), to(kClavicleRaise, 22);
    out.angles.Of(kChestSide) += there * (side == BodySide::kLeft ? 8 : -8);
  } else if (what == 1) {
    to(kArmForward, 78 * own.Size(1)), to(kArmOut, 8), to(kArmInward, 30), to(kElbow, 35);
    to(kClavicleForward, 16);
    out.angles.Of(kChestTwist) += there * inwards * 17 * own.Size(2);
    out.angles.Of(kSpineLean) += there * 10;
  } else {
    to(kArmForward, 46 * own.Size(1)), to(kArmOut, 24), to(kArmInward, 42), to(kElbow, 92 * own.Size(2));
    out.angles.Of(kHeadNod) += there * 12;
  }
  return out;
}

// An angle that goes from one random value to the next, never faster than its joint does.
class Track {
 public:
  Track(const AngleLimit& limit, double natural, double spread, double seconds, uint64_t key) {
    times_s_.push_back(0), values_.push_back(natural);
    for (uint64_t k = 0; times_s_.back() < seconds; ++k) {
      const double goal = natural + spread * NormalOf(key, 2 * k);
      const double value = std::clamp(goal, limit.low_deg, limit.high_deg);
      const double pause = 0.5 + 0.9 * UniformOf(key, 2 * k + 1);
      // Ease is 1.5 times as fast in its middle as in the mean.
      const double least = 1.5 * std::abs(value - values_.back()) / limit.fastest_deg_s;
      times_s_.push_back(times_s_.back() + std::max(pause, 1.6 * least));
      values_.push_back(value);
    }
  }

  double At(double t) const {
    const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), t) - times_s_.begin();
    const auto k = static_cast<size_t>(std::clamp<std::ptrdiff_t>(after, 1, std::ssize(times_s_) - 1));
    const double share = Ease((t - times_s_[k - 1]) / (times_s_[k] - times_s_[k - 1]));
    return values_[k - 1] + share * (values_[k] - values_[k - 1]);
  }

 private:
  std::vector<double> times_s_, values_;
};

// By how much random poses differ, one standard deviation in degrees.
double SpreadOf(size_t index, const AngleLimit& limit) {
  const auto angle = static_cast<JointAngle>(index < kOneSidedAngles ? index : index - kSideAngles);
  const bool bears_weight = angle >= kLegForward || angle <= kPelvisList;
  return (bears_weight ? 0.05 : 0.22) * (limit.high_deg - limit.low_deg);
}

Choreography MakeSpline(double seconds, uint64_t seed) {
  auto tracks = std::make_shared<std::vector<Track>>();
  const JointAngles natural = NaturalAngles();
  for (size_t k = 0; k < kAngles; ++k) {
    const AngleLimit limit = LimitOf(k);
    tracks->emplace_back(limit, natural.deg[k], SpreadOf(k, limit), seconds,
                         KeyOf(seed, absl::StrCat("track ", k)));
  }
  return [tracks](double t) {
    BodyMoment out;
    for (size_t k = 0; k < kAngles; ++k) out.angles.deg[k] = (*tracks)[k].At(t);
    return out;
  };
}

// Two to four seconds of a kind, then of another, with a second's half of both in between.
Choreography MakeMixed(double seconds, uint64_t seed) {
  constexpr double kFadeS = 0.6;
  constexpr std::array kinds = {MotionKind::kStanding, MotionKind::kTwist, MotionKind::kJogging,
                                MotionKind::kWalk,     MotionKind::kWave,  MotionKind::kSpline};
  struct Part {
    double from_s;
    Choreography moves;
  };
  auto parts = std::make_shared<std::vector<Part>>();
  const uint64_t key = KeyOf(seed, "mix");
  size_t last = kinds.size();
  for (double t = 0; t < seconds; t += 2 + 2 * UniformOf(key, 2 * parts->size())) {
    size_t kind = static_cast<size_t>(UniformOf(key, 2 * parts->size() + 1) * kinds.size());
    if (kind == last) kind = (kind + 1) % kinds.size();
    last = kind;
    parts->push_back({t, MakeChoreography(kinds[kind], seconds, MixBits(seed + parts->size()))});
  }
  return [parts](double t) {
    size_t k = 0;
    while (k + 1 < parts->size() && (*parts)[k + 1].from_s <= t) ++k;
    BodyMoment out = (*parts)[k].moves(t);
    const double share = Ease((t - (*parts)[k].from_s) / kFadeS);
    if (k == 0 || share >= 1) return out;
    const BodyMoment before = (*parts)[k - 1].moves(t);
    for (size_t a = 0; a < kAngles; ++a)
      out.angles.deg[a] = before.angles.deg[a] + share * (out.angles.deg[a] - before.angles.deg[a]);
    out.lift_mm = before.lift_mm + share * (out.lift_mm - before.lift_mm);
    return out;
  };
}

}  // namespace

Choreography MakeChoreography(MotionKind kind, double seconds, uint64_t seed) {
  const Whims whims = {KeyOf(seed, "motion")};
  const auto with = [whims](BodyMoment (*moves)(double, const Whims&)) -> Choreography {
    return [whims, moves](double t) { return moves(t, whims); };
  };
  switch (kind) {
    case MotionKind::kStanding:
      return with(Stand);
    case MotionKind::kTwist:
      return with(Twist);
    case MotionKind::kJogging:
      return with(Jog);
    case MotionKind::kWalk:
      return with(Walk);
    case MotionKind::kWave:
      return with(Wave);
    case MotionKind::kSpline:
      return MakeSpline(seconds, seed);
    case MotionKind::kMixed:
      return MakeMixed(seconds, seed);
    case MotionKind::kSquat:
      return with(Squat);
    case MotionKind::kReach:
      return with(Reach);
  }
  return with(Stand);
}

}  // namespace weft

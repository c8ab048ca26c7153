#include "pattern/seeds/lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "pattern/seeds/vec.h"

namespace weft {
namespace {

// Longest cell edge looked for in the image at hand.
constexpr float kMaxEdgePx = 9.0f;

// A neighbour lies within this share of the edge from where the opposite one predicts it.
constexpr float kTolerance = 0.28f;

// Sine of the least angle between the two axes of a cell.
constexpr float kMinSine = 0.3f;

// A keypoint with its four neighbours, at +a, +b, -a, -b.
struct Frame4 {
  Vec a, b;
  std::array<int, 4> neighbor = {-1, -1, -1, -1};
  bool valid = false;

  // The frame seen from axes turned by a quarter turn: a' = b, b' = -a.
  Frame4 Turned() const {
    return {b, -1.0f * a, {neighbor[1], neighbor[2], neighbor[3], neighbor[0]}, valid};
  }
};

// Places (i, j) of a patch that are taken; open addressing. Up to 2^19 to all sides, for up to 2^24 patches.
class TakenPlaces {
 public:
  // For up to `most` places.
  explicit TakenPlaces(size_t most) {
    while ((size_t{1} << bits_) < 2 * most) ++bits_;
    slots_.resize(size_t{1} << bits_);
  }
  void Clear() { ++round_; }
  bool Contains(int i, int j) const { return slots_[SlotOf(i, j)] == Key(i, j); }
  // False where the place is taken already.
  bool Take(int i, int j) {
    uint64_t& slot = slots_[SlotOf(i, j)];
    if (slot == Key(i, j)) return false;
    slot = Key(i, j);
    return true;
  }

 private:
  static constexpr int kPlaceBits = 20;

  uint64_t Key(int i, int j) const {
    constexpr uint64_t kMask = (uint64_t{1} << kPlaceBits) - 1;
    return (round_ << kPlaceBits | (static_cast<uint64_t>(i) & kMask)) << kPlaceBits |
           (static_cast<uint64_t>(j) & kMask);
  }
  // Where the place is, or else would be: slots of other rounds are free. Places of a 4x4 tile begin near
  // each other in memory: growth asks for neighbours.
  size_t SlotOf(int i, int j) const {
    const uint64_t key = Key(i, j);
    const size_t mask = slots_.size() - 1;
    size_t at = (Key(i >> 2, j >> 2) * 0x9e3779b97f4a7c15u) >> (64 - bits_);
    at = (at & ~size_t{15}) | static_cast<size_t>((i & 3) << 2 | (j & 3));
    while (slots_[at] >> 2 * kPlaceBits == round_ && slots_[at] != key) at = (at + 1) & mask;
    return at;
  }

  int bits_ = 4;
  uint64_t round_ = 1;
  std::vector<uint64_t> slots_;  // 0 or a key
};

// The keypoints within reach of one.
struct Surroundings {
  std::vector<float> squared;  // distance
  std::vector<int> keypoint;
  std::vector<int> rank;  // by distance; of equally far ones the lower keypoint goes first

  // With space for whole lanes.
  void Reserve(size_t count) {
    if (rank.size() >= count + kLanes) return;
    for (std::vector<int>* v : {&keypoint, &rank}) v->resize(2 * count + kLanes);
    squared.resize(2 * count + kLanes);
  }

  // Counts for each of the first `count` which of them go before it; no branch depends on their order.
  void Rank(size_t count) {
    size_t sum = 0;
    for (size_t block = 0; block < count; block += kLanes) {
      Floats here;
      std::memcpy(&here, &squared[block], sizeof here);
      Ints before = {};
      for (size_t j = 0; j < count; ++j) before -= squared[j] < here;
      std::memcpy(&rank[block], &before, sizeof before);
      for (size_t k = block; k < std::min(block + kLanes, count); ++k) sum += rank[k];
    }
    // Where two are equally far it falls short of the sum over 0, 1, 2 ...
    if (2 * sum == count * (count - 1)) return;
    for (size_t j = 0; j < count; ++j) {
      for (size_t k = 0; k < count; ++k) rank[k] += squared[j] == squared[k] && keypoint[j] < keypoint[k];
    }
  }

 private:
  static constexpr size_t kLanes = 4;
  typedef float Floats __attribute__((vector_size(4 * kLanes)));
  typedef int Ints __attribute__((vector_size(4 * kLanes)));
};

class LatticeBuilder {
 public:
  LatticeBuilder(const std::vector<Keypoint>& points, const Plane& spots, const LatticeOptions& options)
      : points_(points),
        spots_(spots),
        options_(options),
        grid_(points, spots.width_px, spots.height_px),
        places_(points.size()) {}

  std::vector<LatticePatch> Build() {
    frames_.resize(points_.size());
    framed_.resize(points_.size());
    for (size_t i = 0; i < points_.size(); ++i) {
      frames_[i] = FindFrame(static_cast<int>(i));
      framed_[i] = frames_[i].valid;
    }
    std::vector<LatticePatch> patches;
    taken_.assign(points_.size(), false);
    for (size_t i = 0; i < points_.size(); ++i) {
      if (framed_[i] && !taken_[i]) patches.push_back(GrowPatch(static_cast<int>(i)));
    }
    return patches;
  }

 private:
  struct Axis {
    Vec v;
    int ahead, behind;
    float length;
  };

  struct Neighbor {
    int keypoint;
    Vec to;
    float squared;
  };
  // Enough for cells three times as long as wide.
  static constexpr size_t kMostNear = 18;
  static constexpr size_t kMostAxes = 6;

  Vec At(int i) const { return {points_[i].x_px, points_[i].y_px}; }
  float Spot(Vec p) const { return spots_.Sample(p.x, p.y); }

  bool AnyNear(Vec p, float radius) const {
    bool found = false;
    grid_.Around(p.x, p.y, radius, [&](std::span<const KeypointGrid::Place> places) {
      for (const auto& [x, y, i] : places) found |= Dot(Vec{x, y} - p, Vec{x, y} - p) < radius * radius;
      return found;
    });
    return found;
  }

  bool InkBetween(Vec p, int q, float contrast) const {
    return Spot(0.5f * (p + At(q))) < std::min(points_[q].contrast, contrast) - options_.min_ink_contrast;
  }

  // The nearest keypoints around one, near ones first.
  void FindNear(int center) {
    const float reach = kMaxEdgePx * kMaxEdgePx;
    const Vec p = At(center);
    size_t count = 0;
    grid_.Around(p.x, p.y, kMaxEdgePx, [&](std::span<const KeypointGrid::Place> places) {
      around_.Reserve(count + places.size());
      for (const auto& [x, y, i] : places) {
        const Vec v = Vec{x, y} - p;
        const float squared = Dot(v, v);
        around_.squared[count] = squared;
        around_.keypoint[count] = i;
        count += squared <= reach && i != center;
      }
      return false;
    });
    around_.Rank(count);
    near_count_ = std::min(count, kMostNear);
    for (size_t k = 0; k < count; ++k) {
      const int i = around_.keypoint[k];
      if (around_.rank[k] < static_cast<int>(kMostNear))
        near_[around_.rank[k]] = {i, At(i) - p, around_.squared[k]};
    }
  }

  std::span<const Neighbor> Near() const { return {near_.data(), near_count_}; }

  // Adds the axis from the keypoint opposite `ahead` to it, where there is one and ink in between.
  bool AddAxis(int center, const Neighbor& ahead) {
    const auto& [i, v, squared] = ahead;
    if (v.y < 0 || (v.y == 0 && v.x < 0) || squared < 1.5f * 1.5f) return false;
    const Neighbor* behind = nullptr;
    float best = kTolerance * kTolerance * squared;
    for (const Neighbor& other : Near()) {
      const Vec miss = other.to + v;
      if (Dot(miss, miss) < best) {
        best = Dot(miss, miss);
        behind = &other;
      }
    }
    if (behind == nullptr) return false;
    const float contrast = points_[center].contrast;
    if (!InkBetween(At(center), i, contrast) || !InkBetween(At(center), behind->keypoint, contrast))
      return false;
    axes_.push_back({0.5f * (v - behind->to), i, behind->keypoint, std::sqrt(squared)});
    return true;
  }

  // Diagonal neighbours that are there, and corners darker than edges.
  bool LooksLikeCells(Vec p, Vec a, Vec b) const {
    constexpr int kMostMissing = 1;
    const float radius = kTolerance * std::max(Length(a), Length(b));
    int missing = 0;
    float corners = 0, edges = 0;
    for (const auto& [s, t] : {std::pair{1.0f, 1.0f}, {1.0f, -1.0f}, {-1.0f, 1.0f}, {-1.0f, -1.0f}}) {
      if (!AnyNear(p + s * a + t * b, radius) && ++missing > kMostMissing) return false;
      corners += Spot(p + 0.5f * (s * a + t * b));
    }
    for (const float s : {0.5f, -0.5f}) edges += Spot(p + s * a) + Spot(p + s * b);
    return corners < edges;
  }

  // The two shortest axes that make cells. They are sought short ones first, and no farther than needed.
  Frame4 FindFrame(int center) {
    FindNear(center);
    axes_.clear();
    const Vec p = At(center);
    Frame4 best;
    float best_size = 1e9f;
    for (const Neighbor& neighbor : Near()) {
      if (axes_.size() == kMostAxes) break;
      if (!axes_.empty() && axes_[0].length + std::sqrt(neighbor.squared) >= best_size) break;
      if (!AddAxis(center, neighbor)) continue;
      const Axis& t = axes_.back();
      for (size_t k = 0; k + 1 < axes_.size(); ++k) {
        const Axis& s = axes_[k];
        if (s.length + t.length >= best_size) break;
        if (t.length > options_.max_stretch * s.length) continue;
        const float cross = Cross(s.v, t.v);
        if (std::abs(cross) < kMinSine * s.length * t.length) continue;
        if (!LooksLikeCells(p, s.v, t.v)) continue;
        best_size = s.length + t.length;
        best = cross > 0 ? Frame4{s.v, t.v, {s.ahead, t.ahead, s.behind, t.behind}, true}
                         : Frame4{s.v, -1.0f * t.v, {s.ahead, t.behind, s.behind, t.ahead}, true};
      }
    }
    return best;
  }

  // The neighbour's frame turned to agree with `frame`; invalid where it does not under any turn.
  Frame4 Aligned(const Frame4& frame, int neighbor) const {
    if (!framed_[neighbor]) return {};
    const float limit = 0.16f * std::max(Dot(frame.a, frame.a), Dot(frame.b, frame.b));
    const auto near = [&](Vec v, Vec w) { return Dot(v - w, v - w) < limit; };
    Frame4 turned = frames_[neighbor];
    for (int turn = 0; turn < 4; ++turn, turned = turned.Turned()) {
      if (near(turned.a, frame.a) && near(turned.b, frame.b)) return turned;
    }
    return {};
  }

  LatticePatch GrowPatch(int seed) {
    LatticePatch patch;
    struct Front {
      int i, j, keypoint;
      Frame4 frame;
    };
    places_.Clear();
    std::vector<Front> grown;  // with frames, in the order in which they were found
    const auto add = [&](int i, int j, int keypoint, const Frame4& frame) {
      if (taken_[keypoint] || !places_.Take(i, j)) return;
      taken_[keypoint] = true;
      patch.cells.push_back({i, j, keypoint, frame.a.x, frame.a.y, frame.b.x, frame.b.y});
      patch.i_min = std::min(patch.i_min, i);
      patch.i_max = std::max(patch.i_max, i);
      patch.j_min = std::min(patch.j_min, j);
      patch.j_max = std::max(patch.j_max, j);
      if (frame.valid) grown.push_back({i, j, keypoint, frame});
    };
    add(0, 0, seed, frames_[seed]);
    static constexpr int kStep[4][2] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};
    for (size_t next = 0; next < grown.size(); ++next) {
      const Front front = grown[next];
      for (int k = 0; k < 4; ++k) {
        if (taken_[front.frame.neighbor[k]]) continue;
        const Frame4 aligned = Aligned(front.frame, front.frame.neighbor[k]);
        if (!aligned.valid || aligned.neighbor[(k + 2) % 4] != front.keypoint) continue;
        add(front.i + kStep[k][0], front.j + kStep[k][1], front.frame.neighbor[k], aligned);
      }
    }
    // Cells without a frame join last: those with one know better where they belong.
    for (const Front& front : grown) {
      for (int k = 0; k < 4; ++k) {
        if (framed_[front.frame.neighbor[k]]) continue;
        add(front.i + kStep[k][0], front.j + kStep[k][1], front.frame.neighbor[k], Frame4{});
      }
      AddDiagonals(front.frame, front.keypoint, front.i, front.j, add);
    }
    return patch;
  }

  // A single cross has no 3x3 window without its diagonal neighbours.
  template <typename Add>
  void AddDiagonals(const Frame4& frame, int keypoint, int i, int j, Add add) const {
    const float radius = kTolerance * std::max(Length(frame.a), Length(frame.b));
    for (const int s : {-1, 1}) {
      for (const int t : {-1, 1}) {
        if (places_.Contains(i + s, j + t)) continue;
        const Vec place = At(keypoint) + static_cast<float>(s) * frame.b + static_cast<float>(t) * frame.a;
        const int diagonal = grid_.Nearest(place.x, place.y, radius, [](int) { return false; });
        if (diagonal >= 0 && !framed_[diagonal]) add(i + s, j + t, diagonal, Frame4{});
      }
    }
  }

  const std::vector<Keypoint>& points_;
  const Plane& spots_;
  const LatticeOptions& options_;
  KeypointGrid grid_;
  TakenPlaces places_;
  std::vector<Frame4> frames_;
  std::vector<uint8_t> framed_, taken_;  // whether frames are valid, and keypoints in a patch
  std::vector<Axis> axes_;
  Surroundings around_;
  std::array<Neighbor, kMostNear> near_;
  size_t near_count_ = 0;
};

}  // namespace

absl::Status LatticeOptions::Validate() const {
  if (!(max_stretch >= 1)) return absl::InvalidArgumentError("lattice.max_stretch must be at least 1");
  if (!(min_ink_contrast >= 0 && min_ink_contrast < 1)) {
    return absl::InvalidArgumentError("lattice.min_ink_contrast must lie in [0, 1)");
  }
  return absl::OkStatus();
}

std::vector<LatticePatch> BuildLattice(const std::vector<Keypoint>& points, const Plane& spots,
                                       const LatticeOptions& options) {
  return LatticeBuilder(points, spots, options).Build();
}

}  // namespace weft

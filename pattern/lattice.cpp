#include "pattern/lattice.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <unordered_map>

namespace weft {
namespace {

struct Vec {
  float x = 0, y = 0;
  friend Vec operator+(Vec p, Vec q) { return {p.x + q.x, p.y + q.y}; }
  friend Vec operator-(Vec p, Vec q) { return {p.x - q.x, p.y - q.y}; }
  friend Vec operator*(float s, Vec p) { return {s * p.x, s * p.y}; }
};
float Dot(Vec p, Vec q) { return p.x * q.x + p.y * q.y; }
float Cross(Vec p, Vec q) { return p.x * q.y - p.y * q.x; }
float Length(Vec p) { return std::sqrt(Dot(p, p)); }

// A keypoint with its four neighbours, at +a, +b, -a, -b.
struct Frame4 {
  Vec a, b;
  std::array<int, 4> neighbor = {-1, -1, -1, -1};
  bool valid = false;

  // The frame seen from axes turned by `turn` quarter turns: a' = b, b' = -a for one.
  Frame4 Turned(int turn) const {
    Frame4 f = *this;
    for (int t = 0; t < turn; ++t) {
      f = Frame4{f.b, -1.0f * f.a, {f.neighbor[1], f.neighbor[2], f.neighbor[3], f.neighbor[0]}, valid};
    }
    return f;
  }
};

class LatticeBuilder {
 public:
  LatticeBuilder(const std::vector<Keypoint>& points, const Plane& spots, const LatticeOptions& options)
      : points_(points), spots_(spots), options_(options), grid_(points, spots.width_px, spots.height_px) {}

  std::vector<LatticePatch> Build() {
    frames_.resize(points_.size());
    for (size_t i = 0; i < points_.size(); ++i) frames_[i] = FindFrame(static_cast<int>(i));
    std::vector<LatticePatch> patches;
    taken_.assign(points_.size(), false);
    for (size_t i = 0; i < points_.size(); ++i) {
      if (frames_[i].valid && !taken_[i]) patches.push_back(GrowPatch(static_cast<int>(i)));
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

  Vec At(int i) const { return {points_[i].x_px, points_[i].y_px}; }
  float Spot(Vec p) const { return spots_.Sample(p.x, p.y); }

  // The keypoint nearest to `p` within `radius`, -1 where there is none.
  int Nearest(Vec p, float radius) const {
    int best = -1;
    float best_distance = radius * radius;
    grid_.Near(p.x, p.y, radius, [&](int i) {
      const Vec d = At(i) - p;
      if (Dot(d, d) < best_distance) {
        best_distance = Dot(d, d);
        best = i;
      }
    });
    return best;
  }

  bool InkBetween(Vec p, int q, float contrast) const {
    return Spot(0.5f * (p + At(q))) < std::min(points_[q].contrast, contrast) - options_.min_ink_contrast;
  }

  // Pairs of keypoints opposite each other, short ones first.
  void FindAxes(int center) {
    axes_.clear();
    near_.clear();
    const Vec p = At(center);
    grid_.Near(p.x, p.y, options_.max_edge_px, [&](int i) {
      const Vec v = At(i) - p;
      if (i != center) near_.push_back({i, v, Dot(v, v)});
    });
    if (near_.size() > kMostNear) {
      const auto nearer = [](const Neighbor& s, const Neighbor& t) {
        return s.squared != t.squared ? s.squared < t.squared : s.keypoint < t.keypoint;
      };
      std::nth_element(near_.begin(), near_.begin() + kMostNear, near_.end(), nearer);
      near_.resize(kMostNear);
    }
    for (const auto& [i, v, squared] : near_) {
      if (v.y < 0 || (v.y == 0 && v.x < 0)) continue;
      const float length = std::sqrt(squared);
      if (length < 1.5f) continue;
      const Neighbor* behind = nullptr;
      float best = options_.tolerance * options_.tolerance * squared;
      for (const Neighbor& other : near_) {
        const Vec miss = other.to + v;
        if (Dot(miss, miss) < best) {
          best = Dot(miss, miss);
          behind = &other;
        }
      }
      if (behind == nullptr) continue;
      if (!InkBetween(p, i, points_[center].contrast) ||
          !InkBetween(p, behind->keypoint, points_[center].contrast)) {
        continue;
      }
      axes_.push_back({0.5f * (v - behind->to), i, behind->keypoint, length});
    }
    std::stable_sort(axes_.begin(), axes_.end(), [](const Axis& s, const Axis& t) {
      return s.length != t.length ? s.length < t.length : s.ahead < t.ahead;
    });
    if (axes_.size() > 6) axes_.resize(6);
  }

  // Diagonal neighbours that are there, and corners darker than edges.
  bool LooksLikeCells(Vec p, Vec a, Vec b) const {
    const float radius = options_.tolerance * std::max(Length(a), Length(b));
    int diagonals = 0;
    float corners = 0, edges = 0;
    for (const auto& [s, t] : {std::pair{1.0f, 1.0f}, {1.0f, -1.0f}, {-1.0f, 1.0f}, {-1.0f, -1.0f}}) {
      diagonals += Nearest(p + s * a + t * b, radius) >= 0;
      corners += Spot(p + 0.5f * (s * a + t * b));
    }
    if (diagonals < 3) return false;
    for (const float s : {0.5f, -0.5f}) edges += Spot(p + s * a) + Spot(p + s * b);
    return corners < edges;
  }

  Frame4 FindFrame(int center) {
    FindAxes(center);
    const Vec p = At(center);
    Frame4 best;
    float best_size = 1e9f;
    for (size_t k = 0; k < axes_.size(); ++k) {
      for (size_t l = k + 1; l < axes_.size(); ++l) {
        const Axis &s = axes_[k], &t = axes_[l];
        if (s.length + t.length >= best_size) break;
        if (t.length > options_.max_stretch * s.length) break;
        const float cross = Cross(s.v, t.v);
        if (std::abs(cross) < options_.min_sine * s.length * t.length) continue;
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
    const Frame4& other = frames_[neighbor];
    if (!other.valid) return {};
    const float limit = 0.4f * std::max(Length(frame.a), Length(frame.b));
    for (int turn = 0; turn < 4; ++turn) {
      Frame4 turned = other.Turned(turn);
      if (Length(turned.a - frame.a) < limit && Length(turned.b - frame.b) < limit) return turned;
    }
    return {};
  }

  LatticePatch GrowPatch(int seed) {
    LatticePatch patch;
    std::unordered_map<int64_t, int> occupied;  // by i, j
    struct Front {
      int i, j, keypoint;
      Frame4 frame;
    };
    std::deque<Front> queue;
    const auto add = [&](int i, int j, int keypoint, const Frame4& frame) {
      const int64_t key = static_cast<int64_t>(i) * (int64_t{1} << 32) + j;
      if (taken_[keypoint] || !occupied.emplace(key, keypoint).second) return;
      taken_[keypoint] = true;
      patch.cells.push_back({i, j, keypoint, frame.a.x, frame.a.y, frame.b.x, frame.b.y});
      patch.i_min = std::min(patch.i_min, i);
      patch.i_max = std::max(patch.i_max, i);
      patch.j_min = std::min(patch.j_min, j);
      patch.j_max = std::max(patch.j_max, j);
      if (frame.valid) queue.push_back({i, j, keypoint, frame});
    };
    add(0, 0, seed, frames_[seed]);
    static constexpr int kStep[4][2] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};
    // Cells without a frame join last: those with one know better where they belong.
    std::vector<Front> grown;
    while (!queue.empty()) {
      const Front front = queue.front();
      queue.pop_front();
      grown.push_back(front);
      for (int k = 0; k < 4; ++k) {
        const Frame4 aligned = Aligned(front.frame, front.frame.neighbor[k]);
        if (!aligned.valid || aligned.neighbor[(k + 2) % 4] != front.keypoint) continue;
        add(front.i + kStep[k][0], front.j + kStep[k][1], front.frame.neighbor[k], aligned);
      }
    }
    for (const Front& front : grown) {
      for (int k = 0; k < 4; ++k) {
        if (frames_[front.frame.neighbor[k]].valid) continue;
        add(front.i + kStep[k][0], front.j + kStep[k][1], front.frame.neighbor[k], Frame4{});
      }
      AddDiagonals(front.frame, front.keypoint, front.i, front.j, add);
    }
    return patch;
  }

  // A single cross has no 3x3 window without its diagonal neighbours.
  template <typename Add>
  void AddDiagonals(const Frame4& frame, int keypoint, int i, int j, Add add) const {
    const float radius = options_.tolerance * std::max(Length(frame.a), Length(frame.b));
    for (const int s : {-1, 1}) {
      for (const int t : {-1, 1}) {
        const Vec place = At(keypoint) + static_cast<float>(s) * frame.b + static_cast<float>(t) * frame.a;
        const int diagonal = Nearest(place, radius);
        if (diagonal >= 0 && !frames_[diagonal].valid) add(i + s, j + t, diagonal, Frame4{});
      }
    }
  }

  const std::vector<Keypoint>& points_;
  const Plane& spots_;
  const LatticeOptions& options_;
  KeypointGrid grid_;
  std::vector<Frame4> frames_;
  std::vector<bool> taken_;
  std::vector<Axis> axes_;
  std::vector<Neighbor> near_;
};

}  // namespace

absl::Status LatticeOptions::Validate() const {
  if (!(max_edge_px > 2)) return absl::InvalidArgumentError("lattice.max_edge_px must be above 2");
  if (!(tolerance > 0 && tolerance < 0.5)) {
    return absl::InvalidArgumentError("lattice.tolerance must lie in (0, 0.5)");
  }
  if (!(min_sine > 0 && min_sine < 1))
    return absl::InvalidArgumentError("lattice.min_sine must lie in (0, 1)");
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

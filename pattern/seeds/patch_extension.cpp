#include "pattern/seeds/patch_extension.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "pattern/seeds/vec.h"

namespace weft {
namespace {

// Distance between a blob and where it is expected, in edges of the cell: of the cell that expects it, and of
// the others around that do.
constexpr float kTolerance = 0.28f, kToleranceAround = 0.45f;
// Fewer cells are on many places of the board.
constexpr size_t kLeastCells = 12;

// A cell of a patch, in pixels of the full image.
struct Node {
  int i, j;
  Vec at;
  Vec a, b;  // edges to (i, j + 1) and (i + 1, j)
};

// The blobs of one level of the pyramid.
class Blobs {
 public:
  Blobs(const std::vector<LooseBlob>& blobs, int level, const ColorImage& full)
      : points_(OfLevel(blobs, level)),
        grid_(points_, full.width_px, full.height_px),
        taken_(points_.size(), false) {}

  // The nearest within `radius_px` that nobody has taken; -1 where there is none.
  int Nearest(Vec p, float radius_px) const {
    return grid_.Nearest(p.x, p.y, radius_px, [this](int blob) { return taken_[blob]; });
  }
  void Take(int blob) { taken_[blob] = true; }
  void Requeue(int blob) { taken_[blob] = false; }
  Vec At(int blob) const { return {points_[blob].x_px, points_[blob].y_px}; }

 private:
  static std::vector<Keypoint> OfLevel(const std::vector<LooseBlob>& blobs, int level) {
    std::vector<Keypoint> points;
    for (const LooseBlob& blob : blobs) {
      if (blob.level == level) points.push_back({blob.x_px, blob.y_px, 0});
    }
    return points;
  }

  std::vector<Keypoint> points_;
  KeypointGrid grid_;
  std::vector<bool> taken_;
};

class Extension {
 public:
  explicit Extension(Blobs* blobs) : blobs_(*blobs) {}

  // A cell with a frame that nobody has taken, and all that follow from it; fewer than kLeastCells are given
  // back.
  std::vector<Node> Run(Node start) {
    constexpr float kSamePx = 0.02f;
    const int blob = blobs_.Nearest(start.at, kSamePx);
    if (blob < 0) return {};
    for (Vec* edge : {&start.a, &start.b}) {
      if (IsTwoSteps(start.at, *edge)) *edge = 0.5f * *edge;
    }
    Add(blob, start);
    for (size_t k = 0; k < nodes_.size(); ++k) {
      for (const auto& [di, dj] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}})
        Follow(Node(nodes_[k]), di, dj);
    }
    if (nodes_.size() >= kLeastCells) return std::move(nodes_);
    for (const int taken : joined_) blobs_.Requeue(taken);
    return {};
  }

 private:
  static uint64_t Key(int i, int j) {
    return static_cast<uint64_t>(static_cast<uint32_t>(i)) << 32 | static_cast<uint32_t>(j);
  }
  const Node* Find(int i, int j) const {
    const auto at = at_.find(Key(i, j));
    return at == at_.end() ? nullptr : &nodes_[at->second];
  }

  void Add(int blob, const Node& node) {
    blobs_.Take(blob);
    joined_.push_back(blob);
    at_[Key(node.i, node.j)] = static_cast<int>(nodes_.size());
    nodes_.push_back(node);
  }

  static Vec Step(const Node& from, int di, int dj) {
    return static_cast<float>(dj) * from.a + static_cast<float>(di) * from.b;
  }

  // Whether there are blobs half way, on both sides. Squeezed cells lack neighbours, and the lattice takes
  // those behind them.
  bool IsTwoSteps(Vec at, Vec edge) const {
    const float radius = 0.5f * kTolerance * Length(edge);
    return blobs_.Nearest(at + 0.5f * edge, radius) >= 0 && blobs_.Nearest(at - 0.5f * edge, radius) >= 0;
  }

  // Looks for the cell that is (di, dj) from a known one.
  void Follow(const Node& from, int di, int dj) {
    const int i = from.i + di, j = from.j + dj;
    if (Find(i, j) != nullptr) return;
    const Vec step = Step(from, di, dj);
    const int blob = blobs_.Nearest(from.at + step, kTolerance * Length(step));
    if (blob < 0 || !AgreeAround(i, j, blobs_.At(blob))) return;
    Node next{i, j, blobs_.At(blob), from.a, from.b};
    const Vec seen = static_cast<float>(di + dj) * (next.at - from.at);
    Vec& along = dj != 0 ? next.a : next.b;
    along = 0.5f * (along + seen);
    Add(blob, next);
  }

  // Whether no known cell around place (i, j) expects it elsewhere.
  bool AgreeAround(int i, int j, Vec at) const {
    for (int k = 0; k < 9; ++k) {
      const int di = k / 3 - 1, dj = k % 3 - 1;
      const Node* near = k == 4 ? nullptr : Find(i - di, j - dj);
      if (near == nullptr) continue;
      const Vec step = Step(*near, di, dj);
      const Vec miss = near->at + step - at;
      if (Dot(miss, miss) > kToleranceAround * kToleranceAround * Dot(step, step)) return false;
    }
    return true;
  }

  Blobs& blobs_;
  std::vector<Node> nodes_;  // in the order in which they were found
  std::vector<int> joined_;  // their blobs
  std::unordered_map<uint64_t, int> at_;
};

// The nodes as a patch of that level.
LevelPatch PatchOf(const std::vector<Node>& nodes, int level, const ColorImage& image) {
  LevelPatch patch;
  patch.is_strip = true;
  patch.level = level;
  patch.scale = static_cast<float>(1 << level);
  LatticePatch lattice;
  lattice.i_min = lattice.i_max = nodes[0].i;
  lattice.j_min = lattice.j_max = nodes[0].j;
  std::vector<Keypoint> of_level;
  const float s = 1 / patch.scale;
  for (const Node& n : nodes) {
    lattice.i_min = std::min(lattice.i_min, n.i);
    lattice.i_max = std::max(lattice.i_max, n.i);
    lattice.j_min = std::min(lattice.j_min, n.j);
    lattice.j_max = std::max(lattice.j_max, n.j);
    lattice.cells.push_back(
        {n.i, n.j, static_cast<int>(of_level.size()), s * n.a.x, s * n.a.y, s * n.b.x, s * n.b.y});
    of_level.push_back({(n.at.x + 0.5f) * s - 0.5f, (n.at.y + 0.5f) * s - 0.5f, 0});
    patch.points.push_back({n.at.x, n.at.y, 0});
  }
  patch.measured = MeasurePatch(lattice, of_level, image);
  return patch;
}

}  // namespace

std::vector<LevelPatch> ExtendPatches(const std::vector<ColorImage>& pyramid,
                                      const std::vector<LevelPatch>& patches,
                                      const std::vector<LooseBlob>& blobs) {
  std::vector<Blobs> by_level;
  for (size_t level = 0; level < pyramid.size(); ++level)
    by_level.emplace_back(blobs, static_cast<int>(level), pyramid[0]);
  std::vector<LevelPatch> extended;
  for (const LevelPatch& patch : patches) {
    for (size_t k = 0; k < patch.points.size(); ++k) {
      const PatchCell& c = patch.measured.lattice.cells[k];
      if (!c.has_frame()) continue;
      const float s = patch.scale;
      const Node start{
          0, 0, {patch.points[k].x_px, patch.points[k].y_px}, {s * c.ax, s * c.ay}, {s * c.bx, s * c.by}};
      const std::vector<Node> nodes = Extension(&by_level[patch.level]).Run(start);
      if (!nodes.empty()) extended.push_back(PatchOf(nodes, patch.level, pyramid[patch.level]));
    }
  }
  return extended;
}

}  // namespace weft

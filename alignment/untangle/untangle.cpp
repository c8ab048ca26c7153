#include "alignment/untangle/untangle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/cut_off_regions.h"
#include "alignment/untangle/self_intersection.h"
#include "alignment/untangle/untangle_patch.h"
#include "alignment/untangle/untangle_push.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Lengths named Edges count in mean edges of the patch.
constexpr int kPatchRings = 8;     // edges around tangled faces within which vertices may move
constexpr double kReachEdges = 3;  // cloth this near to them is taken into account
// After as many pushes, cloth that no cut-off region explains is laid flat, and so many rings around it.
constexpr int kPushesBeforeFlattening = 5;
constexpr int kFlatRings = 2;
constexpr int kBoundedPushes = 20;          // see UntangleOptions::max_observed_sigmas
constexpr int kPushesPerRing = 8;           // more that are released or laid flat, after twice as many
constexpr double kPushGapEdges = 0.04;      // how far beyond the other layer a region is pushed
constexpr double kContourStepEdges = 0.05;  // per push, where only the contour tells the way

constexpr double kFarEdges = 1000;
constexpr double kNoMoveMm = 0.005;
constexpr double kRoundingMm = 1e-3;  // more than what storing as 32-bit floats moves a vertex
constexpr int kMaxDoublings = 2;      // of a patch's rings
constexpr int kPiercingsPerRing = 3;  // fewer of them do not enclose a region as wide as the patch

absl::Status BadUntangling(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("untangle.", what));
}

absl::Status CheckUntanglingInput(const std::vector<Face>& faces, std::span<const float> sigma_mm,
                                  const std::vector<Eigen::Vector3d>& vertices_mm) {
  const int vertices = static_cast<int>(vertices_mm.size());
  for (int v = 0; v < vertices; ++v) {
    if (!vertices_mm[v].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, ": its position is not finite"));
    }
  }
  for (size_t f = 0; f < faces.size(); ++f) {
    const auto [a, b, c] = faces[f];
    if (std::min({a, b, c}) < 0 || std::max({a, b, c}) >= vertices || a == b || b == c || c == a) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", f, ": needs three different vertices of 0 to ", vertices - 1));
    }
  }
  if (sigma_mm.empty()) return absl::OkStatus();
  if (sigma_mm.size() != vertices_mm.size()) {
    return absl::InvalidArgumentError(absl::StrCat("sigma_mm: ", sigma_mm.size(), " values for ", vertices,
                                                   " vertices; give one each, or none"));
  }
  for (int v = 0; v < vertices; ++v) {
    if (!(sigma_mm[v] > 0 && std::isfinite(sigma_mm[v]))) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, ": sigma_mm must be positive"));
    }
  }
  return absl::OkStatus();
}

void Append(const Face& face, std::vector<int>* vertices) {
  vertices->insert(vertices->end(), face.begin(), face.end());
}

double MeanEdgeMm(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces) {
  double sum = 0;
  for (const auto& [a, b, c] : faces) {
    sum += (vertices_mm[b] - vertices_mm[a]).norm() + (vertices_mm[c] - vertices_mm[b]).norm() +
           (vertices_mm[a] - vertices_mm[c]).norm();
  }
  return std::max(sum / (3.0 * static_cast<double>(faces.size())), 1e-6);
}

// Pushes until nothing is pierced. Returns whether that was reached.
class Pusher {
 public:
  Pusher(const UntangleOptions& options, double edge_mm, UntanglePatch* patch)
      : options_(options), edge_mm_(edge_mm), patch_(patch) {}

  bool Run() {
    size_t fewest = 0;
    std::vector<Eigen::Vector3d> best;
    for (pushes_ = 0;; ++pushes_) {
      const std::vector<Piercing> piercings = FindPiercings(*patch_);
      if (best.empty() || piercings.size() < fewest) {
        fewest = piercings.size();
        best = patch_->position_mm;
      }
      if (piercings.empty()) return true;
      if (pushes_ == options_.max_pushes) break;
      Push(piercings);
      if (!StaysNear()) break;
    }
    patch_->position_mm = std::move(best);
    return false;
  }

  int pushes() const { return pushes_; }

 private:
  // Hopeless intersecting may drive vertices out of all bounds.
  bool StaysNear() const {
    for (int v = 0; v < patch_->free; ++v) {
      if (!((patch_->position_mm[v] - patch_->observed_mm[v]).norm() < kFarEdges * edge_mm_)) return false;
    }
    return true;
  }

  void Push(const std::vector<Piercing>& piercings) {
    const CutOffRegions found = FindRegions(*patch_, piercings);
    Release(piercings);
    PushField field(*patch_);
    std::vector<int> flat;
    for (const CutOffRegion& region : found.regions) {
      if (region.loop) {
        flat.insert(flat.end(), region.vertices.begin(), region.vertices.end());
        for (const int f : region.opposite) Append(patch_->faces[f], &flat);
      } else {
        PushRegion(*patch_, region, kPushGapEdges * edge_mm_, &field);
      }
    }
    for (size_t i = 0; i < piercings.size(); ++i) {
      if (found.explained[i] && pushes_ < options_.max_pushes / 2) continue;
      ShortenContour(*patch_, piercings[i], kContourStepEdges * edge_mm_, &field);
      if (pushes_ >= kPushesBeforeFlattening) {
        const PatchEdge& edge = patch_->edges[piercings[i].edge];
        flat.insert(flat.end(), {edge.a, edge.b});
        Append(patch_->faces[piercings[i].face], &flat);
      }
    }
    field.Apply(patch_);
    if (!flat.empty()) Flatten(flat, kFlatRings + StubbornRings(), patch_);
  }

  // Around what has not come apart with every vertex free.
  int StubbornRings() const { return std::max(0, pushes_ - 2 * kBoundedPushes) / kPushesPerRing; }

  // Bounded vertices that contradict each other, after a while, and later all that take part.
  void Release(const std::vector<Piercing>& piercings) {
    if (pushes_ < kBoundedPushes) return;
    const bool all = pushes_ >= 2 * kBoundedPushes;
    std::vector<int> released;
    for (const Piercing& piercing : piercings) {
      const PatchEdge& edge = patch_->edges[piercing.edge];
      std::vector<int> some = {edge.a, edge.b};
      Append(patch_->faces[piercing.face], &some);
      if (all || std::all_of(some.begin(), some.end(), [&](int v) { return patch_->IsBounded(v); })) {
        released.insert(released.end(), some.begin(), some.end());
      }
    }
    for (const int v : GrownInPatch(*patch_, released, StubbornRings())) patch_->released[v] = true;
  }

  const UntangleOptions& options_;
  const double edge_mm_;
  UntanglePatch* patch_;
  int pushes_ = 0;
};

// Where no edge passes through a face and yet faces intersect they lie in a common plane: moves the vertices
// a little, each in a direction of its own.
void Shake(double distance_mm, UntanglePatch* patch) {
  for (int v = 0; v < patch->free; ++v) {
    uint32_t state = static_cast<uint32_t>(patch->vertex[v]) * 2654435761u + 1;
    for (int axis = 0; axis < 3; ++axis) {
      state = state * 1664525u + 1013904223u;
      patch->position_mm[v][axis] += distance_mm * ((state >> 8) / 8388608.0 - 1);
    }
  }
}

class Untangler {
 public:
  Untangler(const std::vector<Face>& faces, std::span<const float> sigma_mm, std::vector<double> bound_mm,
            const UntangleOptions& options, std::vector<Eigen::Vector3d>* vertices_mm)
      : faces_(faces),
        sigma_mm_(sigma_mm),
        bound_mm_(std::move(bound_mm)),
        options_(options),
        released_(vertices_mm->size(), false),
        returned_(vertices_mm->size(), true),
        observed_mm_(*vertices_mm),
        searched_mm_(*vertices_mm),
        vertices_mm_(*vertices_mm),
        around_(static_cast<int>(vertices_mm->size()), faces),
        edge_mm_(MeanEdgeMm(*vertices_mm, faces)) {}

  UntangleReport Run(IntersectingPairs intersecting) {
    while (!intersecting.empty() && report_.rounds < options_.max_rounds) {
      const int rings = kPatchRings * (1 + report_.rounds);
      const std::vector<std::vector<int>> grown = GrowGroups(faces_, around_, Groups(intersecting), rings);
      for (const std::vector<int>& free : grown) Resolve(WideEnoughPatch(free, rings));
      ++report_.rounds;
      intersecting = SearchAgain(intersecting);
      searched_mm_ = vertices_mm_;
    }
    if (!bound_mm_.empty()) ReturnMoved(&intersecting);
    report_.pairs_after = static_cast<int>(intersecting.apart.size());
    report_.vertex_pairs_after = static_cast<int>(intersecting.at_vertex.size());
    SumUpMoves();
    return report_;
  }

 private:
  std::vector<std::vector<int>> Groups(const IntersectingPairs& intersecting) const {
    std::vector<std::vector<int>> groups;
    for (const auto* pairs : {&intersecting.apart, &intersecting.at_vertex}) {
      for (const FacePair& pair : *pairs) {
        std::vector<int>& group = groups.emplace_back();
        Append(faces_[pair.a], &group);
        Append(faces_[pair.b], &group);
      }
    }
    return groups;
  }

  UntanglePatch PatchOf(const std::vector<int>& free) const {
    UntanglePatch patch =
        CutPatch(observed_mm_, vertices_mm_, faces_, sigma_mm_, bound_mm_, free, kReachEdges * edge_mm_);
    for (int v = 0; v < patch.free; ++v) patch.released[v] = released_[patch.vertex[v]];
    return patch;
  }

  // A region wider than the patch is not seen to be cut off from the rest. Its contour pierces many edges.
  UntanglePatch WideEnoughPatch(std::vector<int> free, int rings) const {
    UntanglePatch patch = PatchOf(free);
    for (int doubled = 0; doubled < kMaxDoublings; ++doubled, rings *= 2) {
      const std::vector<Piercing> piercings = FindPiercings(patch);
      const std::vector<bool> explained = FindRegions(patch, piercings).explained;
      if (std::count(explained.begin(), explained.end(), false) < kPiercingsPerRing * rings) break;
      free = GrowGroups(faces_, around_, {free}, rings)[0];
      patch = PatchOf(free);
    }
    return patch;
  }

  void Resolve(UntanglePatch patch) {
    ++report_.patches;
    Pusher pusher(options_, edge_mm_, &patch);
    // What only touches is parted by the return; if that did not help there is no plane to part it along.
    if (report_.rounds > 0 && FindPiercings(patch).empty()) Shake(options_.back.gap_mm, &patch);
    const bool clean = pusher.Run();
    report_.pushes += pusher.pushes();
    bool returned = false;
    if (clean) {
      const std::vector<Eigen::Vector3d> pushed = patch.position_mm;
      report_.returns += ReturnGuarded(options_.back, &patch);
      returned = FindPiercings(patch).empty();
      if (!returned) patch.position_mm = pushed;
    }
    Keep(patch, returned);
  }

  void Keep(const UntanglePatch& patch, bool returned) {
    for (int v = 0; v < patch.free; ++v) {
      const bool moved = (patch.position_mm[v] - patch.observed_mm[v]).norm() > kNoMoveMm;
      vertices_mm_[patch.vertex[v]] =
          moved ? patch.position_mm[v].cast<float>().cast<double>() : patch.observed_mm[v];
      released_[patch.vertex[v]] = patch.released[v];
      returned_[patch.vertex[v]] = returned;
    }
  }

  // Patches that only became clean with others have not returned yet. Measured vertices that are near their
  // place again are bounded again. Nothing moves where rounding would make faces intersect.
  void ReturnMoved(IntersectingPairs* intersecting) {
    std::vector<std::vector<int>> moved;
    for (size_t v = 0; v < observed_mm_.size(); ++v)
      if ((vertices_mm_[v] - observed_mm_[v]).norm() > (returned_[v] ? bound_mm_[v] : 0))
        moved.push_back({static_cast<int>(v)});
    if (moved.empty()) return;
    for (const std::vector<int>& free : GrowGroups(faces_, around_, moved, kPatchRings)) {
      UntanglePatch patch = PatchOf(free);
      if (!FindPiercings(patch).empty()) continue;
      for (int v = 0; v < patch.free; ++v) {
        const bool is_near = (patch.position_mm[v] - patch.observed_mm[v]).norm() <= patch.bound_mm[v];
        patch.released[v] = patch.released[v] && !is_near;
      }
      report_.returns += ReturnGuarded(options_.back, &patch);
      if (FindPiercings(patch).empty()) Keep(patch, true);
    }
    IntersectingPairs after = SearchAgain(*intersecting);
    if (after.count() > intersecting->count()) {
      vertices_mm_ = searched_mm_;
    } else {
      *intersecting = std::move(after);
    }
  }

  IntersectingPairs SearchAgain(const IntersectingPairs& before) const {
    std::vector<bool> moved;
    for (size_t v = 0; v < vertices_mm_.size(); ++v) moved.push_back(vertices_mm_[v] != searched_mm_[v]);
    return FindIntersectingPairsAgain(vertices_mm_, faces_, before, moved);
  }

  void SumUpMoves() {
    for (size_t v = 0; v < observed_mm_.size(); ++v) {
      const double move_mm = (vertices_mm_[v] - observed_mm_[v]).norm();
      if (move_mm == 0) continue;
      ++report_.moved_vertices;
      report_.mean_move_mm += move_mm;
      report_.max_move_mm = std::max(report_.max_move_mm, move_mm);
    }
    if (report_.moved_vertices > 0) report_.mean_move_mm /= report_.moved_vertices;
  }

  const std::vector<Face>& faces_;
  const std::span<const float> sigma_mm_;
  const std::vector<double> bound_mm_;
  const UntangleOptions& options_;
  std::vector<bool> released_, returned_;  // [vertices]
  const std::vector<Eigen::Vector3d> observed_mm_;
  std::vector<Eigen::Vector3d> searched_mm_;  // where the vertices were at the last search
  std::vector<Eigen::Vector3d>& vertices_mm_;
  const FacesOfVertex around_;
  const double edge_mm_;
  UntangleReport report_;
};

absl::StatusOr<UntangleReport> Remove(const std::vector<Face>& faces, std::span<const float> sigma_mm,
                                      std::vector<double> bound_mm, const UntangleOptions& options,
                                      std::vector<Eigen::Vector3d>* vertices_mm) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(CheckUntanglingInput(faces, sigma_mm, *vertices_mm));
  IntersectingPairs intersecting = FindIntersectingPairs(*vertices_mm, faces);
  const int pairs = static_cast<int>(intersecting.apart.size());
  const int vertex_pairs = static_cast<int>(intersecting.at_vertex.size());
  UntangleReport report;
  if (!intersecting.empty()) {
    report =
        Untangler(faces, sigma_mm, std::move(bound_mm), options, vertices_mm).Run(std::move(intersecting));
  }
  report.pairs_before = pairs;
  report.vertex_pairs_before = vertex_pairs;
  return report;
}

bool IsMeasured(VertexState state) {
  return state == VertexState::kObserved || state == VertexState::kTwoView;
}

}  // namespace

absl::Status UntangleOptions::Validate() const {
  if (max_pushes < 1) return BadUntangling("max_pushes must be positive");
  if (!(max_observed_sigmas >= 0)) return BadUntangling("max_observed_sigmas must not be negative");
  if (max_rounds < 0) return BadUntangling("max_rounds must not be negative");
  return back.Validate();
}

absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       std::span<const float> sigma_mm,
                                                       const UntangleOptions& options,
                                                       std::vector<Eigen::Vector3d>* vertices_mm) {
  return Remove(faces, sigma_mm, {}, options, vertices_mm);
}

absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       const UntangleOptions& options, RegisteredMesh* mesh) {
  const std::vector<Eigen::Vector3d> before_mm = mesh->vertices_mm;
  std::vector<double> bound_mm(before_mm.size(), std::numeric_limits<double>::infinity());
  for (size_t v = 0; v < bound_mm.size(); ++v) {
    if (!IsMeasured(mesh->state[v])) continue;
    bound_mm[v] = std::max(0.0, options.max_observed_sigmas * mesh->sigma_mm[v] - kRoundingMm);
  }
  absl::StatusOr<UntangleReport> report =
      Remove(faces, mesh->sigma_mm, std::move(bound_mm), options, &mesh->vertices_mm);
  if (!report.ok()) return report;
  for (size_t v = 0; v < before_mm.size(); ++v) {
    const double move_mm = (mesh->vertices_mm[v] - before_mm[v]).norm();
    if (!IsMeasured(mesh->state[v]) || move_mm <= options.max_observed_sigmas * mesh->sigma_mm[v]) continue;
    mesh->state[v] = VertexState::kInferred;
    mesh->views[v] = 0;
    mesh->sigma_mm[v] = static_cast<float>(std::hypot(mesh->sigma_mm[v], move_mm));
    ++report->demoted_vertices;
  }
  return report;
}

}  // namespace weft

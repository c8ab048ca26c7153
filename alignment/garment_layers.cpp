#include "alignment/garment_layers.h"

#include <algorithm>
#include <cmath>
#include "alignment/vertex_normals.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Vertices that tell of an order, at least, and the share of them that must agree.
constexpr int kMinVotes = 20;
constexpr double kMinShare = 0.8;

// How far behind the other garment a vertex is drawn. The removal of self-intersections keeps more.
constexpr double kBeyondMm = 0.5;

}  // namespace

absl::Status LayerOptions::Validate() const {
  if (!(weight >= 0) || !std::isfinite(weight))
    return absl::InvalidArgumentError("layers.weight must not be negative");
  if (!(reach_mm > 0) || !std::isfinite(reach_mm))
    return absl::InvalidArgumentError("layers.reach_mm must be positive");
  return absl::OkStatus();
}

absl::StatusOr<GarmentLayers> GarmentLayers::Build(const std::vector<GarmentSpan>& garments,
                                                   const std::vector<Face>& faces,
                                                   const std::vector<Eigen::Vector3d>& position_mm) {
  GarmentLayers layers;
  layers.garments_ = garments;
  layers.position_mm_ = position_mm;
  layers.normals_ = VertexNormals(position_mm, faces);
  for (const GarmentSpan& garment : garments) {
    const auto first = faces.begin() + garment.first_face;
    layers.faces_.emplace_back(first, first + garment.faces);
    WEFT_ASSIGN_OR_RETURN(RayScene scene, RayScene::Build(position_mm, layers.faces_.back()));
    layers.scenes_.push_back(std::move(scene));
  }
  return layers;
}

std::optional<GarmentLayers::Crossing> GarmentLayers::Meets(int vertex, int sign, int garment,
                                                            const std::vector<bool>& hidden,
                                                            double reach_mm) const {
  const Eigen::Vector3f along = (sign * normals_[vertex]).cast<float>();
  if (along.isZero()) return std::nullopt;
  const RayHit hit = scenes_[garment].Cast(position_mm_[vertex].cast<float>(), along);
  if (hit.face < 0 || hit.distance_mm > reach_mm) return std::nullopt;
  const Face& face = faces_[garment][hit.face];
  return Crossing{hit.distance_mm, hit.from_outside,
                  std::all_of(face.begin(), face.end(), [&](int v) { return hidden[v]; })};
}

int GarmentLayers::VotesOver(int over, int under, const std::vector<bool>& hidden, double reach_mm) const {
  const GarmentSpan& garment = garments_[over];
  int votes = 0;
  for (int v = garment.first_vertex; v < garment.first_vertex + garment.vertices; ++v) {
    if (hidden[v]) continue;
    const std::optional<Crossing> in = Meets(v, -1, under, hidden, reach_mm);
    const std::optional<Crossing> out = Meets(v, 1, under, hidden, reach_mm);
    if (!in && !out) continue;
    votes += (!out || (in && in->distance_mm <= out->distance_mm) ? in : out)->hidden;
  }
  return votes;
}

std::vector<GarmentPair> GarmentLayers::Order(const std::vector<bool>& hidden,
                                              const LayerOptions& options) const {
  std::vector<GarmentPair> pairs;
  const int count = static_cast<int>(garments_.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      if (!options.find_order) {
        pairs.push_back({a, b});
        continue;
      }
      const int b_over_a = VotesOver(b, a, hidden, options.reach_mm);
      const int a_over_b = VotesOver(a, b, hidden, options.reach_mm);
      const int most = std::max(a_over_b, b_over_a), all = a_over_b + b_over_a;
      if (most < kMinVotes || most < kMinShare * all) continue;
      pairs.push_back(b_over_a > a_over_b ? GarmentPair{a, b} : GarmentPair{b, a});
    }
  }
  return pairs;
}

// An inner garment (sign -1) is wrong where it sees the other's outside on the way in; an outer one (sign 1)
// where it sees the measured inside of the other on the way out.
int GarmentLayers::DrawGarment(int garment, int other, int sign, const std::vector<bool>& hidden,
                               const LayerOptions& options, ElasticProblem* problem) const {
  int drawn = 0;
  const GarmentSpan& own = garments_[garment];
  for (int v = own.first_vertex; v < own.first_vertex + own.vertices; ++v) {
    if (!hidden[v]) continue;
    const std::optional<Crossing> crossing = Meets(v, sign, other, hidden, options.reach_mm);
    if (!crossing || crossing->from_outside != (sign < 0) || (sign > 0 && crossing->hidden)) continue;
    const Eigen::Vector3d& normal = normals_[v];
    problem->Add(v, position_mm_[v] + sign * (crossing->distance_mm + kBeyondMm) * normal,
                 options.weight * normal * normal.transpose());
    ++drawn;
  }
  return drawn;
}

int GarmentLayers::Draw(const std::vector<GarmentPair>& pairs, const std::vector<bool>& hidden,
                        const LayerOptions& options, ElasticProblem* problem) const {
  int drawn = 0;
  for (const GarmentPair& pair : pairs) {
    drawn += DrawGarment(pair.inner, pair.outer, -1, hidden, options, problem);
    drawn += DrawGarment(pair.outer, pair.inner, 1, hidden, options, problem);
  }
  return drawn;
}

}  // namespace weft

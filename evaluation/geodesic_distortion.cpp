#include "evaluation/geodesic_distortion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "evaluation/geodesics.h"
#include "simulation/random.h"

namespace weft {
namespace {

// Distinct vertices of at least one face.
std::vector<int> DrawSources(const TriangleMesh& mesh, const GeodesicOptions& options) {
  std::vector<bool> used(mesh.vertices_mm.size(), false);
  for (const Face& face : mesh.faces)
    for (const int v : face) used[v] = true;
  std::vector<std::pair<uint64_t, int>> drawn;
  const uint64_t key = KeyOf(options.seed, "geodesic sources");
  for (size_t v = 0; v < used.size(); ++v)
    if (used[v]) drawn.emplace_back(MixBits(key ^ MixBits(v)), static_cast<int>(v));
  const auto count = std::min(drawn.size(), static_cast<size_t>(options.sources));
  std::partial_sort(drawn.begin(), drawn.begin() + static_cast<std::ptrdiff_t>(count), drawn.end());
  std::vector<int> sources;
  for (size_t i = 0; i < count; ++i) sources.push_back(drawn[i].second);
  return sources;
}

std::vector<std::vector<float>> Distances(const GeodesicMesh& mesh, const std::vector<int>& sources) {
  std::vector<std::vector<float>> distances(sources.size());
  tbb::parallel_for(size_t{0}, sources.size(), [&](size_t s) {
    const std::vector<double> mm = mesh.DistancesFrom(sources[s]);
    distances[s].assign(mm.begin(), mm.end());
  });
  return distances;
}

}  // namespace

absl::Status GeodesicOptions::Validate() const {
  if (sources < 1) return absl::InvalidArgumentError("sources must be at least 1");
  return absl::OkStatus();
}

absl::StatusOr<GeodesicDistortion> GeodesicDistortion::Build(const TriangleMesh& rest,
                                                             const GeodesicOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(const GeodesicMesh mesh, GeodesicMesh::Build(rest.vertices_mm, rest.faces));
  GeodesicDistortion out;
  out.faces_ = rest.faces;
  out.vertices_ = rest.vertices_mm.size();
  out.sources_ = DrawSources(rest, options);
  out.rest_mm_ = Distances(mesh, out.sources_);
  return out;
}

absl::StatusOr<DistortionScore> GeodesicDistortion::Measure(
    const std::vector<Eigen::Vector3d>& vertices_mm) const {
  if (vertices_mm.size() != vertices_) {
    return absl::InvalidArgumentError(
        absl::StrCat("the mesh has ", vertices_mm.size(), " vertices, the template ", vertices_));
  }
  WEFT_ASSIGN_OR_RETURN(const GeodesicMesh mesh, GeodesicMesh::Build(vertices_mm, faces_));
  const std::vector<std::vector<float>> now_mm = Distances(mesh, sources_);
  DistortionScore score;
  score.of_vertex_mm.assign(vertices_, 0);
  std::vector<int> reached(vertices_, 0);
  int64_t pairs = 0;
  for (size_t s = 0; s < sources_.size(); ++s) {
    for (size_t v = 0; v < vertices_; ++v) {
      if (!std::isfinite(rest_mm_[s][v]) || rest_mm_[s][v] == 0) continue;
      const double change_mm = std::abs(double{now_mm[s][v]} - rest_mm_[s][v]);
      score.of_vertex_mm[v] += change_mm;
      ++reached[v];
      ++pairs;
      score.mean_mm += change_mm;
      score.mean_relative += change_mm / rest_mm_[s][v];
    }
  }
  if (pairs > 0)
    score.mean_mm /= static_cast<double>(pairs), score.mean_relative /= static_cast<double>(pairs);
  for (size_t v = 0; v < vertices_; ++v)
    score.of_vertex_mm[v] =
        reached[v] > 0 ? score.of_vertex_mm[v] / reached[v] : std::numeric_limits<double>::quiet_NaN();
  return score;
}

}  // namespace weft

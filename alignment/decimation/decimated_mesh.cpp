#include "alignment/decimation/decimated_mesh.h"

#include <meshoptimizer.h>

#include <cstring>

#include "absl/strings/str_cat.h"
#include "alignment/decimation/edge_flips.h"
#include "base/random.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr int kMaxRounds = 8;
// By how much of the mean edge vertices are shaken, so that what each adds to the shape is the same
// everywhere. Without, flat cloth gets faces 18 times the middle one. Of the shipped T-shirt, 5,076 vertices
// to 2,000, 0.1, 0.2 and 0.5 spread the rest alike, and fold 4, 23 and 51 edges over (`weft export --format
// obj --max-vertices 2000`).
constexpr double kEvenness = 0.1;

absl::Status CheckForDecimation(const TriangleMesh& mesh, size_t max_vertices) {
  if (max_vertices < 3) return absl::InvalidArgumentError("max_vertices: a mesh has at least 3");
  if (mesh.faces.empty()) return absl::InvalidArgumentError("the mesh has no faces");
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v)
    if (!mesh.vertices_mm[v].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, ": its position is not finite"));
  for (size_t f = 0; f < mesh.faces.size(); ++f)
    for (const int v : mesh.faces[f])
      if (v < 0 || static_cast<size_t>(v) >= mesh.vertices_mm.size())
        return absl::InvalidArgumentError(absl::StrCat("face ", f, ": names vertex ", v, ", the mesh has ",
                                                       mesh.vertices_mm.size(), " vertices"));
  return absl::OkStatus();
}

double MeanFirstEdgeMm(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Face& face : mesh.faces) sum += (mesh.vertices_mm[face[0]] - mesh.vertices_mm[face[1]]).norm();
  return sum / static_cast<double>(mesh.faces.size());
}

// From -1 to 1, the same for the same position: vertices that coincide stay together.
Eigen::Vector3f JitterOf(const Eigen::Vector3d& position) {
  uint64_t bits = 0;
  for (const double coordinate : position) {
    uint64_t word = 0;
    std::memcpy(&word, &coordinate, sizeof(word));
    bits = MixBits(bits ^ word);
  }
  Random random(bits);
  Eigen::Vector3f jitter;
  for (float& j : jitter) j = static_cast<float>(random.Below(2001)) / 1000.0f - 1;
  return jitter;
}

std::vector<Eigen::Vector3f> Jittered(const TriangleMesh& mesh) {
  const auto amplitude = static_cast<float>(kEvenness * MeanFirstEdgeMm(mesh));
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(mesh.vertices_mm.size());
  for (const Eigen::Vector3d& p : mesh.vertices_mm)
    positions.emplace_back((p - mesh.vertices_mm[0]).cast<float>() + amplitude * JitterOf(p));
  return positions;
}

std::vector<int> UsedVertices(const std::vector<unsigned>& indices, size_t vertices) {
  std::vector<bool> used(vertices, false);
  for (const unsigned index : indices) used[index] = true;
  std::vector<int> kept;
  for (size_t v = 0; v < vertices; ++v)
    if (used[v]) kept.push_back(static_cast<int>(v));
  return kept;
}

}  // namespace

absl::StatusOr<DecimatedMesh> DecimateMesh(const TriangleMesh& mesh, size_t max_vertices,
                                           const std::vector<Eigen::Vector2f>& places) {
  WEFT_RETURN_IF_ERROR(CheckForDecimation(mesh, max_vertices));
  std::vector<unsigned> indices;
  indices.reserve(3 * mesh.faces.size());
  for (const Face& face : mesh.faces)
    for (const int v : face) indices.push_back(static_cast<unsigned>(v));
  const size_t all = mesh.vertices_mm.size();
  DecimatedMesh out;
  out.vertices = UsedVertices(indices, all);
  if (out.vertices.size() > max_vertices) {
    const std::vector<Eigen::Vector3f> positions = Jittered(mesh);
    // How many vertices a number of faces leaves depends on the openings, so this is repeated.
    for (int round = 0; round < kMaxRounds && out.vertices.size() > max_vertices; ++round) {
      const double share = static_cast<double>(max_vertices) / static_cast<double>(out.vertices.size());
      const auto target = static_cast<size_t>(share * static_cast<double>(indices.size() / 3)) * 3;
      std::vector<unsigned> fewer(indices.size());
      fewer.resize(meshopt_simplify(fewer.data(), indices.data(), indices.size(), positions[0].data(), all,
                                    sizeof(Eigen::Vector3f), target, HUGE_VALF));
      if (fewer.size() >= indices.size()) break;
      indices = std::move(fewer);
      out.vertices = UsedVertices(indices, all);
    }
  }
  for (size_t i = 0; i + 2 < indices.size(); i += 3)
    out.faces.push_back(
        {static_cast<int>(indices[i]), static_cast<int>(indices[i + 1]), static_cast<int>(indices[i + 2])});
  if (indices.size() < 3 * mesh.faces.size()) FlipBadEdges(mesh.vertices_mm, places, out.faces);
  std::vector<int> number(all, -1);
  for (size_t k = 0; k < out.vertices.size(); ++k) number[out.vertices[k]] = static_cast<int>(k);
  for (Face& face : out.faces)
    for (int& v : face) v = number[v];
  return out;
}

}  // namespace weft

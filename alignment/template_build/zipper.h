// Triangles that close seams and small holes.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template_build/seams.h"

namespace weft {

// The strip of triangles between both sides of a seam, each of its edges used once: of all such strips the
// one whose edges across are shortest (sum of squares). Both sides keep their vertices, whatever their
// densities.
std::vector<Face> ZipSeam(const Seam& seam, const std::vector<Eigen::Vector3d>& position_mm);

// Pairs of a vertex of side_a and one of side_b that the edges across that strip join, from end to end.
std::vector<std::pair<int, int>> EdgesAcross(const Seam& seam,
                                             const std::vector<Eigen::Vector3d>& position_mm);

// Points along the middle of that strip, from the first to the last edge across, about `spacing_mm` apart:
// where both sides would meet if each went on as it is. `outward`: unit vectors in the cloth's surface away
// from its panel, [vertices], needed at both sides.
std::vector<Eigen::Vector3d> SeamMiddle(const Seam& seam, const std::vector<Eigen::Vector3d>& position_mm,
                                        const std::vector<Eigen::Vector3d>& outward, double spacing_mm);

// Triangles of least total area over a hole, without new vertices. `loop` is a border as CheckTopology gives
// it. No triangle doubles an edge that `faces` hold, nor closes two corners of one face into another.
// FailedPrecondition when there is none, or when the loop has more than 300 vertices.
absl::StatusOr<std::vector<Face>> FillHole(const std::vector<int>& loop,
                                           const std::vector<Eigen::Vector3d>& position_mm,
                                           const std::vector<Face>& faces);

}  // namespace weft

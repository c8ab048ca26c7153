// The templates of several garments as one, for takes that show them together.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_parts.h"
#include "alignment/template.h"

namespace weft {

struct JointTemplate {
  Template garment;
  GarmentParts parts;  // without texture
};

// From the innermost to the outermost; `parts` belong to `garments`, as many. Vertices, faces, panels, seams
// and openings follow each other in that order. Each garment's nodes move to its board's rows of the joint
// board. InvalidArgument: fewer than two, a garment whose board is none of the joint one's parts (named with
// both hashes), two of the same board, ids that occur twice, a joint template among them.
absl::StatusOr<JointTemplate> JoinTemplates(std::string id, const std::vector<Template>& garments,
                                            const std::vector<GarmentParts>& parts, const Board& joint);

// A garment of a joint template, or of a mesh of it: its own vertices and faces. The index must be valid.
TriangleMesh MeshOfGarment(const GarmentMesh& joint, int garment,
                           const std::vector<Eigen::Vector3d>& vertices_mm);
RegisteredMesh MeshOfSpan(const GarmentSpan& garment, const RegisteredMesh& joint);

// The rows of a board that a garment has nodes in: they tell its nodes from those of other garments.
class GarmentRows {
 public:
  explicit GarmentRows(const Template& garment);
  // A corner belongs to the cells above it, too.
  bool Contains(const BoardNode& node) const {
    return rows_.contains(node.row) || (node.kind == NodeKind::kCorner && rows_.contains(node.row - 1));
  }

 private:
  std::set<int> rows_;
};

}  // namespace weft

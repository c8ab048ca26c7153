#include "alignment/mapped_mesh.h"

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

std::string NodeText(const VertexNode& node) {
  return absl::StrCat(node.IsCorner() ? "corner (" : "cell (", node.row, ", ", node.col, ")");
}

}  // namespace

std::vector<GarmentFaces> GarmentsOf(const Template& garment) {
  const std::span<const Face> all = garment.rest.faces;
  if (garment.garments.empty()) return {{"", all}};
  std::vector<GarmentFaces> out;
  for (const GarmentSpan& one : garment.garments)
    out.push_back({one.id, all.subspan(static_cast<size_t>(one.first_face), static_cast<size_t>(one.faces))});
  return out;
}

absl::Status OfGarment(const std::string& id, const absl::Status& status) {
  if (status.ok() || id.empty()) return status;
  return absl::Status(status.code(), absl::StrCat("garment ", id, ": ", status.message()));
}

std::string VertexText(int v, const std::vector<VertexNode>& nodes) {
  return absl::StrCat("vertex ", v, " is ", NodeText(nodes[static_cast<size_t>(v)]));
}

Mapped MappedOf(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces,
                const std::vector<VertexNode>& nodes) {
  return {vertices_mm, nodes, MedianLengthPerCell(SampleNodeEdges(vertices_mm, faces, nodes))};
}

FaceOnBoard OnBoard(const Face& face, const Mapped& mapped) {
  FaceOnBoard out;
  const bool node[3] = {mapped.NodeOf(face[0]).row >= 0, mapped.NodeOf(face[1]).row >= 0,
                        mapped.NodeOf(face[2]).row >= 0};
  for (int i = 0; i < 3; ++i) {
    const int next = (i + 1) % 3;
    if (!node[i] || !node[next]) continue;
    ++out.edges;
    out.is_apart[i] = mapped.Apart(face[i], face[next]);
    out.apart += out.is_apart[i];
  }
  if (out.edges < 3 || out.apart > 0) return out;
  const Eigen::Vector2d first = mapped.NodeOf(face[0]).PlaceInCells();
  const Eigen::Vector2d p = mapped.NodeOf(face[1]).PlaceInCells() - first;
  const Eigen::Vector2d q = mapped.NodeOf(face[2]).PlaceInCells() - first;
  // Columns run to the right and rows down, so that what is counter-clockwise to the eye has a negative area.
  const double twice_area = p.x() * q.y() - p.y() * q.x();
  out.sense = twice_area > 0 ? -1 : twice_area < 0 ? 1 : 0;
  return out;
}

}  // namespace weft

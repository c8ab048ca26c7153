#include "alignment/joint_template.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "pattern/board/joint_board.h"

namespace weft {
namespace {

std::vector<int> Shifted(std::vector<int> numbers, int by) {
  for (int& n : numbers)
    if (n >= 0) n += by;
  return numbers;
}

// The part of the joint board that a garment was sewn from.
absl::StatusOr<int> PartOf(const Template& garment, const Board& joint) {
  std::string hashes;
  for (size_t i = 0; i < joint.parts.size(); ++i) {
    const std::string hash = PartOfBoard(joint, static_cast<int>(i)).ContentHash();
    if (hash == garment.board_hash) return static_cast<int>(i);
    absl::StrAppend(&hashes, hashes.empty() ? "" : ", ", hash);
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "the template ", garment.id, " was sewn from the board with hash ", garment.board_hash,
      "; the parts of board ", joint.id, " have ", hashes.empty() ? "no hashes: it is not joined" : hashes));
}

void AddParts(const GarmentParts& own, int row, int vertex, GarmentParts* all) {
  const int panel = static_cast<int>(all->panels.size());
  for (TemplatePanel p : own.panels) {
    p.first_row += row, p.last_row += row;
    all->panels.push_back(p);
  }
  for (Seam seam : own.seams) {
    seam.side_a = Shifted(std::move(seam.side_a), vertex);
    seam.side_b = Shifted(std::move(seam.side_b), vertex);
    seam.middle = Shifted(std::move(seam.middle), vertex);
    if (seam.panel_a >= 0) seam.panel_a += panel;
    if (seam.panel_b >= 0) seam.panel_b += panel;
    all->seams.push_back(std::move(seam));
  }
  for (TemplateBorder opening : own.openings) {
    opening.loop = Shifted(std::move(opening.loop), vertex);
    opening.panels = Shifted(std::move(opening.panels), panel);
    all->openings.push_back(std::move(opening));
  }
  all->any_scale = all->any_scale || own.any_scale;
  const bool said = own.expected_openings >= 0 && all->expected_openings >= 0;
  all->expected_openings = said ? all->expected_openings + own.expected_openings : -1;
}

}  // namespace

absl::StatusOr<JointTemplate> JoinTemplates(std::string id, const std::vector<Template>& garments,
                                            const std::vector<GarmentParts>& parts, const Board& joint) {
  if (garments.size() < 2) return absl::InvalidArgumentError("give two templates or more to join");
  JointTemplate out;
  out.garment.id = std::move(id);
  out.garment.board_hash = joint.ContentHash();
  out.parts.cell_mm = joint.cell_mm;
  out.parts.board_rows = joint.rows, out.parts.board_cols = joint.cols;
  out.parts.expected_openings = 0;
  std::vector<bool> taken(joint.parts.size(), false);
  for (size_t i = 0; i < garments.size(); ++i) {
    const Template& own = garments[i];
    if (!own.garments.empty())
      return absl::InvalidArgumentError(absl::StrCat(
          "the template ", own.id, " is a joint one itself; give the templates that it was joined of"));
    WEFT_ASSIGN_OR_RETURN(const int part, PartOf(own, joint));
    if (taken[static_cast<size_t>(part)])
      return absl::InvalidArgumentError(absl::StrCat("two templates were sewn from board ",
                                                     joint.parts[static_cast<size_t>(part)].id,
                                                     "; garments of one take need boards of their own"));
    taken[static_cast<size_t>(part)] = true;
    const int row = joint.parts[static_cast<size_t>(part)].first_row;
    TriangleMesh& rest = out.garment.rest;
    const int vertex = static_cast<int>(rest.vertices_mm.size()), face = static_cast<int>(rest.faces.size());
    out.garment.garments.push_back({own.id, vertex, static_cast<int>(own.rest.vertices_mm.size()), face,
                                    static_cast<int>(own.rest.faces.size())});
    rest.vertices_mm.insert(rest.vertices_mm.end(), own.rest.vertices_mm.begin(), own.rest.vertices_mm.end());
    for (const Face& f : own.rest.faces) rest.faces.push_back({f[0] + vertex, f[1] + vertex, f[2] + vertex});
    for (VertexNode node : own.node_of_vertex) {
      if (node.row >= 0) node.row += row;
      out.garment.node_of_vertex.push_back(node);
    }
    AddParts(parts[i], row, vertex, &out.parts);
  }
  WEFT_RETURN_IF_ERROR(CheckGarmentSpans(out.garment));
  return out;
}

TriangleMesh MeshOfGarment(const GarmentMesh& joint, int garment,
                           const std::vector<Eigen::Vector3d>& vertices_mm) {
  const GarmentSpan& one = joint.garments[static_cast<size_t>(garment)];
  TriangleMesh mesh;
  const auto first = vertices_mm.begin() + one.first_vertex;
  mesh.vertices_mm.assign(first, first + one.vertices);
  for (int f = one.first_face; f < one.first_face + one.faces; ++f) {
    const Face& face = joint.rest.faces[static_cast<size_t>(f)];
    mesh.faces.push_back(
        {face[0] - one.first_vertex, face[1] - one.first_vertex, face[2] - one.first_vertex});
  }
  return mesh;
}

RegisteredMesh MeshOfSpan(const GarmentSpan& garment, const RegisteredMesh& joint) {
  const auto slice = [&](const auto& all) {
    using Slice = std::remove_cvref_t<decltype(all)>;
    if (all.empty()) return Slice();
    const auto first = all.begin() + garment.first_vertex;
    return Slice(first, first + garment.vertices);
  };
  return {slice(joint.vertices_mm), slice(joint.state), slice(joint.sigma_mm), slice(joint.views)};
}

GarmentRows::GarmentRows(const Template& garment) {
  for (const VertexNode& node : garment.node_of_vertex)
    if (node.row >= 0) rows_.insert(node.row);
}

}  // namespace weft

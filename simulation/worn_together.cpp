#include "simulation/worn_together.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "pattern/board/joint_board.h"

namespace weft {
namespace {

template <typename T>
void AppendAll(const std::vector<T>& more, std::vector<T>& to) {
  to.insert(to.end(), more.begin(), more.end());
}

void AddGarment(const std::string& name, const Outfit& one, Outfit& all) {
  SewnPanels& sewn = all.sewn;
  Garment& garment = sewn.garment;
  const Garment& own = one.sewn.garment;
  const int vertices = static_cast<int>(all.start_mm.size()),
            faces = static_cast<int>(garment.rest.faces.size());
  const int panels = faces == 0 ? 0 : sewn.panel_of_face.back() + 1;
  const int row = faces == 0 ? 0 : garment.board_rows + kRowsBetweenParts;
  garment.worn.push_back({name, vertices, static_cast<int>(one.start_mm.size()), faces,
                          static_cast<int>(own.rest.faces.size()), row, own.board_rows, own.board_cols});
  garment.board_rows = row + own.board_rows;
  garment.board_cols = std::max(garment.board_cols, own.board_cols);
  garment.cell_mm = own.cell_mm;

  AppendAll(one.start_mm, all.start_mm);
  AppendAll(own.rest.vertices_mm, garment.rest.vertices_mm);
  for (const Face& f : own.rest.faces)
    garment.rest.faces.push_back({f[0] + vertices, f[1] + vertices, f[2] + vertices});
  for (VertexNode node : own.cell_of_vertex) {
    if (node.row >= 0) node.row += row;
    garment.cell_of_vertex.push_back(node);
  }
  for (std::array<BoardPoint, 3> corners : own.print.of_face) {
    for (BoardPoint& p : corners) p.y() += row;
    garment.print.of_face.push_back(corners);
  }
  for (PanelPlace place : one.sewn.place_of_vertex) {
    place.panel += panels;
    sewn.place_of_vertex.push_back(place);
  }
  for (const int panel : one.sewn.panel_of_face) sewn.panel_of_face.push_back(panel + panels);
  AppendAll(one.sewn.place_of_face, sewn.place_of_face);
  for (const auto& [seam, of_seam] : one.sewn.of_seam) {
    std::vector<int>& moved = sewn.of_seam[absl::StrCat(name, "/", seam)];
    for (const int v : of_seam) moved.push_back(v + vertices);
  }
  for (const int v : one.waist) all.waist.push_back(v + vertices);
}

}  // namespace

Outfit WearTogether(std::vector<std::pair<std::string, Outfit>> garments) {
  Outfit all;
  for (const auto& [name, one] : garments) AddGarment(name, one, all);
  return all;
}

absl::StatusOr<Outfit> MakeShirtAndSkirt(double cell_mm) {
  WEFT_ASSIGN_OR_RETURN(Outfit skirt, MakeSkirt(cell_mm));
  WEFT_ASSIGN_OR_RETURN(Outfit shirt, MakeTShirt(cell_mm, {480, 256, true}));
  std::vector<std::pair<std::string, Outfit>> garments;
  garments.emplace_back("skirt", std::move(skirt));
  garments.emplace_back("shirt", std::move(shirt));
  return WearTogether(std::move(garments));
}

}  // namespace weft

// Templates of the synthetic studio's garments, from the cells of their meshes alone.
#include <gtest/gtest.h>

#include "alignment/template_build/build_template.h"
#include "alignment/template_build/mesh_topology.h"
#include "simulation/wardrobe.h"

namespace weft {
namespace {

struct Dressed {
  Board board;
  Cloud cloud;
  int openings = 0;  // of the garment's own mesh
};

// The garment as it is put on.
Dressed PutOn(const Outfit& outfit) {
  const Garment& garment = outfit.sewn.garment;
  Dressed worn{{"worn", garment.board_rows, garment.board_cols, garment.cell_mm, 0.75, {}}, {}, 0};
  for (int i = 0; i < garment.board_rows * garment.board_cols; ++i) {
    worn.board.cells.push_back(
        static_cast<CellColor>((i % garment.board_cols + 3 * (i / garment.board_cols)) % kCellColors));
  }
  for (size_t v = 0; v < garment.cell_of_vertex.size(); ++v) {
    const VertexNode& cell = garment.cell_of_vertex[v];
    if (cell.row < 0) continue;
    CloudPoint point;
    point.position_mm = outfit.start_mm[v];
    point.node = {cell.row, cell.col, NodeKind::kCenter};
    worn.cloud.points.push_back(point);
  }
  const auto topology = CheckTopology(static_cast<int>(garment.cell_of_vertex.size()), garment.rest.faces);
  EXPECT_TRUE(topology.ok()) << topology.status();
  worn.openings = static_cast<int>(topology->loops.size());
  return worn;
}

// Before the body fills it the cloth is stretched in places, and the sides of some seams are further apart
// than when it is worn.
void ExpectBuilt(const Outfit& outfit, double max_gap_mm, int panels, int seams) {
  const Dressed worn = PutOn(outfit);
  TemplateBuildOptions options;
  options.openings = worn.openings;
  options.seams.max_gap_mm = max_gap_mm;
  options.panels.cut_pitches = 4;
  const auto built = BuildTemplate(worn.board, {{worn.cloud}, {}, {}}, options);
  ASSERT_TRUE(built.ok()) << built.status();
  EXPECT_EQ(static_cast<int>(built->parts.panels.size()), panels);
  EXPECT_EQ(static_cast<int>(built->parts.seams.size()), seams);
  EXPECT_EQ(static_cast<int>(built->parts.openings.size()), worn.openings);
  EXPECT_EQ(built->genus, 0);
  EXPECT_GE(built->garment.node_of_vertex.size(), 0.99 * static_cast<double>(worn.cloud.points.size()));
}

TEST(BuildTemplateOfSimulatedGarments, TShirt) {
  const auto outfit = MakeTShirt(8);
  ASSERT_TRUE(outfit.ok()) << outfit.status();
  ExpectBuilt(*outfit, 54, 5, 13);  // the collar's own is three cells long
}

TEST(BuildTemplateOfSimulatedGarments, Skirt) {
  const auto outfit = MakeSkirt(8);
  ASSERT_TRUE(outfit.ok()) << outfit.status();
  ExpectBuilt(*outfit, 0, 2, 2);
}

}  // namespace
}  // namespace weft

#include "alignment/joint_template.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pattern/board/joint_board.h"
#include "tests/pattern/board/boards_apart.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A flat piece of cloth with a vertex on each cell of the board.
Template SheetOf(const std::string& id, const Board& board) {
  TriangleMesh mesh;
  std::vector<VertexNode> nodes;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      mesh.vertices_mm.emplace_back(col, row, id.size());
      nodes.push_back({row, col});
      if (row == 0 || col == 0) continue;
      const int v = row * board.cols + col;
      mesh.faces.push_back({v, v - 1, v - board.cols - 1});
      mesh.faces.push_back({v, v - board.cols - 1, v - board.cols});
    }
  }
  return *ImportTemplate(id, mesh, nodes, board);
}

class JoinTemplatesTest : public ::testing::Test {
 protected:
  const Board skirt_board_ = BoardApartFrom({}, 12, 20, 1),
              shirt_board_ = BoardApartFrom({skirt_board_}, 10, 14, 2);
  const Board joint_board_ = *JoinBoards({shirt_board_, skirt_board_});
  const Template skirt_ = SheetOf("skirt", skirt_board_), shirt_ = SheetOf("shirt", shirt_board_);
};

// The order of the templates is that of the layers, whatever the order of the boards.
TEST_F(JoinTemplatesTest, EachGarmentKeepsItsMeshAndItsCells) {
  GarmentParts of_skirt, of_shirt;
  of_skirt.panels.push_back({240, 0, 11, 0, 19});
  of_skirt.openings.push_back({{3, 4, 5}, 12.5, {0}});
  of_shirt.panels.push_back({140, 0, 9, 0, 13});
  of_shirt.seams.push_back({{0, 1}, {14, 15}, 0, 0, 3, 0, 0, false, {28}});
  const auto joint = JoinTemplates("outfit", {skirt_, shirt_}, {of_skirt, of_shirt}, joint_board_);
  ASSERT_TRUE(joint.ok()) << joint.status();
  const Template& garment = joint->garment;
  ASSERT_EQ(garment.garments.size(), 2);
  EXPECT_EQ(garment.garments[0], (GarmentSpan{"skirt", 0, 240, 0, 2 * 11 * 19}));
  EXPECT_EQ(garment.garments[1], (GarmentSpan{"shirt", 240, 140, 2 * 11 * 19, 2 * 9 * 13}));
  // The nodes name the same colours on the joint board as on their own ones.
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const VertexNode& node = garment.node_of_vertex[v];
    const bool is_skirt = v < 240;
    const VertexNode& own = is_skirt ? skirt_.node_of_vertex[v] : shirt_.node_of_vertex[v - 240];
    const Board& board = is_skirt ? skirt_board_ : shirt_board_;
    ASSERT_EQ(joint_board_.at(node.row, node.col), board.at(own.row, own.col)) << v;
  }
  EXPECT_EQ(joint->parts.panels[0].first_row, 10 + kRowsBetweenParts);
  EXPECT_EQ(joint->parts.seams[0].panel_a, 1);
  EXPECT_EQ(joint->parts.seams[0].side_b[1], 240 + 15);
  EXPECT_EQ(joint->parts.openings[0].loop[0], 3);
  const TriangleMesh back = MeshOfGarment(garment, 1, garment.rest.vertices_mm);
  EXPECT_EQ(back.faces, shirt_.rest.faces);
  EXPECT_EQ(back.vertices_mm, shirt_.rest.vertices_mm);
  const GarmentRows of_skirt_alone(skirt_);
  EXPECT_TRUE(of_skirt_alone.Contains({11, 3}));
  EXPECT_FALSE(of_skirt_alone.Contains({12, 3}));
  EXPECT_TRUE(of_skirt_alone.Contains({12, 3, NodeKind::kCorner}));
  EXPECT_FALSE(of_skirt_alone.Contains({13, 3, NodeKind::kCorner}));
  EXPECT_TRUE(CheckGarmentMesh(garment.rest).ok());
  EXPECT_TRUE(CheckVertexNodes(garment.node_of_vertex, garment.node_of_vertex.size(), joint_board_).ok());
}

TEST_F(JoinTemplatesTest, RefusesGarmentsThatDoNotBelongToTheBoard) {
  const auto join = [&](const std::vector<Template>& garments, const Board& board) {
    const auto joint = JoinTemplates("outfit", garments, std::vector<GarmentParts>(garments.size()), board);
    return std::string(joint.status().message());
  };
  const Board other = BoardApartFrom({}, 12, 12, 9);
  EXPECT_THAT(
      join({skirt_, SheetOf("scarf", other)}, joint_board_),
      AllOf(HasSubstr("scarf"), HasSubstr(other.ContentHash()), HasSubstr(shirt_board_.ContentHash())));
  EXPECT_THAT(join({skirt_, shirt_}, skirt_board_), HasSubstr("it is not joined"));
  EXPECT_THAT(join({skirt_, SheetOf("second", skirt_board_)}, joint_board_),
              HasSubstr("two templates were sewn"));
  EXPECT_THAT(join({skirt_, SheetOf("skirt", shirt_board_)}, joint_board_),
              HasSubstr("another garment has this id"));
  EXPECT_THAT(join({skirt_}, joint_board_), HasSubstr("two templates or more"));
}

TEST_F(JoinTemplatesTest, GarmentsMustCoverTheMesh) {
  Template garment = JoinTemplates("outfit", {skirt_, shirt_}, {{}, {}}, joint_board_)->garment;
  const std::string hash = garment.ContentHash();
  garment.garments[0].id = "kilt";
  EXPECT_NE(garment.ContentHash(), hash);
  garment.garments[1].vertices = 139;
  EXPECT_THAT(CheckGarmentSpans(garment).message(), HasSubstr("of another garment"));
  garment.garments.pop_back();
  EXPECT_THAT(CheckGarmentSpans(garment).message(), HasSubstr("the mesh has 380"));
  garment.garments[0].first_vertex = 1;
  EXPECT_THAT(CheckGarmentSpans(garment).message(), HasSubstr("begins at vertex 1"));
}

}  // namespace
}  // namespace weft

#include "alignment/template_build/mesh_topology.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(CheckTopology, CountsBordersAndHandles) {
  const auto tetrahedron = CheckTopology(5, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}});
  ASSERT_TRUE(tetrahedron.ok()) << tetrahedron.status();
  EXPECT_EQ(tetrahedron->euler, 2);
  EXPECT_EQ(tetrahedron->genus, 0);
  EXPECT_EQ(tetrahedron->components, 1);
  EXPECT_TRUE(tetrahedron->loops.empty());

  // A torus of 4 x 4 squares.
  std::vector<Face> faces;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      const int v00 = 4 * r + c, v01 = 4 * r + (c + 1) % 4;
      const int v10 = 4 * ((r + 1) % 4) + c, v11 = 4 * ((r + 1) % 4) + (c + 1) % 4;
      faces.push_back({v00, v10, v11});
      faces.push_back({v00, v11, v01});
    }
  }
  const auto torus = CheckTopology(16, faces);
  ASSERT_TRUE(torus.ok()) << torus.status();
  EXPECT_EQ(torus->genus, 1);

  faces.pop_back();  // a hole
  const auto open = CheckTopology(16, faces);
  ASSERT_TRUE(open.ok()) << open.status();
  EXPECT_EQ(open->genus, 1);
  ASSERT_EQ(open->loops.size(), 1u);
  EXPECT_EQ(open->loops[0].size(), 3u);
}

TEST(CheckTopology, WalksBordersWithTheClothToTheLeft) {
  const auto square = CheckTopology(4, {{0, 1, 2}, {0, 2, 3}});
  ASSERT_TRUE(square.ok());
  ASSERT_EQ(square->loops.size(), 1u);
  EXPECT_THAT(square->loops[0], ElementsAre(0, 1, 2, 3));
}

TEST(CheckTopology, NamesWhatIsNoSurface) {
  EXPECT_THAT(std::string(CheckTopology(4, {{0, 1, 2}, {0, 1, 3}}).status().message()),
              HasSubstr("edge from vertex 0 to 1"));
  EXPECT_THAT(std::string(CheckTopology(5, {{0, 1, 2}, {0, 3, 4}}).status().message()),
              HasSubstr("vertex 0: pieces of the surface merely touch"));
  // Two closed surfaces that share a vertex.
  EXPECT_THAT(
      std::string(
          CheckTopology(
              7, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}, {0, 4, 5}, {0, 6, 4}, {4, 6, 5}, {5, 6, 0}})
              .status()
              .message()),
      HasSubstr("vertex 0: pieces of the surface merely touch"));
}

}  // namespace
}  // namespace weft

#include "services/work/animation/seam_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

// The tube's first and last column lie apart on the board and are sewn together.
TEST(SeamVertices, LieWithinSoManyTexels) {
  const Template tube = TubeTemplate();
  for (const int level : {0, 1}) {
    const auto near = VerticesNearSeams(tube, {.level = level}, 2);
    ASSERT_TRUE(near.ok()) << near.status();
    ASSERT_EQ(near->size(), tube.rest.vertices_mm.size());
    const int wide = 2 << level;  // columns of cells
    for (size_t v = 0; v < near->size(); ++v) {
      const int column = tube.node_of_vertex[v].col, from_seam = std::min(column, 59 - column);
      // Texels need not begin at the seam, and between them it may be either.
      if (std::abs(from_seam - wide) <= 1 << level) continue;
      EXPECT_EQ((*near)[v], from_seam < wide) << "column " << column << ", level " << level;
    }
  }
}

TEST(SeamVertices, RefuseWhatIsNoAtlas) {
  EXPECT_FALSE(VerticesNearSeams(TubeTemplate(), {.level = -1}, 2).ok());
}

}  // namespace
}  // namespace weft

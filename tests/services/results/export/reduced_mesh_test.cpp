#include "services/results/export/reduced_mesh.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace weft {
namespace {

constexpr int kAround = 40, kRows = 30;

// A tube whose print is cut open along one line: faces across it continue the print to u = 1.
struct Tube {
  TriangleMesh mesh;
  MeshTexture texture;
};

Tube MakeTube() {
  Tube tube;
  const auto u_of = [](int col) { return static_cast<float>(col) / kAround; };
  const auto v_of = [](int row) { return static_cast<float>(row) / (kRows - 1); };
  for (int row = 0; row < kRows; ++row) {
    for (int col = 0; col < kAround; ++col) {
      const double angle = 2 * std::numbers::pi * col / kAround;
      tube.mesh.vertices_mm.emplace_back(100 * std::cos(angle), 100 * std::sin(angle), 15.0 * row);
      tube.texture.of_vertex.emplace_back(u_of(col), v_of(row));
    }
  }
  for (int row = 0; row + 1 < kRows; ++row) {
    for (int col = 0; col < kAround; ++col) {
      const int next = (col + 1) % kAround;
      const auto at = [](int r, int c) { return kAround * r + c; };
      tube.mesh.faces.push_back({at(row, col), at(row, next), at(row + 1, col)});
      tube.texture.of_corner.push_back(
          {Eigen::Vector2f(u_of(col), v_of(row)), {u_of(col + 1), v_of(row)}, {u_of(col), v_of(row + 1)}});
      tube.mesh.faces.push_back({at(row, next), at(row + 1, next), at(row + 1, col)});
      tube.texture.of_corner.push_back({Eigen::Vector2f(u_of(col + 1), v_of(row)),
                                        {u_of(col + 1), v_of(row + 1)},
                                        {u_of(col), v_of(row + 1)}});
    }
  }
  return tube;
}

TEST(ReduceMeshTest, KeepsPlacesOnThePrintAndSeams) {
  const Tube tube = MakeTube();
  const auto reduced = ReduceMesh(tube.mesh, tube.texture, 200);
  ASSERT_TRUE(reduced.ok()) << reduced.status();
  EXPECT_LE(reduced->vertices.size(), 200u);
  EXPECT_GT(reduced->vertices.size(), 120u);
  EXPECT_TRUE(std::is_sorted(reduced->vertices.begin(), reduced->vertices.end()));
  ASSERT_EQ(reduced->texture.of_corner.size(), reduced->faces.size());
  double area = 0;
  size_t folded = 0;
  std::map<std::pair<int, int>, int> sides;
  for (size_t f = 0; f < reduced->faces.size(); ++f) {
    const auto& uv = reduced->texture.of_corner[f];
    for (int k = 0; k < 3; ++k) {
      const int vertex = reduced->vertices[reduced->faces[f][k]];
      const float u = static_cast<float>(vertex % kAround) / kAround;
      EXPECT_TRUE(uv[k].x() == u || (vertex % kAround == 0 && uv[k].x() == 1)) << vertex;
      EXPECT_EQ(uv[k].y(), tube.texture.of_vertex[vertex].y());
      const std::pair edge = std::minmax(reduced->faces[f][k], reduced->faces[f][(k + 1) % 3]);
      ++sides[edge];
    }
    const Eigen::Vector2f b = uv[1] - uv[0], c = uv[2] - uv[0];
    folded += b.x() * c.y() - b.y() * c.x() <= 0;
    area += 0.5 * (b.x() * c.y() - b.y() * c.x());
  }
  EXPECT_NEAR(area, 1, 1e-5);  // the whole print, once
  EXPECT_LE(folded, reduced->faces.size() / 50);
  // Closed around: only the two rims are open.
  std::set<int> open_rows;
  for (const auto& [edge, count] : sides) {
    EXPECT_LE(count, 2);
    if (count == 2) continue;
    for (const int v : {edge.first, edge.second}) open_rows.insert(reduced->vertices[v] / kAround);
  }
  EXPECT_EQ(open_rows, (std::set<int>{0, kRows - 1}));
}

TEST(ReduceMeshTest, WorksWithoutTextureAndIsTheSameEachTime) {
  const Tube tube = MakeTube();
  const auto first = ReduceMesh(tube.mesh, {}, 300), second = ReduceMesh(tube.mesh, {}, 300);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_TRUE(first->texture.empty());
  EXPECT_EQ(first->vertices, second->vertices);
  EXPECT_EQ(first->faces, second->faces);
  EXPECT_FALSE(ReduceMesh(tube.mesh, {}, 2).ok());
}

}  // namespace
}  // namespace weft

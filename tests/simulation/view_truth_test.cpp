#include "simulation/view_truth.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <bit>
#include <cmath>
#include <map>

#include "simulation/take_presets.h"
#include "tests/simulation/flat_studio.h"

namespace weft {
namespace {

ViewTruth TruthOf(const TriangleMesh& mesh, const ClothPrint& print, const CameraModel& camera) {
  const absl::StatusOr<RayScene> rays = RayScene::Build(mesh.vertices_mm, mesh.faces);
  EXPECT_TRUE(rays.ok()) << rays.status();
  return FindViewTruth(mesh, PrintLocator(print), *rays, camera);
}

ViewTruth TruthOf(const Cloth& cloth, const CameraModel& camera) {
  return TruthOf(cloth.rest, cloth.print, camera);
}

TEST(ViewTruth, FlatSheetIsSeenWhereItsCellsProject) {
  const Cloth cloth = FlatSheet(12, 16);
  const CameraModel camera = FlatCamera(1000, 300, 0);
  const ViewTruth truth = TruthOf(cloth, camera);
  int centers = 0, corners = 0;
  for (const NodeTruth& n : truth.nodes) {
    const bool center = n.node.kind == NodeKind::kCenter;
    const double half = center ? 0.5 : 0;
    const Eigen::Vector2d expected(157.3 + 1000 * (n.node.col + half - 8) * kFlatCellMm / 300,
                                   121.8 + 1000 * (n.node.row + half - 6) * kFlatCellMm / 300);
    EXPECT_LT((n.pixel_px - expected).norm(), 1e-6);
    EXPECT_NEAR(n.pitch_px, 1000 * kFlatCellMm / 300, 1e-6);
    EXPECT_EQ(n.vertex, center ? n.node.row * 16 + n.node.col : -1);
    // At the four outer corners only 4 of the 9 points lie on the cloth.
    const bool outermost = !center && n.node.row % 12 == 0 && n.node.col % 16 == 0;
    EXPECT_EQ(n.visible, !outermost);
    const bool inner = n.node.row > 0 && n.node.row < 12 && n.node.col > 0 && n.node.col < 16;
    EXPECT_EQ(n.scoreable, center || inner);  // corners on the outline lack a cell
    ++(center ? centers : corners);
  }
  EXPECT_EQ(centers, 12 * 16);
  EXPECT_EQ(corners, 13 * 17);
}

TEST(ViewTruth, TurnedSheetIsForeshortened) {
  const CameraModel camera = FlatCamera(40000, 20000, 60);  // far away: no perspective
  for (const NodeTruth& n : TruthOf(FlatSheet(6, 6), camera).nodes) {
    EXPECT_NEAR(n.facing_deg, 60, 0.1);
    EXPECT_NEAR(n.pitch_px, 40000 * kFlatCellMm / 20000 * std::sqrt(0.5), 0.01);
  }
}

TEST(ViewTruth, ScoreableCellsAreLargeAndFaceTheCamera) {
  const auto scoreable = [](double focal_px, double angle_deg) {
    int count = 0;
    for (const NodeTruth& n : TruthOf(FlatSheet(6, 6), FlatCamera(focal_px, 20000, angle_deg)).nodes)
      count += n.scoreable && n.node.kind == NodeKind::kCenter ? 1 : 0;
    return count;
  };
  EXPECT_EQ(scoreable(40000, 69.5), 36);
  EXPECT_EQ(scoreable(40000, 70.5), 0);
  EXPECT_EQ(scoreable(15100, 0), 36);
  EXPECT_EQ(scoreable(14900, 0), 0);
}

TEST(ViewTruth, BackSideIsNotSeen) {
  EXPECT_TRUE(TruthOf(FlatSheet(6, 6), FlatCamera(1000, 300, 180)).nodes.empty());
}

TEST(ViewTruth, CellCutThroughBeforeItsMiddleIsKnownButNotVisible) {
  const Cloth cloth = FlatSheet(6, 8);
  ClothPrint print = cloth.print;  // the cloth begins 0.4 cells later on the board: cells 0.4 .. 8.4
  for (auto& face : print.of_face)
    for (BoardPoint& p : face) p.x() += 0.4;
  int cut = 0;
  for (const NodeTruth& n : TruthOf(cloth.rest, print, FlatCamera(1000, 300, 0)).nodes) {
    if (n.node.kind != NodeKind::kCenter) continue;
    EXPECT_EQ(n.visible, n.node.col < 8);
    if (n.node.col < 8) continue;
    const Eigen::Vector2d expected(157.3 + 1000 * (n.node.col + 0.5 - 0.4 - 4) * kFlatCellMm / 300,
                                   121.8 + 1000 * (n.node.row + 0.5 - 3) * kFlatCellMm / 300);
    EXPECT_LT((n.pixel_px - expected).norm(), 1e-6);
    EXPECT_NEAR(n.pitch_px, 1000 * kFlatCellMm / 300, 1e-6);
    EXPECT_EQ(n.vertex, -1);
    EXPECT_FALSE(n.scoreable);
    ++cut;
  }
  EXPECT_EQ(cut, 6);
}

TEST(ViewTruth, ScreenHidesWhatIsBehindIt) {
  const Cloth cloth = FlatSheet(12, 16);
  const CameraModel camera = FlatCamera(1000, 300, 0);
  // A black square half way between camera and sheet, over the right half: it covers x > 0 from the centre
  // on.
  TriangleMesh mesh = cloth.rest;
  const auto first = static_cast<int>(mesh.vertices_mm.size());
  for (const double x : {0.0, 100.0})
    for (const double y : {-100.0, 100.0}) mesh.vertices_mm.emplace_back(x, y, -150);
  mesh.faces.push_back({first, first + 1, first + 2});
  mesh.faces.push_back({first + 2, first + 1, first + 3});
  ClothPrint print = cloth.print;
  print.of_face.resize(mesh.faces.size());
  for (size_t f = cloth.print.of_face.size(); f < mesh.faces.size(); ++f)
    print.of_face[f].fill(BoardPoint::Constant(std::nan("")));
  int centers = 0;
  for (const NodeTruth& n : TruthOf(mesh, print, camera).nodes) {
    if (n.node.kind != NodeKind::kCenter) continue;
    EXPECT_LT(n.node.col, 8);
    EXPECT_TRUE(n.visible);
    ++centers;
  }
  EXPECT_EQ(centers, 12 * 8);
}

// The nine points of a cell by search over all faces, and sight by tests against all triangles.
class BruteForce {
 public:
  BruteForce(const TriangleMesh& mesh, const ClothPrint& print, const CameraModel& camera)
      : mesh_(mesh), print_(print), eye_(camera.CenterWorld()) {}

  // Of the nine points of the cell those in sight; the middle one is bit 4.
  int PointsInSight(int row, int col) const {
    int mask = 0;
    for (int k = 0; k < 9; ++k) {
      const BoardPoint place(col + 0.5 + (k % 3 - 1) / 3.0, row + 0.5 + (k / 3 - 1) / 3.0);
      for (size_t f = 0; f < mesh_.faces.size(); ++f) {
        if (!Covers(f, place)) continue;
        mask |= InSight(f, place) ? 1 << k : 0;
        break;
      }
    }
    return mask;
  }

 private:
  Eigen::Vector3d Weights(size_t f, const BoardPoint& p) const {
    Eigen::Matrix3d m;
    for (int i = 0; i < 3; ++i) m.col(i) = print_.of_face[f][i].homogeneous();
    return m.inverse() * p.homogeneous();
  }
  bool Covers(size_t f, const BoardPoint& p) const {
    BoardPoint low = print_.of_face[f][0], high = low;
    for (const BoardPoint& q : print_.of_face[f]) low = low.cwiseMin(q), high = high.cwiseMax(q);
    if ((p.array() < low.array() - 1e-9).any() || (p.array() > high.array() + 1e-9).any()) return false;
    return Weights(f, p).minCoeff() >= -1e-9;
  }
  bool InSight(size_t f, const BoardPoint& place) const {
    const Eigen::Vector3d w = Weights(f, place);
    const auto vertex = [&](size_t face, int i) { return mesh_.vertices_mm[mesh_.faces[face][i]]; };
    const Eigen::Vector3d p = w[0] * vertex(f, 0) + w[1] * vertex(f, 1) + w[2] * vertex(f, 2);
    if ((vertex(f, 1) - vertex(f, 0)).cross(vertex(f, 2) - vertex(f, 0)).dot(eye_ - p) <= 0) return false;
    for (size_t g = 0; g < mesh_.faces.size(); ++g) {
      // eye + t (p - eye) = a + u ab + v ac
      Eigen::Matrix3d m;
      m.col(0) = p - eye_, m.col(1) = vertex(g, 0) - vertex(g, 1), m.col(2) = vertex(g, 0) - vertex(g, 2);
      const Eigen::Vector3d tuv = m.inverse() * (vertex(g, 0) - eye_);
      if (tuv[1] >= 0 && tuv[2] >= 0 && tuv[1] + tuv[2] <= 1 && tuv[0] > 0 &&
          (1 - tuv[0]) * (p - eye_).norm() > 0.05)
        return false;
    }
    return true;
  }

  const TriangleMesh& mesh_;
  const ClothPrint& print_;
  const Eigen::Vector3d eye_;
};

TEST(ViewTruth, FoldedClothIsSeenAsByBruteForce) {
  SyntheticTakeOptions options = *SyntheticPreset("tiny", 3);
  options.performance.frames = 1, options.performance.step_s = 1.0 / 2000;
  options.rig.cameras = 2;
  options.performance.handles.compression = 0.2;  // deep folds that hide parts
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const absl::StatusOr<TakeFrame> frame = take->Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  const StudioScene& scene = frame->scene;
  int partly = 0, differing = 0, cells = 0;
  for (int c = 0; c < 2; ++c) {
    std::map<BoardNode, NodeTruth> truth;
    const absl::StatusOr<FilmedView> view = take->Film(*frame, c);
    ASSERT_TRUE(view.ok()) << view.status();
    for (const NodeTruth& n : view->truth.nodes) truth[n.node] = n;
    const BruteForce brute(scene.mesh(), scene.print(), take->rig().cameras[c]);
    for (int row = 0; row < options.performance.rows; ++row)
      for (int col = 0; col < options.performance.cols; ++col) {
        const int mask = brute.PointsInSight(row, col);
        const bool expected = (mask & 16) != 0 && std::popcount(static_cast<unsigned>(mask)) >= 5;
        const auto found = truth.find({row, col, NodeKind::kCenter});
        partly += mask != 0 && mask != 511 ? 1 : 0;
        differing += (found != truth.end() && found->second.visible) != expected ? 1 : 0;
        ++cells;
      }
  }
  EXPECT_GT(partly, 20);
  // Rays that graze an edge may fall either way in single precision.
  EXPECT_LE(differing, cells / 500);
}

TEST(ViewTruth, SameTruthAtAnyThreadCount) {
  const Cloth cloth = FlatSheet(12, 16);
  const CameraModel camera = FlatCamera(1000, 300, 50);
  const ViewTruth one = tbb::task_arena(1).execute([&] { return TruthOf(cloth, camera); });
  const ViewTruth two = tbb::task_arena(2).execute([&] { return TruthOf(cloth, camera); });
  ASSERT_EQ(one.nodes.size(), two.nodes.size());
  for (size_t i = 0; i < one.nodes.size(); ++i) {
    EXPECT_EQ(one.nodes[i].node, two.nodes[i].node);
    EXPECT_EQ(one.nodes[i].pixel_px, two.nodes[i].pixel_px);
  }
}

}  // namespace
}  // namespace weft

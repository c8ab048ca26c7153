#include "services/work/animation/baseline_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "alignment/mesh_graph.h"
#include "services/work/animation/truth_views.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/small_avatar.h"
#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

double WorstMm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double out = 0;
  for (size_t v = 0; v < a.size(); ++v) out = std::max(out, (a[v] - b[v]).norm());
  return out;
}

TEST(RegistrationBaseline, FindsWhatManyCamerasSee) {
  const Template tube = TubeTemplate();
  const TruthViews views(tube, BodyShape());
  const ClothFrame frame{0, tube.rest.vertices_mm, {}};
  const RegistrationBaseline registration(tube);
  const Rig many = *DrivingRig(8, frame.vertices_mm, 1);
  const auto mesh = registration.Register(many, *views.Observe(frame, many, 1));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_LT(WorstMm(mesh->vertices_mm, frame.vertices_mm), 1.5);
  EXPECT_GT(std::count(mesh->state.begin(), mesh->state.end(), VertexState::kObserved), 600);
  // Two that face each other have no point in common.
  const Rig two = *DrivingRig(2, frame.vertices_mm, 1);
  EXPECT_EQ(registration.Register(two, *views.Observe(frame, two, 1)).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(PlacedShapes, AreWhereTheTruthIs) {
  const SparseViewAvatar avatar = SmallAvatar(6);
  const Eigen::Isometry3d place =
      Eigen::Translation3d(300, -20, 900) * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY());
  std::vector<Eigen::Vector3d> truth = avatar.space.Shape(Eigen::Vector2d(0, 0));
  for (Eigen::Vector3d& p : truth) p = place * p;
  const PlacedShapes shapes = PlaceShapes(avatar.space, truth);
  EXPECT_LT(WorstMm(shapes.mean_mm, truth), 1e-3);
  EXPECT_LT(WorstMm(shapes.best_mm, truth), 1e-3);
}

// A sleeve around the left upper arm, which is stretched out and then hangs, and a band around the neck.
TEST(SkinnedBaseline, SleevesFollowTheArmAndNothingElse) {
  const BodyShape shape;
  const Skeleton skeleton = SkeletonOf(shape);
  const Template tube = TubeTemplate(8, 20, 15);
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  FigurePose bound, hanging;
  bound.root_mm = {100, 200, 300};
  hanging.root_mm = {100, 150, 320};
  const Eigen::Quaterniond out(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ()));
  bound.Of(Joint::kLeftUpperArm) = out;
  const Eigen::Vector3d shoulder = skeleton.At(Joint::kLeftUpperArm);
  const Eigen::Vector3d arm = 0.6 * (skeleton.At(Joint::kLeftForearm) - shoulder);
  std::vector<Eigen::Vector3d> sleeve, band, moved_sleeve, moved_band;
  for (const Eigen::Vector3d& p : tube.rest.vertices_mm) {
    sleeve.push_back(bound.root_mm + shoulder + out * (arm + p));
    moved_sleeve.push_back(hanging.root_mm + shoulder + arm + p);
    band.push_back(bound.root_mm + skeleton.At(Joint::kHead) + 0.5 * p);
    moved_band.push_back(hanging.root_mm + skeleton.At(Joint::kHead) + 0.5 * p);
  }
  EXPECT_LT(WorstMm(SkinnedBaseline(graph, shape, sleeve, bound).MeshIn(hanging), moved_sleeve), 1e-6);
  EXPECT_LT(WorstMm(SkinnedBaseline(graph, shape, band, bound).MeshIn(hanging), moved_band), 1e-6);
}

TEST(SkinnedBaseline, ClothBendsOverJointsAsItDid) {
  const BodyShape shape;
  const Skeleton skeleton = SkeletonOf(shape);
  const Template tube = TubeTemplate(12, 20, 25);
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  FigurePose bound, bent;
  bent.root_mm = {10, 20, 30};
  bent.Of(Joint::kLeftUpperArm) = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX());
  bent.Of(Joint::kLeftForearm) = Eigen::AngleAxisd(-0.9, Eigen::Vector3d::UnitX());
  std::vector<Eigen::Vector3d> sleeve;
  for (const Eigen::Vector3d& p : tube.rest.vertices_mm)
    sleeve.push_back(skeleton.At(Joint::kLeftForearm) + p);
  Recorded recorded;
  recorded.Add("sleeve", SkinnedBaseline(graph, shape, sleeve, bound).MeshIn(bent));
  const SparseViewAvatar avatar = SmallAvatar(6);
  std::vector<Eigen::Vector3d> truth = avatar.space.Shape(Eigen::Vector2d(0.5, -1));
  for (size_t v = 0; v < truth.size(); ++v)
    truth[v] += Eigen::Vector3d(0.5 * static_cast<double>(v * v), 3, -1);
  const PlacedShapes shapes = PlaceShapes(avatar.space, truth);
  recorded.Add("mean", shapes.mean_mm);
  recorded.Add("best", shapes.best_mm);
  recorded.Expect();
}

}  // namespace
}  // namespace weft

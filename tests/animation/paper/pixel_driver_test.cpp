#include "animation/paper/pixel_driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "alignment/mesh_graph.h"
#include "animation/paper/graph_fit.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

using testing::HasSubstr;

// Answers 0.5 f0, -0.25 f1, f2 + 0.5.
AvatarNet LinearNet() {
  AvatarNet out;
  std::ifstream file(WEFT_TEST_DATA "/pixels.onnx", std::ios::binary);
  out.onnx.assign(std::istreambuf_iterator<char>(file), {});
  out.atlas.level = 0;
  out.sample = {kPixelFeatures, 2, 2, std::vector<float>(kPixelFeatures * 4, 1)};
  out.sample_answer = {kPixelAnswers, 2, 2, {}};
  for (const float a : {0.5f, -0.25f, 1.5f})
    out.sample_answer.values.insert(out.sample_answer.values.end(), 4, a);
  return out;
}

PixelAvatar LearnTube() {
  const Template garment = WavingTube::Garment();
  PixelAvatar out;
  out.template_hash = garment.ContentHash(), out.board_hash = garment.board_hash;
  out.vertices = static_cast<int>(garment.rest.vertices_mm.size());
  out.graph.nodes = 30;
  const DeformationGraph graph =
      *BuildDeformationGraph(garment.rest, BuildMeshGraph(garment.rest), out.graph);
  GraphFit fit(graph, {});
  std::vector<Eigen::VectorXd> poses;
  for (int take = 0; take < 3; ++take)
    for (int frame = 0; frame < 60; frame += 5)
      poses.push_back(NumbersOf(PoseOfNodes(graph, *fit.Fit(WavingTube::At(frame, take)))));
  out.prior = *LearnLinearPrior(poses, PoseUnits(graph, kPoseUnitMm), 6);
  out.net = LinearNet();
  return out;
}

const PixelAvatar& TubeOfPixels() {
  static const PixelAvatar avatar = LearnTube();
  return avatar;
}

struct TubeBeforeTwo {
  std::vector<CameraModel> cameras = CamerasAround(2);
  std::vector<std::vector<Observation>> seen;
  explicit TubeBeforeTwo(const std::vector<Eigen::Vector3d>& mesh) {
    for (const CameraModel& camera : cameras) seen.push_back(WavingTube::Seen(camera, mesh, 1, 0, 0.05));
  }
  std::vector<DrivingView> views() const { return {{&cameras[0], seen[0]}, {&cameras[1], seen[1]}}; }
};

TEST(PixelFeatures, AreDistancesInPixels) {
  const auto truth = WavingTube::At(5, 1);
  const TubeBeforeTwo tube(truth);
  std::vector<Eigen::Vector3d> carrier = truth;
  for (Eigen::Vector3d& p : carrier) p += Eigen::Vector3d(3, -2, 1);
  const NodeVertices nodes(WavingTube::Garment());
  const std::vector<float> features = PixelFeatures(tube.views(), nodes, carrier);
  int seen = 0;
  for (size_t v = 0; v < truth.size(); ++v)
    for (size_t c = 0; c < 2; ++c) {
      const float* of = &features[v * kPixelFeatures + 2 * c];
      if (of[0] == 0 && of[1] == 0) continue;
      ++seen;
      const Eigen::Vector2d off = *tube.cameras[c].Project(truth[v]) - *tube.cameras[c].Project(carrier[v]);
      EXPECT_NEAR(of[0] * kPixelUnitPx, off.x(), 0.4);
      EXPECT_NEAR(of[1] * kPixelUnitPx, off.y(), 0.4);
    }
  EXPECT_EQ(static_cast<size_t>(seen), tube.seen[0].size() + tube.seen[1].size());
  // Whichever camera comes first: that of the smaller name is the first of the features.
  const std::vector<DrivingView> views = tube.views();
  EXPECT_EQ(PixelFeatures(std::vector<DrivingView>{views[1], views[0]}, nodes, carrier), features);
}

TEST(PixelDriver, AddsWhatTheNetAnswersInTheWorldsAxes) {
  const Template garment = WavingTube::Garment();
  const auto truth = WavingTube::At(17, 3);
  const TubeBeforeTwo tube(truth);
  auto driver = PixelDriver::Create(garment, TubeOfPixels());
  ASSERT_TRUE(driver.ok()) << driver.status();
  const auto driven = driver->Drive(tube.views());
  ASSERT_TRUE(driven.ok()) << driven.status();
  ASSERT_FALSE(driven->lost);
  EXPECT_LT(MeanDistance(driven->carrier_mm, truth), 6);
  const std::vector<float> features = PixelFeatures(tube.views(), NodeVertices(garment), driven->carrier_mm);
  for (size_t v = 0; v < truth.size(); ++v) {
    const float* of = &features[v * kPixelFeatures];
    const Eigen::Vector3d expected(2 * 0.5 * of[0], -2 * 0.25 * of[1], 2 * (of[2] + 0.5));
    EXPECT_LT((driven->position_mm[v] - driven->carrier_mm[v] - expected).norm(), 1e-3);
  }
}

TEST(PixelDriver, RefusesOtherCamerasAndTemplates) {
  Template garment = WavingTube::Garment();
  const TubeBeforeTwo tube(WavingTube::At(0, 0));
  auto driver = PixelDriver::Create(garment, TubeOfPixels());
  ASSERT_TRUE(driver.ok());
  const std::vector<DrivingView> views = tube.views();
  EXPECT_EQ(driver->Drive(std::span(views).first(1)).status().code(), absl::StatusCode::kInvalidArgument);
  garment.board_hash = "fedcba9876543210";
  const absl::Status status = PixelDriver::Create(garment, TubeOfPixels()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("fedcba9876543210"));
}

TEST(PixelAvatar, ItsTablesBringItBack) {
  const PixelAvatar avatar = TubeOfPixels();
  ASSERT_TRUE(avatar.Validate().ok()) << avatar.Validate();
  PixelAvatar read;
  std::vector<AvatarTable> tables = TablesOf(avatar);
  ASSERT_TRUE(TakeTables(tables, &read).ok());
  EXPECT_EQ(read.graph.nodes, avatar.graph.nodes);
  EXPECT_EQ(read.prior.unit, avatar.prior.unit);
  ASSERT_EQ(read.prior.layers.size(), 1u);
  EXPECT_EQ(read.prior.layers[0].weight, avatar.prior.layers[0].weight);
  EXPECT_EQ(read.prior.layers[0].bias, avatar.prior.layers[0].bias);
  read.net = avatar.net;
  EXPECT_TRUE(read.Validate().ok());
  std::erase_if(tables, [](const AvatarTable& table) { return table.name == "bias0"; });
  ASSERT_TRUE(TakeTables(tables, &read).ok());
  EXPECT_THAT(std::string(read.Validate().message()), HasSubstr("no layers"));
  tables.erase(tables.begin());
  EXPECT_THAT(std::string(TakeTables(tables, &read).message()), HasSubstr("graph"));
}

TEST(PixelDriver, MeshesStayAsTheyAre) {
  auto driver = PixelDriver::Create(WavingTube::Garment(), TubeOfPixels());
  ASSERT_TRUE(driver.ok()) << driver.status();
  Recorded recorded;
  for (const int frame : {17, 18}) {
    const TubeBeforeTwo tube(WavingTube::At(frame, 3));
    const auto driven = driver->Drive(tube.views());
    ASSERT_TRUE(driven.ok()) << driven.status();
    recorded.Add("carrier", driven->carrier_mm);
    recorded.Add("position", driven->position_mm);
  }
  recorded.Expect();
  const TubeBeforeTwo tube(WavingTube::At(19, 3));
  std::vector<DrivingView> dark = tube.views();
  for (DrivingView& view : dark) view.observations = view.observations.first(20);
  const auto lost = driver->Drive(dark);
  ASSERT_TRUE(lost.ok()) << lost.status();
  EXPECT_TRUE(lost->lost);
  EXPECT_TRUE(lost->carrier_mm.empty());
  EXPECT_TRUE(lost->position_mm.empty());
}

// Of two cells with one name the more confident one counts, whichever comes first; strange cells do not.
TEST(PixelFeatures, AreOfTheMoreConfidentCell) {
  const Template garment = WavingTube::Garment();
  const NodeVertices nodes(garment);
  const CameraModel camera = CameraAt("c", 0, Eigen::Vector3d::Zero());
  const int vertex = 100;
  const Eigen::Vector2d at = *camera.Project(garment.rest.vertices_mm[vertex]);
  const VertexNode& node = garment.node_of_vertex[vertex];
  const BoardNode name{node.row, node.col, node.kind};
  Observation sure{at.x() + 3, at.y() - 2, name, 0.1f, 0.9f}, doubtful{at.x() + 8, at.y(), name, 0.1f, 0.4f},
      strange{at.x(), at.y(), {99, 99, NodeKind::kCenter}, 0.1f, 1}, far = sure;
  for (const std::vector<Observation>& seen :
       {std::vector<Observation>{sure, doubtful, strange}, {doubtful, strange, sure}}) {
    const std::vector<DrivingView> views = {{&camera, seen}};
    const auto features = PixelFeatures(views, nodes, garment.rest.vertices_mm);
    EXPECT_NEAR(features[vertex * kPixelFeatures], 0.3, 1e-6);
    EXPECT_NEAR(features[vertex * kPixelFeatures + 1], -0.2, 1e-6);
    EXPECT_EQ(features[vertex * kPixelFeatures + 2], 0);
  }
  far.x_px += 1000, far.y_px -= 1000;
  const std::vector<Observation> seen = {far};
  const std::vector<DrivingView> views = {{&camera, seen}};
  const auto features = PixelFeatures(views, nodes, garment.rest.vertices_mm);
  EXPECT_EQ(features[vertex * kPixelFeatures], 5);
  EXPECT_EQ(features[vertex * kPixelFeatures + 1], -5);
  // A third camera is passed over.
  const CameraModel a = CameraAt("a", 0, {0, 0, 0}), b = CameraAt("b", 120, {0, 0, 0});
  const std::vector<DrivingView> three = {{&a, {}}, {&b, {}}, {&camera, seen}};
  for (const float f : PixelFeatures(three, nodes, garment.rest.vertices_mm)) EXPECT_EQ(f, 0);
}

}  // namespace
}  // namespace weft

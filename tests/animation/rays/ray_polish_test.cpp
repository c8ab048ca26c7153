#include "animation/rays/ray_polish.h"

#include <gtest/gtest.h>

#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

std::vector<float> Lengths(const AlignmentModel& model, const std::vector<Eigen::Vector3d>& mesh) {
  std::vector<float> out;
  for (const MeshEdge& e : model.graph().edges)
    out.push_back(static_cast<float>((mesh[e.a] - mesh[e.b]).norm()));
  return out;
}

absl::StatusOr<PolishedMesh> Polish(const AlignmentModel& model, const std::vector<float>& lengths,
                                    const std::vector<Eigen::Vector3d>& carrier,
                                    const std::vector<VertexRay>& rays, const PolishOptions& options) {
  const std::vector<float> follow(lengths.size(), 0), spread(lengths.size(), 0.05f);
  return RayPolish(model, {lengths, follow, spread}, options).Polish(carrier, carrier, rays);
}

VertexRay RayTo(int vertex, int view, const Eigen::Vector3d& point, double azimuth_deg) {
  const Eigen::Vector3d eye = CameraAt("c", azimuth_deg, Eigen::Vector3d::Zero()).CenterWorld();
  return {vertex, view, eye, (point - eye).normalized(), 1e-4, 2600};
}

TEST(RayPolish, WithoutRaysTheCarrierStays) {
  const AlignmentModel model(WavingTube::Garment());
  const auto carrier = WavingTube::Shape(0.3, 0.2, 0);
  const auto polished = Polish(model, Lengths(model, carrier), carrier, {}, {});
  ASSERT_TRUE(polished.ok()) << polished.status();
  EXPECT_LT(MeanDistance(polished->position_mm, carrier), 0.01);
}

TEST(RayPolish, OneRayHoldsAVertexAcrossAndThreeTriangulateIt) {
  const AlignmentModel model(WavingTube::Garment());
  const auto truth = WavingTube::Shape(0.3, 0.2, 0);
  std::vector<Eigen::Vector3d> carrier = WavingTube::Shape(0.25, 0.2, 0);
  std::vector<VertexRay> rays;
  for (int v = 0; v < static_cast<int>(truth.size()); ++v) {
    rays.push_back(RayTo(v, 0, truth[v], 0));
    if (v % 7 == 0)
      for (const int view : {1, 2}) rays.push_back(RayTo(v, view, truth[v], 120.0 * view));
  }
  const auto polished = Polish(model, Lengths(model, truth), carrier, rays, {});
  ASSERT_TRUE(polished.ok()) << polished.status();
  for (const VertexRay& ray : rays)
    EXPECT_LT(ray.OffsetTo(polished->position_mm[ray.vertex]).norm(), 0.5) << ray.vertex;
  for (size_t v = 0; v < truth.size(); v += 7)
    EXPECT_LT((polished->position_mm[v] - truth[v]).norm(), 1) << v;
  EXPECT_LT(MeanDistance(polished->position_mm, truth), 0.3 * MeanDistance(carrier, truth));
}

// All rays are those of a tube 1 % larger and further away; the lengths of its edges tell.
TEST(RayPolish, LengthsOfEdgesHoldTheSizeThatRaysLeaveOpen) {
  const AlignmentModel model(WavingTube::Garment());
  const auto truth = WavingTube::Shape(0.3, 0.2, 0);
  const Eigen::Vector3d eye = CameraAt("c", 0, Eigen::Vector3d::Zero()).CenterWorld();
  std::vector<Eigen::Vector3d> larger = truth;
  for (Eigen::Vector3d& p : larger) p = eye + 1.01 * (p - eye);
  std::vector<VertexRay> rays;
  for (int v = 0; v < static_cast<int>(truth.size()); ++v) rays.push_back(RayTo(v, 0, truth[v], 0));
  PolishOptions options;
  options.carrier_sigma_mm = 1000;
  const auto polished = Polish(model, Lengths(model, truth), larger, rays, options);
  ASSERT_TRUE(polished.ok()) << polished.status();
  EXPECT_GT(MeanDistance(larger, truth), 20);
  EXPECT_LT(MeanDistance(polished->position_mm, truth), 3);
}

// A cell that was read wrongly lies whole cells from its neighbours.
TEST(RayPolish, SetsWrongRaysAside) {
  const AlignmentModel model(WavingTube::Garment());
  const auto truth = WavingTube::Shape(0.3, 0.2, 0);
  const std::vector<Eigen::Vector3d> carrier = WavingTube::Shape(0.25, 0.2, 0);
  std::vector<VertexRay> rays;
  const int count = static_cast<int>(truth.size());
  for (int v = 0; v < count; ++v) rays.push_back(RayTo(v, 0, truth[v % 40 == 7 ? (v + 3) % count : v], 0));
  const auto polished = Polish(model, Lengths(model, truth), carrier, rays, {});
  ASSERT_TRUE(polished.ok()) << polished.status();
  for (int v = 0; v < count; ++v) EXPECT_EQ(polished->rejected[v], v % 40 == 7) << v;
}

TEST(RayPolish, MeshesStayAsTheyAre) {
  const AlignmentModel model(WavingTube::Garment());
  const auto truth = WavingTube::Shape(0.3, 0.2, 0);
  const std::vector<Eigen::Vector3d> carrier = WavingTube::Shape(0.25, 0.2, 0);
  const int count = static_cast<int>(truth.size());
  std::vector<VertexRay> rays;
  for (int v = 0; v < count; ++v)
    for (const int view : {0, 1})
      if (v % (3 + view) != 0)
        rays.push_back(
            RayTo(v, view, truth[static_cast<size_t>(v % 50 == 7 ? (v + 2) % count : v)], 140.0 * view));
  Recorded recorded;
  for (const int rounds : {1, 2, 4}) {
    PolishOptions options;
    options.rounds = rounds;
    options.outlier_spreads = 1.5;
    const auto polished = Polish(model, Lengths(model, truth), carrier, rays, options);
    ASSERT_TRUE(polished.ok()) << polished.status();
    recorded.Add("position", polished->position_mm);
    recorded.Add("rejected", polished->rejected);
  }
  recorded.Expect();
}

}  // namespace
}  // namespace weft

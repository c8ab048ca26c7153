#include "alignment/garment_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "alignment/align.h"
#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using testing::FlatSheet;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kCellMm;
using testing::Mapped;
using testing::Measure;

constexpr int kLayerRows = 40, kLayerCols = 20, kEach = kLayerRows * kLayerCols;
constexpr int kBeltRows = 10, kBelt = kBeltRows * kLayerCols;
constexpr int kFirstBeltRow = 15;  // in rows of the dress
constexpr double kBeltMm = 4, kDressMm = 6;

// A dress (vertices 0 to kEach) in the plane z = 0, and a belt across its middle.
Template Outfit() {
  TriangleMesh both = FlatSheet(kLayerRows, kLayerCols);
  const int faces = static_cast<int>(both.faces.size());
  const TriangleMesh belt = FlatSheet(kBeltRows, kLayerCols);
  for (const Eigen::Vector3d& p : belt.vertices_mm)
    both.vertices_mm.push_back(p + Eigen::Vector3d(0, kFirstBeltRow * kCellMm, kBeltMm));
  for (const Face& face : belt.faces)
    both.faces.push_back({face[0] + kEach, face[1] + kEach, face[2] + kEach});
  Template garment = testing::SheetTemplate(std::move(both));
  garment.garments = {{"dress", 0, kEach, 0, faces},
                      {"belt", kEach, kBelt, faces, static_cast<int>(belt.faces.size())}};
  return garment;
}

// The dress below the belt, and two rows on each side.
bool IsHidden(int v) {
  return v < kEach &&
         std::abs(v / kLayerCols - (kFirstBeltRow + 0.5 * (kBeltRows - 1))) < 0.5 * kBeltRows + 2;
}

std::vector<bool> HiddenDress() {
  std::vector<bool> hidden;
  for (int v = 0; v < kEach + kBelt; ++v) hidden.push_back(IsHidden(v));
  return hidden;
}

// The dress is higher than the belt, which it can only be beside it.
std::vector<Eigen::Vector3d> Risen(const Template& garment) {
  std::vector<Eigen::Vector3d> position_mm = garment.rest.vertices_mm;
  for (int v = 0; v < kEach; ++v) position_mm[v].z() = kDressMm;
  return position_mm;
}

bool IsBelowTheBelt(const Eigen::Vector3d& p) {
  const double row = p.y() / kCellMm;
  return row > kFirstBeltRow + 0.5 && row < kFirstBeltRow + kBeltRows - 1.5;
}

// Of the dress's vertices along the belt, those that lie over it.
int OverTheBelt(const std::vector<Eigen::Vector3d>& position_mm) {
  int over = 0;
  for (int v = 0; v < kEach; ++v) over += IsBelowTheBelt(position_mm[v]) && position_mm[v].z() > kBeltMm;
  return over;
}

class Layers : public ::testing::Test {
 protected:
  GarmentLayers Build(const std::vector<Eigen::Vector3d>& position_mm) const {
    auto layers = GarmentLayers::Build(garment_.garments, garment_.rest.faces, position_mm);
    EXPECT_TRUE(layers.ok()) << layers.status();
    return *std::move(layers);
  }

  const Template garment_ = Outfit();
};

TEST_F(Layers, AGarmentLiesOverAnotherThatNobodySeesThere) {
  const GarmentLayers layers = Build(Risen(garment_));
  EXPECT_THAT(layers.Order(HiddenDress(), {}), ElementsAre(GarmentPair{0, 1}));
  std::vector<bool> hidden_belt(kEach + kBelt, false);
  std::fill(hidden_belt.begin() + kEach, hidden_belt.end(), true);
  EXPECT_THAT(layers.Order(hidden_belt, {}), ElementsAre(GarmentPair{1, 0}));
}

TEST_F(Layers, NobodyTellsOfGarmentsThatAreApartOrBothSeen) {
  EXPECT_THAT(Build(Risen(garment_)).Order(std::vector<bool>(kEach + kBelt, false), {}), IsEmpty());
  EXPECT_THAT(Build(Risen(garment_)).Order(HiddenDress(), {.reach_mm = 0.5}), IsEmpty());
  std::vector<Eigen::Vector3d> apart = Risen(garment_);
  for (int v = kEach; v < kEach + kBelt; ++v) apart[v].z() += 100;
  EXPECT_THAT(Build(apart).Order(HiddenDress(), {}), IsEmpty());
}

TEST_F(Layers, TheOrderOfTheTemplateHoldsWhereNoneIsToBeFound) {
  const GarmentLayers layers = Build(Risen(garment_));
  EXPECT_THAT(layers.Order(std::vector<bool>(kEach + kBelt, false), {.find_order = false}),
              ElementsAre(GarmentPair{0, 1}));
}

TEST_F(Layers, HiddenVerticesAreDrawnThroughTheOtherGarmentAlone) {
  const std::vector<Eigen::Vector3d> position_mm = Risen(garment_);
  ElasticProblem problem{
      position_mm, std::vector(kEach + kBelt, Eigen::Matrix3d(1e-6 * Eigen::Matrix3d::Identity())), {}};
  const int drawn = Build(position_mm).Draw({{0, 1}}, HiddenDress(), {}, &problem);
  EXPECT_GE(drawn, OverTheBelt(position_mm));
  int moved = 0;
  for (int v = 0; v < kEach + kBelt; ++v) {
    if ((problem.targets_mm[v] - position_mm[v]).norm() < 1e-9) continue;
    EXPECT_TRUE(IsHidden(v));
    EXPECT_NEAR(problem.targets_mm[v].z(), kBeltMm - 0.5, 0.01) << v;
    ++moved;
  }
  EXPECT_EQ(moved, drawn);
}

TEST_F(Layers, AlignmentPutsTheHiddenDressUnderTheBelt) {
  const std::vector<VertexTarget> targets =
      Measure(Risen(garment_), 0.02, 1, [](int v) { return !IsHidden(v); });
  AlignOptions options;
  options.layers.weight = 0;
  const auto without = Align(garment_, targets, options);
  options.layers.weight = 1;
  const auto with = Align(garment_, targets, options);
  ASSERT_TRUE(without.ok() && with.ok()) << with.status();
  EXPECT_GT(OverTheBelt(without->mesh.vertices_mm), 100);
  EXPECT_EQ(OverTheBelt(with->mesh.vertices_mm), 0);
  EXPECT_EQ(with->untangling.pairs_after, 0);
  EXPECT_THAT(with->layers, ElementsAre(GarmentPair{0, 1}));
}

TEST(LayerOptions, AreChecked) {
  EXPECT_THAT(LayerOptions{.weight = -1}.Validate().message(), HasSubstr("layers.weight"));
  EXPECT_THAT(LayerOptions{.reach_mm = 0}.Validate().message(), HasSubstr("layers.reach_mm"));
  AlignOptions options;
  options.layers.reach_mm = -1;
  EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft

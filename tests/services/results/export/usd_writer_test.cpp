// USD as text: what stands where, against lines written by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string UsdOf(const SmallResult& result, const std::vector<ExportAttribute>& attributes) {
  auto source = result.Source();
  EXPECT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kUsda, attributes);
  const auto writer = MakeUsdWriter(plan);
  const std::string text = Written(*writer, plan, result.folder / "garment.usda");
  EXPECT_LE(text.size(), writer->MaxFileBytes());
  return text;
}

TEST(UsdWriterTest, HeadTellsTimesUnitAndAxis) {
  const std::string text = UsdOf(SmallResult(), {});
  EXPECT_THAT(text, ::testing::StartsWith("#usda 1.0\n(\n    defaultPrim = \"garment\"\n"));
  EXPECT_THAT(text, HasSubstr("\n    startTimeCode = 0\n    endTimeCode = 2\n    metersPerUnit = 0.001\n"));
  EXPECT_THAT(text, HasSubstr("\n    framesPerSecond = 10\n    timeCodesPerSecond = 10\n"));
  EXPECT_THAT(text, HasSubstr("\n    upAxis = \"Y\"\n)\n"));
}

TEST(UsdWriterTest, MetresWithZUpSayTheirUnitAndAxis) {
  SmallResult result;
  result.request.unit = LengthUnit::kMetre;
  result.request.up = UpAxis::kZ;
  const std::string text = UsdOf(result, {});
  EXPECT_THAT(text, HasSubstr("\n    metersPerUnit = 1\n"));
  EXPECT_THAT(text, HasSubstr("\n    upAxis = \"Z\"\n"));
  // (0.1, 0.05, 0.02) with y up becomes (0.1, -0.02, 0.05).
  EXPECT_THAT(text, HasSubstr("(0.1, -0.02, 0.05)"));
}

TEST(UsdWriterTest, MeshAndItsMotionStandInOneFile) {
  const std::string text = UsdOf(SmallResult(), {});
  EXPECT_THAT(text, HasSubstr("\n    float3[] extent = [(0, 0, 0), (100, 50, 20)]\n"));
  EXPECT_THAT(text, HasSubstr("\n    int[] faceVertexCounts = [3, 3]\n"));
  EXPECT_THAT(text, HasSubstr("\n    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]\n"));
  EXPECT_THAT(text, HasSubstr("\n    point3f[] points.timeSamples = {\n"
                              "        0: [(0, 0, 0), (100, 0, 0), (100, 50, 0), (0, 50, 0)],\n"
                              "        1: [(0, 0, 10), (100, 0, 10), (100, 50, 10), (0, 50, 10)],\n"
                              "        2: [(0, 0, 20), (100, 0, 20), (100, 50, 20), (0, 50, 20)],\n"
                              "    }\n}\n"));
  EXPECT_THAT(text, Not(HasSubstr("primvars")));
  EXPECT_THAT(text, Not(HasSubstr("velocities")));
}

TEST(UsdWriterTest, AttributesOfVerticesHaveAFirstValueAndTheirSamples) {
  const std::string text =
      UsdOf(SmallResult(), {ExportAttribute::kState, ExportAttribute::kSigma, ExportAttribute::kViews});
  EXPECT_THAT(text, HasSubstr("    int[] primvars:state = [0, 2, 1, 1] (\n"
                              "        interpolation = \"vertex\"\n    )\n"
                              "    int[] primvars:state.timeSamples = {\n"
                              "        0: [0, 2, 1, 1],\n"));
  EXPECT_THAT(text, HasSubstr("    float[] primvars:sigma = [1.5, 0.5, 0.25, 0.25] (\n"));
  EXPECT_THAT(text, HasSubstr("    int[] primvars:views = [0, 2, 3, 3] (\n"));
}

TEST(UsdWriterTest, PlacesAreThoseOfTheCornersOfFaces) {
  const std::string text = UsdOf(SmallResult(), {ExportAttribute::kUv, ExportAttribute::kCoverage});
  EXPECT_THAT(text, HasSubstr("    texCoord2f[] primvars:st = "
                              "[(0, 0), (1, 0), (1, 0.5), (0, 0), (1, 0.5), (0, 0.5)] (\n"
                              "        interpolation = \"faceVarying\"\n    )\n"));
  EXPECT_THAT(text, HasSubstr("    float[] primvars:coverage = [0, 1, 1, 1] (\n"));
}

TEST(UsdWriterTest, VelocitiesAreASeparatePassThatAloneNeedsThem) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan =
      PlanOf(*source, ExportFormat::kUsda, {ExportAttribute::kVelocity, ExportAttribute::kState});
  const auto writer = MakeUsdWriter(plan);
  ASSERT_EQ(writer->passes(), 3);
  EXPECT_FALSE(writer->NeedsVelocities(0));
  EXPECT_TRUE(writer->NeedsVelocities(1));
  EXPECT_FALSE(writer->NeedsVelocities(2));
  EXPECT_THAT(Written(*writer, plan, result.folder / "garment.usda"),
              HasSubstr("    vector3f[] velocities.timeSamples = {\n"
                        "        0: [(0, 0, 100), (0, 0, 100), (0, 0, 100), (0, 0, 100)],\n"));
}

}  // namespace
}  // namespace weft

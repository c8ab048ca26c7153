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

TEST(UsdWriterTest, TheWholeFileOfAllAttributes) {
  EXPECT_EQ(UsdOf(SmallResult(), TraitsOf(ExportFormat::kUsda).carries), R"(#usda 1.0
(
    defaultPrim = "garment"
    doc = "written by weft export"
    startTimeCode = 0
    endTimeCode = 2
    metersPerUnit = 0.001
    framesPerSecond = 10
    timeCodesPerSecond = 10
    upAxis = "Y"
)

def Mesh "garment"
{
    uniform token subdivisionScheme = "none"
    uniform bool doubleSided = 1
    float3[] extent = [(0, 0, 0), (100, 50, 20)]
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 0.5), (0, 0), (1, 0.5), (0, 0.5)] (
        interpolation = "faceVarying"
    )
    float[] primvars:coverage = [0, 1, 1, 1] (
        interpolation = "vertex"
    )
    point3f[] points.timeSamples = {
        0: [(0, 0, 0), (100, 0, 0), (100, 50, 0), (0, 50, 0)],
        1: [(0, 0, 10), (100, 0, 10), (100, 50, 10), (0, 50, 10)],
        2: [(0, 0, 20), (100, 0, 20), (100, 50, 20), (0, 50, 20)],
    }
    vector3f[] velocities.timeSamples = {
        0: [(0, 0, 100), (0, 0, 100), (0, 0, 100), (0, 0, 100)],
        1: [(0, 0, 100), (0, 0, 100), (0, 0, 100), (0, 0, 100)],
        2: [(0, 0, 100), (0, 0, 100), (0, 0, 100), (0, 0, 100)],
    }
    int[] primvars:state = [0, 2, 1, 1] (
        interpolation = "vertex"
    )
    int[] primvars:state.timeSamples = {
        0: [0, 2, 1, 1],
        1: [0, 2, 1, 1],
        2: [0, 2, 1, 1],
    }
    float[] primvars:sigma = [1.5, 0.5, 0.25, 0.25] (
        interpolation = "vertex"
    )
    float[] primvars:sigma.timeSamples = {
        0: [1.5, 0.5, 0.25, 0.25],
        1: [1.5, 0.5, 0.25, 0.25],
        2: [1.5, 0.5, 0.25, 0.25],
    }
    int[] primvars:views = [0, 2, 3, 3] (
        interpolation = "vertex"
    )
    int[] primvars:views.timeSamples = {
        0: [0, 2, 3, 3],
        1: [0, 2, 3, 3],
        2: [0, 2, 3, 3],
    }
}
)");
}

TEST(UsdWriterTest, SeamsHaveAPlaceForEachCorner) {
  const SmallResult result;
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteRegisteredMesh(result.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces(), texture)
            .ok());
  EXPECT_THAT(UsdOf(result, {ExportAttribute::kUv}),
              HasSubstr("primvars:st = [(0, 0), (1, 0), (1, 0.5), (0, 0.75), (1, 0.5), (0, 0.5)] ("));
}

// 4096 and, of three frames and a first value, 51 bytes a point and 64 a line; 105 a face, 17 a vertex for
// coverage.
TEST(UsdWriterTest, RoomIsThatOfTheLongestNumbers) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan points = PlanOf(*source, ExportFormat::kUsda, {});
  EXPECT_EQ(MakeUsdWriter(points)->MaxFileBytes(), 4096u + 4 * (53 * 4 + 64) + 2 * 147 + 4 * 17);
  const ExportPlan states = PlanOf(*source, ExportFormat::kUsda, {ExportAttribute::kState});
  EXPECT_EQ(MakeUsdWriter(states)->MaxFileBytes(), 4096u + 4 * ((53 + 3) * 4 + 2 * 64) + 2 * 147 + 4 * 17);
}

}  // namespace
}  // namespace weft

#include "services/results/export/export_format.h"

#include <gmock/gmock.h>

#include "services/results/export/export_request.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(ExportFormat, EveryNameReadsBack) {
  for (const FormatTraits& traits : ExportFormats()) {
    const auto format = ExportFormatFromName(traits.name);
    ASSERT_TRUE(format.ok()) << traits.name;
    EXPECT_EQ(*format, traits.format);
    EXPECT_EQ(&TraitsOf(*format), &traits);
    for (const ExportAttribute attribute : traits.carries)
      EXPECT_EQ(*ExportAttributeFromName(NameOf(attribute)), attribute);
  }
}

TEST(ExportFormat, UnknownNamesAreRefusedWithTheKnownOnes) {
  EXPECT_THAT(ExportFormatFromName("abc").status().message(),
              HasSubstr("ply, obj, glb, mdd, pc2, usda, npz"));
  EXPECT_THAT(ExportFormatFromName("abc").status().message(), HasSubstr("Alembic"));
  EXPECT_THAT(LengthUnitFromName("inch").status().message(), HasSubstr("m, cm, mm"));
}

TEST(ExportFormat, TableNamesWhatEachCarries) {
  EXPECT_THAT(FormatTable(), HasSubstr("obj   a Wavefront OBJ per frame, y up: uv\n"));
}

TEST(ExportRequestTest, RefusesAttributesThatTheFormatDoesNotCarry) {
  ExportRequest request{.result = "r", .out = "o", .format = ExportFormat::kObj};
  EXPECT_TRUE(request.Validate().ok());
  request.attributes = {ExportAttribute::kSigma};
  EXPECT_THAT(request.Validate().message(), HasSubstr("obj does not carry sigma"));
}

TEST(ExportRequestTest, KeepsWhatASpecificationFixes) {
  ExportRequest request{.result = "r", .out = "o", .format = ExportFormat::kGlb};
  request.up = UpAxis::kY;
  request.unit = LengthUnit::kMetre;
  EXPECT_TRUE(request.Validate().ok());
  request.unit = LengthUnit::kCentimetre;
  EXPECT_THAT(request.Validate().message(), HasSubstr("by its specification"));
}

}  // namespace
}  // namespace weft

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
  ExportRequest request{{.result = "r", .out = "o"}, ExportFormat::kObj};
  EXPECT_TRUE(request.Validate().ok());
  request.attributes = {ExportAttribute::kSigma};
  EXPECT_THAT(request.Validate().message(), HasSubstr("obj does not carry sigma"));
}

TEST(ExportRequestTest, KeepsWhatASpecificationFixes) {
  ExportRequest request{{.result = "r", .out = "o"}, ExportFormat::kGlb};
  request.up = UpAxis::kY;
  request.unit = LengthUnit::kMetre;
  EXPECT_TRUE(request.Validate().ok());
  request.unit = LengthUnit::kCentimetre;
  EXPECT_THAT(request.Validate().message(), HasSubstr("by its specification"));
}

TEST(ExportFormat, TheTableIsThatOfTheHelp) {
  EXPECT_EQ(FormatTable(),
            R"(  ply   a binary PLY per frame, z up: uv, velocity, state, sigma, views, coverage
  obj   a Wavefront OBJ per frame, y up: uv
  glb   binary glTF, a morph target per frame, y up: uv, state, sigma, coverage, normal
  mdd   point cache MDD, and a mesh garment.obj, y up: uv
  pc2   point cache PC2, and a mesh garment.obj, y up: uv
  usda  USD as text, points as time samples, y up: uv, velocity, state, sigma, views, coverage
  npz   arrays of NumPy, y up: uv, velocity, state, sigma, views, coverage
)");
}

TEST(ExportFormat, NormalsAreLeftOutUnlessTheyAreAskedFor) {
  EXPECT_EQ(TraitsOf(ExportFormat::kGlb).ByDefault(),
            (std::vector<ExportAttribute>{ExportAttribute::kUv, ExportAttribute::kState,
                                          ExportAttribute::kSigma, ExportAttribute::kCoverage}));
  EXPECT_EQ(TraitsOf(ExportFormat::kPly).ByDefault(), TraitsOf(ExportFormat::kPly).carries);
}

// By format: a file per frame, fixed axes, a rate, repeated gaps.
TEST(ExportFormat, WhatEachFormatNeeds) {
  std::string lines;
  for (const FormatTraits& traits : ExportFormats())
    lines += std::string(traits.name) + (traits.file_per_frame ? " files" : "") +
             (traits.fixed_axes ? " fixed" : "") + (traits.needs_rate ? " rate" : "") +
             (traits.repeats_gaps ? " gaps" : "") + ", ";
  EXPECT_EQ(lines, "ply files, obj files, glb fixed rate, mdd rate gaps, pc2 gaps, usda rate, npz, ");
}

TEST(ExportFormat, NamesOfAxesUnitsAndAttributesReadBack) {
  for (const UpAxis up : {UpAxis::kY, UpAxis::kZ}) EXPECT_EQ(*UpAxisFromName(NameOf(up)), up);
  for (const LengthUnit unit : {LengthUnit::kMetre, LengthUnit::kCentimetre, LengthUnit::kMillimetre})
    EXPECT_EQ(*LengthUnitFromName(NameOf(unit)), unit);
  EXPECT_EQ(UpAxisFromName("x").status().message(), "--up: \"x\" is not one of y, z");
  EXPECT_EQ(LengthUnitFromName("inch").status().message(), "--unit: \"inch\" is not one of m, cm, mm");
  EXPECT_EQ(ExportAttributeFromName("x").status().message(),
            "--attributes: \"x\" is not one of uv, velocity, state, sigma, views, coverage, normal");
  EXPECT_EQ(ExportFormatFromName("x").status().message(),
            "--format: \"x\" is not one of ply, obj, glb, mdd, pc2, usda, npz; Debian 12 has no libraries of "
            "Alembic "
            "and binary USD, for which usda and the point caches stand in");
}

}  // namespace
}  // namespace weft

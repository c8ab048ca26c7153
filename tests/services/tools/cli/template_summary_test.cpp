#include "services/tools/cli/template_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

v1::TemplateSummary SummaryOfShirt() {
  v1::TemplateSummary summary;
  summary.set_id("shirt");
  summary.set_vertices(13000);
  summary.set_panels(5);
  summary.set_seams(4);
  summary.set_components(1);
  for (const double length_mm : {900.4, 600.0, 200.0, 200.0}) summary.add_openings_mm(length_mm);
  return summary;
}

TEST(TemplateSummaries, HaveAHeadline) {
  EXPECT_EQ(TemplateHeadline(SummaryOfShirt()), "5 panels, 4 seams, 4 openings, 13,000 vertices");
  v1::TemplateSummary bare;
  bare.set_vertices(1);
  bare.add_openings_mm(7);
  EXPECT_EQ(TemplateHeadline(bare), "1 opening, 1 vertex");
}

TEST(TemplateSummaries, ListOpeningsWhereTheirCountIsWrong) {
  EXPECT_TRUE(CheckOpeningCount(SummaryOfShirt(), 4).ok());
  EXPECT_TRUE(CheckOpeningCount(SummaryOfShirt(), -1).ok());
  const absl::Status status = CheckOpeningCount(SummaryOfShirt(), 3);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            "the garment has 4 openings, expected were 3. Lengths of their borders: 900 mm, 600 mm, 200 mm, "
            "200 mm");
  EXPECT_FALSE(CheckOpeningCount({}, 1).ok());
}

TEST(TemplateSummaries, AreUsableWithLoosePiecesHandlesOrWarnings) {
  EXPECT_EQ(TemplateVerdict(SummaryOfShirt()).grade(), v1::GRADE_GOOD);
  v1::TemplateSummary loose = SummaryOfShirt();
  loose.set_components(2);
  EXPECT_EQ(TemplateVerdict(loose).grade(), v1::GRADE_USABLE);
  EXPECT_EQ(TemplateVerdict(loose).reason(), "the garment is in 2 disconnected pieces");
  v1::TemplateSummary handle = SummaryOfShirt();
  handle.set_handles(1);
  EXPECT_EQ(TemplateVerdict(handle).grade(), v1::GRADE_USABLE);
  v1::TemplateSummary warned = SummaryOfShirt();
  warned.add_warnings("panel 3 is small");
  EXPECT_EQ(TemplateVerdict(warned).reason(), "panel 3 is small");
}

TEST(TemplateSummaries, TakeTheScaleThatIsFurthestFromThePrint) {
  TemplateSize size;
  size.scales.resize(3);
  size.scales[0].median = 1.01;
  size.scales[1].median = 0.95;
  size.scales[2].median = 0;  // nothing is printed
  v1::TemplateSummary summary;
  AddPrintScale(size, &summary);
  EXPECT_DOUBLE_EQ(summary.print_scale(), 0.95);
  v1::TemplateSummary none;
  AddPrintScale({}, &none);
  EXPECT_FALSE(none.has_print_scale());
}

TEST(TemplateSummaries, NameATemplateByItsFolder) {
  EXPECT_EQ(TemplateIdOf("garments/shirt"), "shirt");
  EXPECT_EQ(TemplateIdOf("garments/shirt/"), "shirt");
  EXPECT_EQ(TemplateIdOf("garments/x/../shirt"), "shirt");
  for (const char* path : {"", ".", "..", "/"}) EXPECT_EQ(TemplateIdOf(path), "template") << path;
}

}  // namespace
}  // namespace weft

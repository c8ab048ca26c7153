#include "evaluation/measures.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

TEST(Measures, EachHasANameAndATextOfItsOwn) {
  std::set<std::string> names, titles;
  for (const Measure& measure : Measures()) {
    EXPECT_TRUE(names.insert(measure.name).second) << measure.name;
    EXPECT_TRUE(titles.insert(TitleWithUnit(measure)).second) << measure.title;
    EXPECT_EQ(&MeasureNamed(measure.name), &measure);
  }
}

TEST(Measures, NamesEndInTheirUnit) {
  for (const Measure& measure : Measures()) {
    const std::string_view name = measure.name, unit = measure.unit;
    const auto ends = [&](const char* end, bool right) {
      EXPECT_TRUE(!name.ends_with(end) || right) << name;
    };
    ends("_mm_s", unit == "mm/s");
    ends("_mm", unit == "mm" || unit == "mm a frame");
    ends("_px", unit == "px");
    ends("_share", unit == "%");
  }
}

TEST(Measures, SharesAreShownAsPerCent) {
  EXPECT_DOUBLE_EQ(InShownUnit(MeasureNamed("coverage"), 0.5), 50);
  EXPECT_DOUBLE_EQ(InShownUnit(MeasureNamed("left_out_px"), 0.5), 0.5);
  EXPECT_EQ(TitleWithUnit(MeasureNamed("left_out_px")), "Left-out camera error, px");
  EXPECT_EQ(TitleWithUnit(MeasureNamed("left_out_px"), true), "left out, px");
  EXPECT_EQ(TitleWithUnit(MeasureNamed("self_intersecting_pairs")), "Self-intersections, pairs of faces");
}

TEST(Measures, FileFormatsTellsEachInItsWords) {
  std::ifstream file(WEFT_SOURCE_DIR "/docs/file-formats.md");
  std::stringstream text;
  text << file.rdbuf();
  std::string table;
  for (const Measure& m : Measures())
    absl::StrAppend(&table, "| `", m.name, "` | ", m.unit, " | ", m.title, ": ", m.definition, " |\n");
  EXPECT_NE(text.str().find(table), std::string::npos) << table;
}

}  // namespace
}  // namespace weft

#include "services/results/report/svg_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(SvgFile, TheTitleStandsAboveThePictureAndIsEscaped) {
  const std::string svg = SvgFile(100, 50, "a<b", "<circle r=\"3\"/>");
  EXPECT_THAT(svg, StartsWith("<?xml"));
  EXPECT_THAT(svg, HasSubstr("width=\"100\" height=\"76\" viewBox=\"0 0 100 76\""));
  EXPECT_THAT(svg, HasSubstr("<title>a&lt;b</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("a<b")));
  EXPECT_THAT(svg, EndsWith("<g transform=\"translate(0 26)\"><circle r=\"3\"/></g>\n</svg>\n"));
}

}  // namespace
}  // namespace weft

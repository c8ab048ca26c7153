#include "services/results/report/html_text.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(HtmlText, MarkupAndQuotesAreEscaped) {
  EXPECT_EQ(EscapeHtml("<a href=\"x\">'&'</a>"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/a&gt;");
}

TEST(HtmlText, NamesAreIsolated) { EXPECT_EQ(NameHtml("<a>"), "<bdi>&lt;a&gt;</bdi>"); }

TEST(HtmlText, BytesThatAreNoTextAreReplacedOneByOne) {
  EXPECT_EQ(EscapeHtml("a\xFF\x01"
                       "b\n\tc"),
            "a\xEF\xBF\xBD\xEF\xBF\xBD"
            "b\n\tc");
  EXPECT_EQ(EscapeHtml("\xC3\xA4"), "\xC3\xA4");
}

TEST(HtmlText, TextIsCutBetweenCharacters) {
  EXPECT_EQ(Shortened("\xC3\xA4\xC3\xB6\xC3\xBC", 2), "\xC3\xA4\xC3\xB6\xE2\x80\xA6");
  EXPECT_EQ(Shortened("abc", 3), "abc");
  EXPECT_EQ(Shortened("", 0), "");
  EXPECT_EQ(Words("too_few_views"), "too few views");
}

TEST(HtmlText, NumbersAreGroupedInThrees) {
  EXPECT_EQ(FormatCount(999), "999");
  EXPECT_EQ(FormatCount(-1'234'567),
            "\xE2\x88\x92"
            "1,234,567");
  EXPECT_EQ(FormatNumber(1204.5, 1), "1,204.5");
  EXPECT_EQ(FormatNumber(-0.001, 2), "0.00");
  EXPECT_EQ(FormatNumber(-1204.5, 0),
            "\xE2\x88\x92"
            "1,204");
  EXPECT_EQ(FormatNumber(0, 2), "0.00");
  EXPECT_EQ(FormatCount(0), "0");
  EXPECT_EQ(FormatCount(100'000), "100,000");
  EXPECT_EQ(FormatNumber(kNoNumber, 2), "\xE2\x80\x93");
  EXPECT_EQ(Counted(1, "frame", "frames"), "1 frame");
  EXPECT_EQ(Counted(1200, "frame", "frames"), "1,200 frames");
}

TEST(HtmlText, OnlyTheWholeIsAHundredPercent) {
  EXPECT_EQ(FormatPercent(1), "100.0\xC2\xA0%");
  EXPECT_EQ(FormatPercent(0.9997), "99.9\xC2\xA0%");
  EXPECT_EQ(FormatPercent(0.952), "95.2\xC2\xA0%");
  EXPECT_EQ(FormatPercent(0.99899), "99.9\xC2\xA0%");
  EXPECT_EQ(FormatPercent(1.5), "150.0\xC2\xA0%");
  EXPECT_EQ(FormatPercent(kNoNumber), "\xE2\x80\x93");
}

// RFC 4648, section 10.
TEST(HtmlText, Base64IsPadded) {
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(Base64("foob"), "Zm9vYg==");
}

}  // namespace
}  // namespace weft

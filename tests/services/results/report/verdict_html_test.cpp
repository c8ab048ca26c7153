#include "services/results/report/verdict_html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "weft/v1/verdict.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::Verdict BadVerdict() {
  v1::Verdict verdict;
  verdict.set_grade(v1::GRADE_BAD);
  verdict.set_reason("3\xC2\xA0of 9 frames <failed>");
  verdict.set_remedy("add cameras & light");
  return verdict;
}

TEST(VerdictHtml, WithoutAVerdictTheHeadlineIsAlone) {
  EXPECT_EQ(VerdictBlock("a < b", {}), "<p class=\"reason\">a &lt; b</p>\n");
  EXPECT_EQ(PageHead("Report", "a < b", {}, "<i></i>"),
            "<header>\n<p class=\"kind\">Report</p>\n<h1>a &lt; b</h1>\n<i></i></header>\n");
}

TEST(VerdictHtml, AReasonIsToldOnce) {
  const v1::Verdict verdict = BadVerdict();
  const std::string reason = "<p class=\"reason\">3\xC2\xA0of 9 frames &lt;failed&gt;</p>";
  EXPECT_THAT(PageHead("", "Another headline", verdict, ""), HasSubstr(reason));
  EXPECT_THAT(PageHead("", "3 of 9 frames <failed>.", verdict, ""), Not(HasSubstr(reason)));
}

TEST(VerdictHtml, RemedyChecksAndOtherFindingsFollow) {
  v1::Verdict verdict = BadVerdict();
  v1::VerdictCheck& check = *verdict.add_checks();
  check.set_name("coverage");
  check.set_grade(v1::GRADE_USABLE);
  check.set_value("71 %");
  check.set_limits("good from 80 %");
  v1::VerdictFinding& other = *verdict.add_others();
  other.set_grade(v1::GRADE_GOOD);
  other.set_reason("all cameras agree");
  const std::string html = VerdictBlock("Headline", verdict);
  EXPECT_THAT(html, HasSubstr("<b>Remedy:</b> add cameras &amp; light</p>"));
  EXPECT_THAT(html, HasSubstr("<td>coverage</td><td><b>71 %</b></td><td><span class=\"warn\">!\xC2\xA0usable"
                              "</span></td><td>good from 80 %</td>"));
  EXPECT_THAT(html,
              HasSubstr("<li><span class=\"grade good\">&#10003;\xC2\xA0good</span> all cameras agree</li>"));
}

TEST(VerdictHtml, ABareVerdictMakesNoEmptyBox) {
  v1::Verdict verdict;
  verdict.set_grade(v1::GRADE_GOOD);
  verdict.set_reason("12 frames");
  EXPECT_THAT(PageHead("", "12 frames.", verdict, ""), Not(HasSubstr("id=\"verdict\"")));
}

}  // namespace
}  // namespace weft

#include "services/report/verdict_html.h"

#include "absl/strings/str_cat.h"
#include "services/report/html_text.h"
#include "services/report/report_sections.h"
#include "services/verdict/verdict.h"

namespace weft {
namespace {

std::string Badge(v1::Grade grade) {
  const absl::string_view colour = grade == v1::GRADE_GOOD     ? "good"
                                  : grade == v1::GRADE_USABLE ? "warn"
                                                              : "bad";
  return absl::StrCat("<span class=\"badge ", colour, "\">", GradeWord(grade), "</span>");
}

}  // namespace

std::string VerdictHtml(const v1::Verdict& verdict) {
  if (verdict.grade() == v1::GRADE_UNSPECIFIED) return "";
  std::string html = absl::StrCat("<section id=\"verdict\"><h2>Verdict", Badge(verdict.grade()),
                                  "</h2><p><b>", EscapeHtml(verdict.reason()), "</b></p>");
  if (!verdict.remedy().empty()) absl::StrAppend(&html, "<p>", EscapeHtml(verdict.remedy()), "</p>");
  std::string rows;
  for (const v1::VerdictCheck& check : verdict.checks())
    absl::StrAppend(&rows, TableRow("td", {EscapeHtml(check.name()), Badge(check.grade()),
                                           EscapeHtml(check.value()), EscapeHtml(check.limits())}));
  if (!rows.empty()) absl::StrAppend(&html, Table({"Check", "Verdict", "Value", "Limits"}, rows, "verdict"));
  return absl::StrCat(html, "</section>\n");
}

}  // namespace weft

#include "services/results/report/verdict_html.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

struct Look {
  absl::string_view colour, sign;  // the sign is for those who cannot tell the colours apart
};
Look LookOf(v1::Grade grade) {
  switch (grade) {
    case v1::GRADE_GOOD:
      return {"good", "&#10003;"};
    case v1::GRADE_USABLE:
      return {"warn", "!"};
    default:
      return {"bad", "&#10005;"};
  }
}

std::string Badge(v1::Grade grade) {
  const Look look = LookOf(grade);
  return absl::StrCat("<span class=\"grade ", look.colour, "\">", look.sign, "\xC2\xA0", GradeWord(grade),
                      "</span>");
}

std::string Checks(const v1::Verdict& verdict) {
  std::string rows;
  for (const v1::VerdictCheck& check : verdict.checks()) {
    const Look look = LookOf(check.grade());
    rows += TableRow("td", {EscapeHtml(check.name()), absl::StrCat("<b>", EscapeHtml(check.value()), "</b>"),
                            absl::StrCat("<span class=\"", look.colour, "\">", look.sign, "\xC2\xA0",
                                         GradeWord(check.grade()), "</span>"),
                            EscapeHtml(check.limits())});
  }
  return rows.empty() ? "" : Table({}, rows, "checks");
}

// Without what only typography tells apart.
std::string Plain(const std::string& text) {
  return absl::StrReplaceAll(absl::StripSuffix(text, "."), {{"\xC2\xA0", " "}});
}

std::string Remedy(const v1::Verdict& verdict) {
  return verdict.remedy().empty()
             ? ""
             : absl::StrCat("<p class=\"remedy\"><b>Remedy:</b> ", EscapeHtml(verdict.remedy()), "</p>\n");
}

std::string Others(const v1::Verdict& verdict) {
  std::string items;
  for (const v1::VerdictFinding& other : verdict.others())
    absl::StrAppend(&items, "<li>", Badge(other.grade()), " ", EscapeHtml(other.reason()), "</li>\n");
  return items.empty() ? "" : absl::StrCat("<ul class=\"others\">\n", items, "</ul>\n");
}

// A reason that the headline tells already is left out.
std::string ReasonAndChecks(const std::string& headline, const v1::Verdict& verdict) {
  const bool tells_more = Plain(headline) != Plain(verdict.reason());
  const std::string reason =
      tells_more ? absl::StrCat("<p class=\"reason\">", EscapeHtml(verdict.reason()), "</p>\n") : "";
  return absl::StrCat(reason, Remedy(verdict), Others(verdict), Checks(verdict));
}

}  // namespace

std::string VerdictBlock(const std::string& headline, const v1::Verdict& verdict) {
  if (verdict.grade() == v1::GRADE_UNSPECIFIED)
    return absl::StrCat("<p class=\"reason\">", EscapeHtml(headline), "</p>\n");
  return absl::StrCat("<p class=\"reason\">", Badge(verdict.grade()), " ", EscapeHtml(headline), "</p>\n",
                      ReasonAndChecks(headline, verdict));
}

std::string PageHead(const std::string& kind, const std::string& headline, const v1::Verdict& verdict,
                     const std::string& more) {
  std::string head = absl::StrCat("<header>\n<p class=\"kind\">", kind, "</p>\n");
  if (verdict.grade() == v1::GRADE_UNSPECIFIED)
    return absl::StrCat(head, "<h1>", EscapeHtml(headline), "</h1>\n", more, "</header>\n");
  absl::StrAppend(&head, "<h1>", Badge(verdict.grade()), " ", EscapeHtml(headline), "</h1>\n");
  const std::string body = ReasonAndChecks(headline, verdict);
  if (!body.empty())
    absl::StrAppend(&head, "<div id=\"verdict\" class=\"verdict ", LookOf(verdict.grade()).colour, "\">\n",
                    body, "</div>\n");
  return absl::StrCat(head, more, "</header>\n");
}

}  // namespace weft

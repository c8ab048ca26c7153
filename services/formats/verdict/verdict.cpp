#include "services/formats/verdict/verdict.h"

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"

namespace weft {
namespace {

constexpr absl::string_view kPayload = "weft.v1.Verdict";

std::string WithUnit(const Limit& limit, double value, int decimals) {
  const std::string number = absl::StrFormat("%.*f", decimals, value);
  return limit.unit.empty() ? number : absl::StrCat(number, " ", limit.unit);
}

// The limits are round numbers: as many decimals as they need.
std::string LimitText(const Limit& limit, double value) {
  const std::string number = absl::StrFormat("%g", value);
  return limit.unit.empty() ? number : absl::StrCat(number, " ", limit.unit);
}

v1::Grade GradeOf(const Limit& limit, double value) {
  const auto reaches = [&](double bound) {
    return limit.better == Better::kMore ? value >= bound : value <= bound;
  };
  if (reaches(limit.good)) return v1::GRADE_GOOD;
  return reaches(limit.usable) ? v1::GRADE_USABLE : v1::GRADE_BAD;
}

// Rounded as the limit wants it, with more decimals where rounding would carry the value over a limit: 98.97
// % does not read as the 99 % that it misses.
std::string ValueText(const Limit& limit, double value) {
  const v1::Grade grade = GradeOf(limit, value);
  for (int decimals = limit.decimals; decimals < limit.decimals + 4; ++decimals) {
    const std::string number = absl::StrFormat("%.*f", decimals, value);
    double shown = 0;
    if (absl::SimpleAtod(number, &shown) && GradeOf(limit, shown) == grade)
      return WithUnit(limit, value, decimals);
  }
  return WithUnit(limit, value, limit.decimals);
}

// "share of sets: 40.2 % (good from 99 %, usable from 90 %)".
std::string MeasuredText(const v1::VerdictCheck& check) {
  return absl::StrCat(check.name(), ": ", check.value(), " (", check.limits(), ")");
}

// Behind those that are as bad. The value of a check is told beside its limits anyway.
void AddOther(v1::Verdict& verdict, v1::Grade grade, const std::string& reason, const std::string& remedy) {
  for (const v1::VerdictCheck& check : verdict.checks())
    if (MeasuredText(check) == reason) return;
  v1::VerdictFinding& other = *verdict.add_others();
  other.set_grade(grade);
  other.set_reason(reason);
  other.set_remedy(remedy);
  for (int i = verdict.others_size() - 1; i > 0 && verdict.others(i - 1).grade() < grade; --i)
    verdict.mutable_others()->SwapElements(i, i - 1);
}

}  // namespace

void AddFinding(v1::Verdict& verdict, v1::Grade grade, const std::string& reason, const std::string& remedy) {
  if (grade <= verdict.grade()) {
    if (grade > v1::GRADE_GOOD) AddOther(verdict, grade, reason, remedy);
    return;
  }
  if (verdict.grade() > v1::GRADE_GOOD)
    AddOther(verdict, verdict.grade(), verdict.reason(), verdict.remedy());
  verdict.set_grade(grade);
  verdict.set_reason(reason);
  verdict.set_remedy(remedy);
}

void AddCheck(v1::Verdict& verdict, const Limit& limit, double value, const std::string& reason,
              const std::string& remedy) {
  v1::VerdictCheck& check = *verdict.add_checks();
  check.set_id(std::string(limit.id));
  check.set_name(std::string(limit.name));
  check.set_grade(GradeOf(limit, value));
  check.set_value(ValueText(limit, value));
  check.set_limits(LimitsText(limit));
  AddFinding(verdict, check.grade(), reason.empty() ? MeasuredText(check) : reason,
             check.grade() == v1::GRADE_GOOD ? ""
             : remedy.empty()                ? std::string(limit.remedy)
                                             : remedy);
}

std::string GradeWord(v1::Grade grade) {
  switch (grade) {
    case v1::GRADE_GOOD:
      return "good";
    case v1::GRADE_USABLE:
      return "usable";
    case v1::GRADE_BAD:
      return "bad";
    default:
      return "unknown";
  }
}

std::string LimitsText(const Limit& limit) {
  const absl::string_view word = limit.better == Better::kMore ? "from" : "up to";
  if (limit.good == limit.usable) return absl::StrCat("good ", word, " ", LimitText(limit, limit.good));
  return absl::StrCat("good ", word, " ", LimitText(limit, limit.good), ", usable ", word, " ",
                      LimitText(limit, limit.usable));
}

std::string VerdictText(const v1::Verdict& verdict) {
  std::string text = absl::StrCat(GradeWord(verdict.grade()), ": ", verdict.reason(), "\n");
  if (!verdict.remedy().empty()) absl::StrAppend(&text, "  remedy: ", verdict.remedy(), "\n");
  for (const v1::VerdictCheck& check : verdict.checks()) {
    if (check.grade() == v1::GRADE_GOOD || MeasuredText(check) == verdict.reason()) continue;
    absl::StrAppend(&text, "  ", GradeWord(check.grade()), ": ", MeasuredText(check), "\n");
  }
  for (const v1::VerdictFinding& other : verdict.others())
    absl::StrAppend(&text, "  ", GradeWord(other.grade()), ": ", other.reason(), "\n");
  return text;
}

absl::Status VerdictStatus(const v1::Verdict& verdict) {
  if (verdict.grade() != v1::GRADE_BAD) return absl::OkStatus();
  absl::Status status = absl::AbortedError(verdict.reason());
  status.SetPayload(kPayload, absl::Cord(verdict.SerializeAsString()));
  return status;
}

bool IsVerdict(const absl::Status& status) { return status.GetPayload(kPayload).has_value(); }

}  // namespace weft

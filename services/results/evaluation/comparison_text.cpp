#include "services/results/evaluation/comparison_text.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

constexpr int kTitleWidth = 46;

std::string MeasureLine(const ComparedMeasure& compared) {
  const EvaluationMeasure& m = *compared.measure;
  const auto number = [&](double value) {
    return absl::StrFormat("%.*f", m.decimals, InShownUnit(m, value));
  };
  const std::string error =
      compared.test ? absl::StrFormat("%.*f", m.decimals + 1, InShownUnit(m, compared.test->standard_error))
                    : "-";
  return absl::StrFormat(
      "%-*s | %9s %9s | %+9.*f %9s | %6d %7s %7s | %s\n", kTitleWidth, TitleWithUnit(m), number(compared.a),
      number(compared.b), m.decimals + 1, InShownUnit(m, compared.a - compared.b), error, compared.frames,
      compared.test ? ProbabilityText(compared.test->p) : "-",
      compared.test ? ProbabilityText(compared.p_adjusted) : "-", OutcomeText(compared.outcome));
}

std::string Distances(const FrameDifference& total) {
  std::string out;
  if (total.distance_mm)
    absl::StrAppendFormat(
        &out,
        "meshes   vertices are %.3f mm apart in the mean, %.3f mm in the median, %.3f mm at "
        "95 %%, %.3f mm at most\n",
        total.distance_mm->mean, total.distance_mm->median, total.distance_mm->p95, total.distance_mm->max);
  if (total.beyond_sigmas_share)
    absl::StrAppendFormat(&out, "         %.1f %% of them farther than the sigmas of both explain (99 %%)\n",
                          100 * *total.beyond_sigmas_share);
  return out;
}

std::string OrDash(const std::string& text) { return text.empty() ? "-" : text; }

}  // namespace

std::string OutcomeText(ComparisonOutcome outcome) {
  switch (outcome) {
    case ComparisonOutcome::kNotTested:
      return "not tested";
    case ComparisonOutcome::kNoDifference:
      return "no significant difference";
    case ComparisonOutcome::kABetter:
      return "A is better";
    case ComparisonOutcome::kBBetter:
      return "B is better";
    case ComparisonOutcome::kALower:
      return "A is lower";
    case ComparisonOutcome::kAHigher:
      return "A is higher";
  }
  return "";
}

std::string ComparisonHeadline(const JobComparison& comparison) {
  const auto count = [&](ComparisonOutcome outcome) {
    return std::ranges::count_if(comparison.measures,
                                 [&](const ComparedMeasure& m) { return m.outcome == outcome; });
  };
  const auto a = count(ComparisonOutcome::kABetter), b = count(ComparisonOutcome::kBBetter),
             same = count(ComparisonOutcome::kNoDifference);
  const std::string frames = Counted(static_cast<int64_t>(comparison.a.frames.size()), "frame", "frames");
  if (a + b + same == 0) return absl::StrCat(frames, ", too few to test differences");
  const auto measures = [](int64_t n) { return n == 0 ? "none" : Counted(n, "measure", "measures"); };
  return absl::StrCat(frames, ": A is better in ", measures(a), ", B in ", measures(b), "; ",
                      same == 0   ? "no measure shows"
                      : same == 1 ? "1 shows"
                                  : absl::StrCat(same, " show"),
                      " no significant difference");
}

std::string ProbabilityText(double p) { return p < 0.001 ? "< 0.001" : absl::StrFormat("%.3f", p); }

std::string ComparisonTable(const JobComparison& comparison) {
  std::string out = absl::StrCat(ComparisonHeadline(comparison), "\n\nA        ", comparison.a.result,
                                 "\nB        ", comparison.b.result, "\n");
  if (!comparison.a.truth.empty()) absl::StrAppend(&out, "truth    ", comparison.a.truth, "\n");
  for (const JobDifference& difference : comparison.differences)
    absl::StrAppend(&out, "differs  ", difference.what, ": A ", OrDash(difference.a), ", B ",
                    OrDash(difference.b), "\n");
  absl::StrAppendFormat(&out, "\n%-*s | %9s %9s | %9s %9s | %6s %7s %7s |\n", kTitleWidth,
                        "mean over the frames", "A", "B", "A - B", "std. err.", "frames", "p", "p, all");
  for (const ComparedMeasure& compared : comparison.measures) out += MeasureLine(compared);
  absl::StrAppendFormat(&out,
                        "p: probability of such a difference by chance; p, all: for all measures together, "
                        "significant below %g\n\n",
                        kSignificanceLevel);
  out += Distances(comparison.total);
  for (const EvaluationRemark& remark : comparison.remarks)
    absl::StrAppendFormat(&out, "note     %s: %s\n", remark.metric, remark.reason);
  for (const auto& [name, side] : {std::pair{"A", &comparison.a}, {"B", &comparison.b}})
    for (const EvaluationRemark& remark : side->remarks)
      absl::StrAppendFormat(&out, "note     %s, %s: %s\n", name, remark.metric, remark.reason);
  return out;
}

}  // namespace weft

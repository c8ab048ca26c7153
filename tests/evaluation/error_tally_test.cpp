#include "evaluation/error_tally.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace weft {
namespace {

// Log-normal: errors from 1e-4 to 1e2.
std::vector<double> MakeErrors(size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::lognormal_distribution<double> errors(-3, 1.5);
  std::vector<double> out(count);
  std::generate(out.begin(), out.end(), [&] { return errors(random); });
  return out;
}

ErrorTally TallyOf(const std::vector<double>& errors) {
  ErrorTally tally;
  for (const double error : errors) tally.push_back(error);
  return tally;
}

void ExpectClose(const ErrorSummary& found, const ErrorSummary& exact, double share) {
  EXPECT_EQ(found.count, exact.count);
  EXPECT_EQ(found.max, exact.max);
  EXPECT_NEAR(found.mean, exact.mean, 1e-9 * exact.mean);
  EXPECT_NEAR(found.median, exact.median, share * exact.median);
  EXPECT_NEAR(found.p95, exact.p95, share * exact.p95);
  EXPECT_NEAR(found.p99, exact.p99, share * exact.p99);
}

TEST(ErrorTallyTest, IsExactForFewErrors) {
  EXPECT_FALSE(ErrorTally().Summary());
  const std::vector<double> errors = MakeErrors(ErrorTally::kExact, 1);
  const ErrorTally tally = TallyOf(errors);
  ExpectClose(*Summarize(tally), *Summarize(errors), 0);
  EXPECT_EQ(tally.values(), errors);
}

TEST(ErrorTallyTest, PercentilesOfManyErrorsAreWithinABin) {
  const std::vector<double> errors = MakeErrors(ErrorTally::kExact * 3, 2);
  const ErrorTally tally = TallyOf(errors);
  EXPECT_EQ(tally.values().capacity(), 0);
  ExpectClose(*Summarize(tally), *Summarize(errors), 0.002);
}

TEST(ErrorTallyTest, AddsUpInAnyOrder) {
  std::vector<double> all;
  ErrorTally forwards, backwards;
  std::vector<ErrorTally> parts;
  for (const size_t count : {size_t{10}, ErrorTally::kExact + 7, size_t{0}, ErrorTally::kExact / 2}) {
    const std::vector<double> errors = MakeErrors(count, static_cast<unsigned>(count));
    all.insert(all.end(), errors.begin(), errors.end());
    parts.push_back(TallyOf(errors));
  }
  for (size_t i = 0; i < parts.size(); ++i) forwards += parts[i], backwards += parts[parts.size() - 1 - i];
  EXPECT_EQ(forwards.size(), all.size());
  ExpectClose(*Summarize(forwards), *Summarize(all), 0.002);
  EXPECT_EQ(Summarize(forwards)->p95, Summarize(backwards)->p95);
}

TEST(ErrorTallyTest, HasPlacesForTheSmallestAndTheLargest) {
  ErrorTally tally = TallyOf(std::vector<double>(ErrorTally::kExact + 1, 0));
  EXPECT_EQ(Summarize(tally)->p99, 0);
  for (size_t i = 0; i < 2 * ErrorTally::kExact; ++i) tally.push_back(1e9);
  EXPECT_EQ(Summarize(tally)->max, 1e9);
  EXPECT_GT(Summarize(tally)->median, 1e6);
}

TEST(ErrorTallyTest, SealedOnesKeepTheirSummary) {
  const std::vector<double> errors = MakeErrors(1000, 3);
  ErrorTally tally = TallyOf(errors);
  tally.Seal();
  EXPECT_EQ(tally.values().capacity(), 0);
  EXPECT_EQ(tally.size(), errors.size());
  ExpectClose(*Summarize(tally), *Summarize(errors), 0);
}

}  // namespace
}  // namespace weft

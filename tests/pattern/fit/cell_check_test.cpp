#include "pattern/fit/cell_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <string_view>

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr FitLimits kLimits{.iterations = 4,
                            .min_explained = 0.5f,
                            .min_ink_lead = 0.25f,
                            .max_move_cells = 0.5f,
                            .min_edge_px = 2.0f,
                            .min_area_px = 8.0f};

// At all limits.
CellFit JustTaken() {
  CellFit fit;
  fit.converged = true;
  fit.moved_cells = 0.5f;
  fit.explained = 0.5f;
  fit.gain = 1;
  fit.center_contrast = 4;
  fit.ink_lead = 4;               // a quarter of 4 * 4
  fit.pose = {0, 0, 2, 0, 0, 4};  // 2 px, 8 px^2
  return fit;
}

float Below(float value) { return std::nextafter(value, -1e9f); }
float Above(float value) { return std::nextafter(value, 1e9f); }

TEST(CellChecks, TakeAFitAtAllLimits) { EXPECT_EQ(Reject(JustTaken(), kLimits), std::nullopt); }

TEST(CellChecks, RejectBeyondEachLimit) {
  CellFit fit = JustTaken();
  fit.moved_cells = Above(0.5f);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kMoved);
  fit = JustTaken();
  fit.explained = Below(0.5f);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kNotExplained);
  fit = JustTaken();
  fit.ink_lead = Below(4);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kOtherInk);
  fit = JustTaken();
  fit.pose.by = Below(4);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kTooSmall);
  fit = JustTaken();
  fit.pose.ax = Below(2);
  fit.pose.by = 8;
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kTooSmall) << "too narrow, of whatever area";
}

TEST(CellChecks, RejectAnotherInkByTheContrastOfTheCell) {
  CellFit fit = JustTaken();
  fit.center_contrast = Above(4);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kOtherInk);
  fit.center_contrast = 2;
  fit.ink_lead = 1;
  EXPECT_EQ(Reject(fit, kLimits), std::nullopt);
}

TEST(CellChecks, RejectPrintSeenFromBehind) {
  CellFit fit = JustTaken();
  fit.pose.ax = -fit.pose.ax;
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kTooSmall);
}

TEST(CellChecks, TellFitsThatWereGivenUpFromThoseThatWereNone) {
  CellFit fit = JustTaken();
  fit.converged = false;
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kNoFit) << "explained well, and yet no fit";
  fit.explained = Below(0.5f);
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kNotExplained) << "given up";
  fit.gain = 0;
  EXPECT_EQ(Reject(fit, kLimits), WhyMissing::kNoFit) << "no light";
  EXPECT_EQ(Reject(CellFit(), kLimits), WhyMissing::kNoFit);
}

TEST(CellChecks, NameEachReason) {
  std::set<std::string_view> words, names;
  for (int k = 0; k < kWhyMissing; ++k) {
    words.insert(Describe(static_cast<WhyMissing>(k)));
    names.insert(NameOf(static_cast<WhyMissing>(k)));
  }
  EXPECT_EQ(words.size(), static_cast<size_t>(kWhyMissing));
  EXPECT_EQ(names.size(), static_cast<size_t>(kWhyMissing));
  EXPECT_EQ(NameOf(WhyMissing::kRival), "rival") << "the last one";
  EXPECT_EQ(NameOf(WhyMissing::kTaken), "taken");
}

TEST(CellChecks, CheckTheirLimits) {
  EXPECT_TRUE(FitLimits().Validate("fit").ok());
  const auto message = [](const FitLimits& limits) {
    return std::string(limits.Validate("my.fit").message());
  };
  EXPECT_THAT(message({.iterations = 0}), HasSubstr("my.fit.iterations"));
  EXPECT_THAT(message({.iterations = 51}), HasSubstr("my.fit.iterations"));
  EXPECT_THAT(message({.min_explained = 0}), HasSubstr("my.fit.min_explained"));
  EXPECT_THAT(message({.min_explained = 1}), HasSubstr("my.fit.min_explained"));
  EXPECT_THAT(message({.min_ink_lead = 1}), HasSubstr("my.fit.min_ink_lead"));
  EXPECT_THAT(message({.max_move_cells = 0}), HasSubstr("my.fit.max_move_cells"));
  EXPECT_THAT(message({.max_move_cells = 3.1f}), HasSubstr("my.fit.max_move_cells"));
  EXPECT_THAT(message({.min_edge_px = -1}), HasSubstr("my.fit.min_edge_px"));
  EXPECT_THAT(message({.min_area_px = -1}), HasSubstr("my.fit.min_area_px"));
  EXPECT_THAT(message({.min_area_px = std::nanf("")}), HasSubstr("my.fit.min_area_px"));
}

// A fit whose position the image knows to `image_px`, and the belief where it is to `prior_px`.
CellFit Believed(double image_px, double prior_px, float noise, const CellPose& pose) {
  CellFit fit;
  fit.pose = pose;
  fit.noise = noise;
  fit.sigma_px = static_cast<float>(1 / std::sqrt(1 / (image_px * image_px) + 1 / (prior_px * prior_px)));
  return fit;
}

TEST(SigmasOfImages, LeaveTheBeliefOut) {
  const CellPose square{10, 10, 8, 0, 0, 8}, flat{10, 10, 9, 3, -2, 4};
  for (const CellPose& pose : {square, flat}) {
    const double pitch_px = std::sqrt(pose.Area());
    for (const float noise : {2.0f, 8.0f, 20.0f}) {
      // The belief is weighed as residuals of kModelNoise are.
      const double prior_px = kPositionPrior * pitch_px * noise / kModelNoise;
      for (const double share : {0.01, 0.1, 0.5, 1.0, 3.0}) {
        const double image_px = share * prior_px;
        const float sigma_px = SigmaOfImage(Believed(image_px, prior_px, noise, pose), kModelNoise);
        EXPECT_NEAR(sigma_px / image_px, 1, 1e-3) << noise << " grey levels, " << share;
      }
    }
  }
}

TEST(SigmasOfImages, AreInfiniteWhereTheImageSaysNothing) {
  CellFit fit;
  fit.pose = {10, 10, 8, 0, 0, 8};
  fit.noise = kModelNoise;
  fit.sigma_px = 1.001f * kPositionPrior * 8;
  EXPECT_EQ(SigmaOfImage(fit, kModelNoise), std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace weft

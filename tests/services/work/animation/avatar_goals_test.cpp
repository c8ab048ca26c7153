#include "services/work/animation/avatar_goals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "services/formats/verdict/verdict.h"

namespace weft {
namespace {

using testing::HasSubstr;
using testing::Not;

v1::AvatarScore& AddScore(v1::AvatarEvaluation& to, const std::string& split, int cameras,
                          const std::string& method, double mean_mm) {
  v1::AvatarScore& score = *to.add_scores();
  score.set_split(split);
  score.set_cameras(cameras);
  score.set_method(method);
  score.set_frames(10);
  score.set_mean_mm(mean_mm);
  score.set_share_within_sigma(0.7);
  score.set_share_within_two_sigma(0.93);
  score.set_threads(1);
  return score;
}

const v1::AvatarGoal* Find(const v1::AvatarEvaluation& in, const std::string& id, const std::string& what) {
  for (const v1::AvatarGoal& goal : in.goals())
    if (goal.id() == id && goal.what().find(what) != std::string::npos) return &goal;
  return nullptr;
}

TEST(AvatarGoals, AreThoseOfTheScoresThatAreThere) {
  v1::Avatar avatar;
  avatar.set_space_bytes(5'900'000);
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "validate", 2, "driven", 1);
  AddAvatarGoals(avatar, evaluation);
  ASSERT_EQ(evaluation.goals_size(), 1);
  EXPECT_EQ(evaluation.goals(0).id(), "A14");
  EXPECT_DOUBLE_EQ(evaluation.goals(0).value(), 5.9);
  EXPECT_TRUE(GoalsStatus(evaluation).ok());
}

TEST(AvatarGoals, TrialsHaveGoalsOfTheirOwn) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "driven", 2);
  AddScore(evaluation, "test-known", 2, "elsewhere", 2.5);
  AddScore(evaluation, "test-known", 2, "one dark", 9).set_lost_vertices(3);
  AddScore(evaluation, "test-unseen", 2, "hand before", 4).set_lost_vertices(7);
  AddScore(evaluation, "test-known", 2, "after dark", 2.2);
  AddScore(evaluation, "test-known", 2, "never dark", 2);
  AddAvatarGoals({}, evaluation);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A7", "elsewhere")->value(), 1.25);
  EXPECT_TRUE(Find(evaluation, "A7", "elsewhere")->met());
  EXPECT_FALSE(Find(evaluation, "A10", "over 80 mm")->met());
  EXPECT_DOUBLE_EQ(Find(evaluation, "A10", "hand before the shirt")->value(), 7);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A10", "after the dark")->value(), 1.1);
}

TEST(AvatarGoals, ShowSaysWhetherSigmaWasFitted) {
  v1::Avatar avatar;
  EXPECT_THAT(AvatarText("shirt.avatar", avatar), HasSubstr("NOT fitted"));
  avatar.mutable_held_out_check()->set_frames(40);
  avatar.mutable_held_out_check()->set_within_one(0.7);
  avatar.mutable_held_out_check()->set_within_two(0.94);
  EXPECT_THAT(
      AvatarText("shirt.avatar", avatar),
      testing::AllOf(HasSubstr("fitted to 40 held-out frames: 70 % of the errors below 1, 94 % below 2"),
                     HasSubstr("as there is one alone"), Not(HasSubstr("NOT"))));
  avatar.mutable_left_out_check()->set_frames(16);
  EXPECT_THAT(AvatarText("shirt.avatar", avatar), Not(HasSubstr("as there is one alone")));
  avatar.mutable_held_out_check()->set_frames(3);
  EXPECT_THAT(AvatarText("shirt.avatar", avatar), HasSubstr("rough"));
}

TEST(AvatarGoals, ShowSaysWhatTheNetGains) {
  v1::Avatar avatar;
  EXPECT_THAT(AvatarText("shirt.avatar", avatar), HasSubstr("net        none"));
  avatar.mutable_net()->mutable_training()->set_steps(500);
  avatar.mutable_net()->mutable_training()->set_steps_taken(400);
  v1::AvatarNetGain& gain = *avatar.mutable_net()->add_gain();
  gain.set_cameras(2), gain.set_frames(40), gain.set_before_mm(3.5), gain.set_after_mm(3.25);
  EXPECT_THAT(
      AvatarText("shirt.avatar", avatar),
      testing::AllOf(HasSubstr("400 of 500 steps"), HasSubstr("time ended"),
                     HasSubstr("2 cameras, 40 held-out frames: mean error 3.250 mm, without it 3.500")));
}

TEST(AvatarGoals, CompareWithTheCarrierAndWithOtherNumbersOfCameras) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "driven", 2).set_ms_a_frame(90);
  AddScore(evaluation, "test-known", 2, "carrier", 5);
  AddScore(evaluation, "test-known", 8, "driven", 1.5);
  AddScore(evaluation, "test-known", 3, "driven", 1);
  AddAvatarGoals({}, evaluation);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A1", "mean")->value(), 2);
  EXPECT_TRUE(Find(evaluation, "A1", "mean")->met());
  EXPECT_DOUBLE_EQ(Find(evaluation, "A5", "carrier")->value(), 0.4);
  // From 3 to 8 cameras it grew.
  EXPECT_DOUBLE_EQ(Find(evaluation, "A8", "test-known")->value(), 1.5);
  EXPECT_FALSE(Find(evaluation, "A8", "test-known")->met());
  EXPECT_FALSE(Find(evaluation, "A12", "one core")->met());
  EXPECT_NEAR(Find(evaluation, "A11", "1 sigma")->value(), 2, 1e-9);
  EXPECT_EQ(Find(evaluation, "A2", ""), nullptr);
  const absl::Status status = GoalsStatus(evaluation);
  EXPECT_TRUE(IsVerdict(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("2 of"));
}

TEST(AvatarGoals, CompareWithThePresetPaper) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "driven", 1.5);
  AddScore(evaluation, "test-known", 2, "paper", 2.5);
  AddScore(evaluation, "test-unseen", 2, "driven", 3);
  AddScore(evaluation, "test-unseen", 2, "paper", 3);
  AddScore(evaluation, "test-known", 2, "elsewhere", 1.75);
  AddScore(evaluation, "test-known", 2, "paper elsewhere", 10).set_lost_frames(2);
  AddAvatarGoals({}, evaluation);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A5", "preset paper, test-known")->value(), 0.6);
  EXPECT_TRUE(Find(evaluation, "A5", "preset paper, test-known")->met());
  EXPECT_FALSE(Find(evaluation, "A5", "preset paper, test-unseen")->met());
  const std::string text = AvatarEvaluationText(evaluation);
  EXPECT_THAT(text, HasSubstr("the preset paper is off by 10.000 mm, 4.00 times"));
  EXPECT_THAT(text, HasSubstr("2 frames are lost; ours by 1.750 mm"));
}

TEST(AvatarGoals, ShowTellsAnAvatarOfThePresetPaper) {
  v1::Avatar avatar;
  avatar.set_kind("paper");
  avatar.set_components(32);
  avatar.set_left_mm(0.75);
  avatar.mutable_net()->set_onnx_bytes(1000);
  const std::string text = AvatarText("paper.avatar", avatar);
  EXPECT_THAT(text,
              testing::AllOf(HasSubstr("by 32 numbers"), HasSubstr("0.750 mm"), Not(HasSubstr("sigma"))));
}

TEST(AvatarGoals, StandBesideOtherWaysOfTheSameRun) {
  v1::AvatarEvaluation evaluation;
  v1::AvatarScore& driven = AddScore(evaluation, "test-known", 2, "driven", 2);
  driven.set_trembling_seen_mm(0.2), driven.set_trembling_unseen_mm(0.5);
  driven.set_at_seams_mm(3), driven.set_off_seams_mm(2);
  AddScore(evaluation, "test-known", 2, "skinned + rays", 5);
  v1::AvatarScore& forgets = AddScore(evaluation, "test-known", 2, "frame by frame", 2.5);
  forgets.set_trembling_seen_mm(0.8), forgets.set_trembling_unseen_mm(0.5);
  AddScore(evaluation, "test-known", 8, "driven", 1).set_from_registered_mm(0.25);
  AddScore(evaluation, "test-known", 8, "registered", 1);
  AddAvatarGoals({}, evaluation);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A6", "skinned")->value(), 0.4);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A9", ", seen, over")->value(), 0.25);
  EXPECT_FALSE(Find(evaluation, "A9", "not seen, over")->met());
  EXPECT_DOUBLE_EQ(Find(evaluation, "A8", "registration")->value(), 0.25);
  EXPECT_TRUE(Find(evaluation, "A8", "registration")->met());
  EXPECT_DOUBLE_EQ(Find(evaluation, "X3", "seams")->value(), 1.5);
  EXPECT_EQ(Find(evaluation, "A5", "net"), nullptr);
  EXPECT_THAT(AvatarEvaluationText(evaluation), HasSubstr("note: the avatar has no net"));
  AddScore(evaluation, "test-known", 2, "without net", 4);
  evaluation.clear_remarks();
  AddAvatarGoals({}, evaluation);
  EXPECT_DOUBLE_EQ(Find(evaluation, "A5", "net")->value(), 0.5);
  EXPECT_EQ(evaluation.remarks_size(), 0);
}

TEST(AvatarGoals, ManyThreadsSayNothingOfOneCore) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "driven", 2).set_threads(2);
  AddAvatarGoals({}, evaluation);
  EXPECT_EQ(Find(evaluation, "A12", ""), nullptr);
}

TEST(AvatarGoals, TextHasARowForEachScore) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-unseen", 3, "driven", 1.234);
  AddScore(evaluation, "test-unseen", 0, "best shape", 3.5).set_share_within_sigma(-1);
  v1::AvatarFloor& floor = *evaluation.add_floor();
  floor.set_take("test-known-twist-301");
  floor.set_mean_mm(2.89);
  evaluation.add_remarks("a take has 2 cameras");
  AddAvatarGoals({}, evaluation);
  const std::string text = AvatarEvaluationText(evaluation);
  EXPECT_THAT(text, HasSubstr("test-unseen     3  driven          10    1.234"));
  EXPECT_THAT(text, HasSubstr("test-unseen     -  best shape      10    3.500"));
  EXPECT_THAT(text, HasSubstr("mean 2.890"));
  EXPECT_THAT(text, HasSubstr("A2    mean mm, test-unseen, 3 cameras"));
  EXPECT_THAT(text, HasSubstr("met, with the aim"));
  EXPECT_THAT(text, HasSubstr("note: a take has 2 cameras"));
}

}  // namespace
}  // namespace weft

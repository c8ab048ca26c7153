#include "services/work/animation/avatar_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "evaluation/measures.h"
#include "services/formats/files/json_file.h"

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

TEST(AvatarText, SaysWhetherSigmaWasFitted) {
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

TEST(AvatarText, SaysWhatTheNetGains) {
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

TEST(BaselineRemarks, SayHowThePresetPaperBearsOtherCameras) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "driven", 1.5);
  AddScore(evaluation, "test-known", 2, "paper", 2.5);
  EXPECT_THAT(BaselineRemarks(evaluation), testing::IsEmpty());
  AddScore(evaluation, "test-known", 2, "elsewhere", 1.75);
  AddScore(evaluation, "test-known", 2, "paper elsewhere", 10).set_lost_frames(2);
  ASSERT_THAT(BaselineRemarks(evaluation), testing::SizeIs(1));
  EXPECT_THAT(BaselineRemarks(evaluation)[0], HasSubstr("the preset paper is off by 10.000 mm, 4.00 times"));
  EXPECT_THAT(BaselineRemarks(evaluation)[0], HasSubstr("2 frames are lost; ours by 1.750 mm"));
}

TEST(AvatarText, TellsAnAvatarOfThePresetPaper) {
  v1::Avatar avatar;
  avatar.set_kind("paper");
  avatar.set_components(32);
  avatar.set_left_mm(0.75);
  avatar.mutable_net()->set_onnx_bytes(1000);
  const std::string text = AvatarText("paper.avatar", avatar);
  EXPECT_THAT(text,
              testing::AllOf(HasSubstr("by 32 numbers"), HasSubstr("0.750 mm"), Not(HasSubstr("sigma"))));
}

TEST(AvatarEvaluationText, KeysAreNamesOfMeasures) {
  const auto is_measure = [](const std::string& name) {
    return std::ranges::any_of(Measures(), [&](const Measure& measure) { return measure.name == name; });
  };
  const std::set<std::string> others = {"split", "cameras", "method", "frames", "threads", "take"};
  for (const auto* message : {v1::AvatarScore::descriptor(), v1::AvatarFloor::descriptor()})
    for (int i = 0; i < message->field_count(); ++i)
      EXPECT_NE(is_measure(message->field(i)->name()), others.contains(message->field(i)->name()))
          << message->field(i)->name();
}

TEST(AvatarEvaluationText, ReadsKeysOfEarlierVersions) {
  v1::AvatarScore score;
  ASSERT_TRUE(ParseJson(R"({"trembling_seen_mm": 0.5})", "avatar-evaluation.json", score).ok());
  EXPECT_EQ(score.error_jitter_seen_mm(), 0.5);
}

TEST(AvatarEvaluationText, HasARowForEachScore) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-unseen", 3, "driven", 1.234);
  AddScore(evaluation, "test-unseen", 0, "best shape", 3.5).set_share_within_sigma(-1);
  v1::AvatarFloor& floor = *evaluation.add_floor();
  floor.set_take("test-known-twist-301");
  floor.set_mean_mm(2.89);
  evaluation.add_remarks("a take has 2 cameras");
  const std::string text = AvatarEvaluationText(evaluation);
  EXPECT_THAT(text, HasSubstr("test-unseen     3  driven          10    1.234"));
  EXPECT_THAT(text, HasSubstr("test-unseen     -  best shape      10    3.500"));
  EXPECT_THAT(text, HasSubstr("mean 2.890"));
  EXPECT_THAT(text, HasSubstr("note: a take has 2 cameras"));
}

}  // namespace
}  // namespace weft

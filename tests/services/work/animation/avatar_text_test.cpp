#include "services/work/animation/avatar_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "evaluation/measures.h"
#include "services/formats/files/json_file.h"
#include "tests/animation/recorded.h"

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

v1::Avatar WholeAvatar() {
  v1::Avatar avatar;
  avatar.set_kind("sparse-view"), avatar.set_made_by("weft 1"), avatar.set_template_id("shirt");
  avatar.set_template_hash("aa"), avatar.set_board_hash("bb");
  avatar.set_components(12), avatar.set_vertices(500), avatar.set_fps(29.97), avatar.set_left_mm(0.75);
  avatar.set_training_frames(300), avatar.set_held_out_frames(40);
  avatar.set_space_bytes(2'000'000);
  v1::AvatarNet& net = *avatar.mutable_net();
  net.set_onnx_bytes(500'000), net.set_sample_bytes(100'000);
  v1::AvatarNetTraining& training = *net.mutable_training();
  training.set_steps(500), training.set_steps_taken(400), training.set_seed(7), training.set_threads(3);
  v1::AvatarNetGain& gain = *net.add_gain();
  gain.set_cameras(2), gain.set_frames(40), gain.set_before_mm(3.5), gain.set_after_mm(3.25);
  for (const bool is_held_out : {false, true}) {
    v1::AvatarSource& source = *avatar.add_sources();
    source.set_name(is_held_out ? "turn" : "walk");
    source.set_frames(is_held_out ? 12 : 30), source.set_held_out(is_held_out);
  }
  v1::AvatarSigmaCheck& held = *avatar.mutable_held_out_check();
  held.set_frames(40), held.set_within_one(0.7), held.set_within_two(0.94);
  v1::AvatarSigmaCheck& left = *avatar.mutable_left_out_check();
  left.set_frames(16), left.set_within_one(0.66), left.set_within_two(0.92);
  v1::AvatarSigma &one = *avatar.add_sigma(), &more = *avatar.add_sigma();
  for (const double factor : {0.5, 1.0, 1.5, 2.0}) one.add_of_rays(factor);
  for (const double factor : {0.25, 0.75}) more.add_of_rays(factor);
  return avatar;
}

constexpr char kNetAndSources[] =
    "net        0.50 MB, trained in 400 of 500 steps, seed 7, 3 threads; its time ended before its steps\n"
    "net        2 cameras, 40 held-out frames: mean error 3.250 mm, without it 3.500 mm\n";
constexpr char kSourceLines[] =
    "source        30 frames  walk\n"
    "held out      12 frames  turn\n";

TEST(AvatarText, TellsAllThatIsKnown) {
  EXPECT_EQ(
      AvatarText("shirt.avatar", WholeAvatar()),
      std::string(
          "shirt.avatar: sparse-view avatar of the template \"shirt\" (aa), board bb; made by weft 1, 2.6 "
          "MB\n"
          "learnt     12 shapes of 500 vertices from 300 frames at 29.97 frames/s; they miss 0.750 mm "
          "(rms per axis)\n"
          "held out   40 frames\n"
          "sigma      fitted to 40 held-out frames: 70 % of the errors below 1, 94 % below 2\n"
          "sigma      fitted to 16 frames of motions left out in turn: 66 % of the errors below 1, 92 % "
          "below 2\n") +
          kNetAndSources +
          "sigma      1 camera: times 0.50 1.00 1.50 2.00 for vertices with 0, 1, 2, 3 and more rays\n"
          "sigma      2 cameras and more: times 0.25 0.75 for vertices with 0, 1, 2, 3 and more rays\n"
          "sigma      fitted without pictures; before three cameras and more it may be too small by them: "
          "`weft evaluate TAKE --avatar AVATAR` of a simulated take tells (1 s %, 2 s %)\n" +
          kSourceLines);
  v1::Avatar paper = WholeAvatar();
  paper.set_kind("paper");
  EXPECT_EQ(
      AvatarText("p.avatar", paper),
      std::string(
          "p.avatar: paper avatar of the template \"shirt\" (aa), board bb; made by weft 1, 2.6 MB\n"
          "learnt     poses of a graph by 12 numbers, from 300 frames; the graph misses 0.750 mm (mean)\n"
          "held out   40 frames\n") +
          kNetAndSources + kSourceLines);
}

TEST(AvatarText, RemarksOnSigmaFollowItsFrames) {
  const auto remark = [](int held_out, int left_out) {
    v1::Avatar avatar = WholeAvatar();
    avatar.mutable_held_out_check()->set_frames(held_out);
    avatar.mutable_left_out_check()->set_frames(left_out);
    const std::string text = AvatarText("a", avatar);
    return std::string(text.find("NOT fitted") != std::string::npos ? "not fitted " : "") +
           (text.find("it is rough") != std::string::npos ? "rough " : "") +
           (text.find("there is one alone") != std::string::npos ? "one alone" : "");
  };
  EXPECT_EQ(remark(0, 0), "not fitted ");
  EXPECT_EQ(remark(0, 5), "rough ");
  EXPECT_EQ(remark(7, 5), "rough ");
  EXPECT_EQ(remark(7, 0), "rough ");
  EXPECT_EQ(remark(8, 0), "one alone");
  EXPECT_EQ(remark(8, 1), "");
  v1::Avatar whole = WholeAvatar();
  whole.mutable_net()->mutable_training()->set_steps_taken(500);
  EXPECT_THAT(AvatarText("a", whole), Not(HasSubstr("its time ended")));
}

// A table with whatever a score may have, and what is not measured.
TEST(AvatarEvaluationText, IsATableOfAllMeasures) {
  v1::AvatarEvaluation evaluation;
  v1::AvatarScore& driven = AddScore(evaluation, "test-unseen-of-a-long-name", 3, "driven", 1.25);
  driven.set_median_mm(1.125), driven.set_across_mm(0.5), driven.set_seen_mm(0.75),
      driven.set_crossed_mm(0.25);
  driven.set_unseen_mm(2.5), driven.set_chamfer_mm(0.625), driven.set_error_jitter_seen_mm(0.375);
  driven.set_error_jitter_unseen_mm(0.875), driven.set_lost_frames(2), driven.set_ms_a_frame(33.5);
  driven.set_from_registered_mm(0.0625), driven.set_cells_a_view(512);
  v1::AvatarScore& skinned = AddScore(evaluation, "validate", 0, "skinned + more rays", 40);
  skinned.set_share_within_sigma(-1), skinned.set_share_within_two_sigma(-1);
  v1::AvatarFloor& floor = *evaluation.add_floor();
  floor.set_take("test-known-twist-301"), floor.set_frames(75);
  floor.set_mean_mm(2.89), floor.set_median_mm(2.5), floor.set_error_jitter_mm(0.125);
  evaluation.add_remarks("a take has 2 cameras");
  ExpectRecorded(AvatarEvaluationText(evaluation));
  ExpectRecorded(AvatarEvaluationText({}), ".without-scores");
}

TEST(BaselineRemarks, NeedScoresOfBoth) {
  v1::AvatarEvaluation evaluation;
  AddScore(evaluation, "test-known", 2, "paper", 2.5);
  AddScore(evaluation, "test-known", 2, "elsewhere", 1.75);
  AddScore(evaluation, "test-known", 2, "paper elsewhere", 10);
  EXPECT_EQ(BaselineRemarks(evaluation),
            std::vector<std::string>{"test-known, 2 cameras elsewhere: the preset paper is off by 10.000 mm, "
                                     "4.00 times as far as before "
                                     "its own cameras (2.500 mm), and 0 frames are lost; ours by 1.750 mm"});
  for (int without = 0; without < 3; ++without) {
    v1::AvatarEvaluation other = evaluation;
    other.mutable_scores(without)->set_frames(0);
    EXPECT_THAT(BaselineRemarks(other), testing::IsEmpty()) << without;
    other = evaluation;
    other.mutable_scores(without)->set_split("test-unseen");
    EXPECT_THAT(BaselineRemarks(other), testing::IsEmpty()) << without;
    if (without == 2) continue;
    other = evaluation;
    other.mutable_scores(without)->set_cameras(3);
    EXPECT_THAT(BaselineRemarks(other), testing::IsEmpty()) << without;
  }
}

}  // namespace
}  // namespace weft

#include "services/formats/options/presets.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "services/formats/options/option_range.h"

namespace weft {
namespace {

using google::protobuf::util::MessageDifferencer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Presets, AnEmptyNameIsBestWhichIsWhatTheStagesHave) {
  const auto best = PresetOptions("best"), none = PresetOptions("");
  ASSERT_TRUE(best.ok() && none.ok());
  EXPECT_TRUE(MessageDifferencer::Equals(*best, *none));
  EXPECT_TRUE(MessageDifferencer::Equals(*best, MessageOf({})));
}

TEST(Presets, PaperDiffersWhereThePaperSays) {
  const auto best = PresetOptions("best"), paper = PresetOptions("paper");
  ASSERT_TRUE(best.ok() && paper.ok());
  std::vector<std::string> differences;
  for (const OptionField& option : AllOptions()) {
    const std::string value = OptionValue(*paper, option);
    if (value != OptionValue(*best, option)) differences.push_back(option.path + " " + value);
  }
  EXPECT_THAT(differences,
              ElementsAre("second_pass.enabled false", "alignment.detection.weigh_by_sigma false",
                          "alignment.detection.filled_weight 1", "alignment.elastic.bending 0.5",
                          "alignment.first_bending 0", "alignment.continuation_rings 0",
                          "alignment.robust.max_rounds 0", "alignment.noise_sigmas 0",
                          "alignment.push.weight 1", "alignment.recon.tangential_share 1",
                          "alignment.layers.weight 0", "alignment.ray_reach_mm 0"));
}

TEST(Presets, StagesAreThoseOfARegistrationAndTheTemplates) {
  EXPECT_THAT(PresetNames(), ElementsAre("best", "paper"));
  EXPECT_THAT(RegistrationStages(),
              ElementsAre("decode", "triangulation", "second_pass", "alignment", "temporal"));
  EXPECT_THAT(AllStages(), ElementsAre("decode", "triangulation", "second_pass", "alignment", "temporal",
                                       "template_build"));
}

TEST(Presets, UnknownOnesAreRefusedWithThoseThatAre) {
  const absl::Status status = PresetOptions("fastest").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"fastest\" is unknown; it is best or paper"));
}

TEST(EffectiveOptions, ChangesGoBeforeThePreset) {
  v1::PipelineOptions changes;
  changes.mutable_alignment()->mutable_elastic()->set_bending(0.3);
  const auto options = EffectiveOptions("paper", changes);
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->alignment().elastic().bending(), 0.3);
  EXPECT_EQ(options->alignment().push().weight(), 1);
}

TEST(EffectiveOptions, OfARegistrationAreSpelledOutOnce) {
  v1::RegistrationOptions asked;
  asked.set_single_pass(true);
  asked.mutable_pipeline()->mutable_triangulation()->mutable_consensus()->set_inlier_radius_mm(1.5);
  const auto options = EffectiveOptions(asked);
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->preset(), "best");
  EXPECT_FALSE(options->pipeline().second_pass().enabled());
  EXPECT_FALSE(options->pipeline().has_template_build());
  EXPECT_EQ(options->pipeline().triangulation().consensus().inlier_radius_mm(), 1.5);
  EXPECT_EQ(options->pipeline().triangulation().consensus().min_views(), 3);
  EXPECT_TRUE(MessageDifferencer::Equals(*EffectiveOptions(*options), *options));
}

TEST(EffectiveOptions, AJobHandsThemToItsStages) {
  v1::RegistrationOptions asked;
  asked.set_preset("paper");
  asked.mutable_pipeline()->mutable_decode()->set_levels(2);
  const auto job = MakeJobOptions(asked);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->pipeline.decode.levels, 2);
  EXPECT_EQ(job->pipeline.alignment.push.weight, 1);
  EXPECT_EQ(job->message.pipeline().decode().levels(), 2);
}

TEST(StageOptionsText, DiffersWhereAnOptionOfTheStageDoes) {
  v1::PipelineOptions changes;
  changes.mutable_triangulation()->mutable_consensus()->set_inlier_radius_mm(1.5);
  const auto before = EffectiveOptions("", {}), after = EffectiveOptions("", changes);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(StageOptionsText(*before, "decode"), StageOptionsText(*after, "decode"));
  EXPECT_NE(StageOptionsText(*before, "triangulation"), StageOptionsText(*after, "triangulation"));
  EXPECT_THAT(StageOptionsText(*after, "triangulation"), HasSubstr("inlier_radius_mm: 1.5"));
  EXPECT_EQ(StageOptionsText({}, "decode"), "");
}

}  // namespace
}  // namespace weft

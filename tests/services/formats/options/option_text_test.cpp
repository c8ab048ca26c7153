#include "services/formats/options/option_text.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "services/formats/options/presets.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ProblemOf(const std::string& text) {
  v1::PipelineOptions options;
  return std::string(AddOptionText(text, "studio.txtpb", options).message());
}

std::string ProblemOfSetting(const std::string& setting) {
  v1::PipelineOptions options;
  return std::string(AddSetting(setting, {}, options).message());
}

TEST(AddOptionText, ReadsOptionsAndLeavesTheOthers) {
  v1::PipelineOptions options;
  options.mutable_decode()->set_levels(2);
  const absl::Status status = AddOptionText(R"(# our studio
triangulation {
  consensus { inlier_radius_mm: 1.5 }  # a knocked rig
  two_view { accept: false }
})",
                                            "studio.txtpb", options);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(options.triangulation().consensus().inlier_radius_mm(), 1.5);
  EXPECT_FALSE(options.triangulation().two_view().accept());
  EXPECT_TRUE(options.triangulation().two_view().has_accept());
  EXPECT_EQ(options.decode().levels(), 2);
  EXPECT_FALSE(options.has_alignment());
}

TEST(AddOptionText, NamesLineOptionAndTheOneThatIsMeant) {
  EXPECT_EQ(ProblemOf("triangulation {\n  consensus {\n    inlier_radius: 1.5\n  }\n}\n"),
            "studio.txtpb:3: triangulation.consensus.inlier_radius: no such option; did you mean "
            "triangulation.consensus.inlier_radius_mm? `weft options` lists all");
  EXPECT_THAT(ProblemOf("\n\ntriangulate { }"),
              AllOf(StartsWith("studio.txtpb:3: triangulate: no such option"),
                    HasSubstr("`weft options` lists all")));
}

TEST(AddOptionText, NamesLineAndRange) {
  EXPECT_EQ(ProblemOf("decode {\n  lattice {\n    min_ink_contrast: 0.1\n    max_stretch: 0.5\n  }\n}"),
            "studio.txtpb:4: decode.lattice.max_stretch: 0.5 must be at least 1");
  EXPECT_THAT(ProblemOf("decode { levels: 2\n levels: 3 }"),
              AllOf(StartsWith("studio.txtpb:2: "), HasSubstr("levels: is given twice")));
  EXPECT_THAT(ProblemOf("decode {\n levels: two }"), StartsWith("studio.txtpb:2: "));
  EXPECT_THAT(ProblemOf("decode {"), StartsWith("studio.txtpb:1: "));
}

TEST(AddOptionText, AnErrorChangesNothing) {
  v1::PipelineOptions options;
  EXPECT_FALSE(AddOptionText("decode { levels: 2 }\nalignment { first_bending: -1 }", "f", options).ok());
  EXPECT_FALSE(options.has_decode());
}

TEST(AddOptionFile, NamesAFileThatIsNotThere) {
  v1::PipelineOptions options;
  EXPECT_THAT(std::string(AddOptionFile("/nowhere/studio.txtpb", options).message()),
              HasSubstr("/nowhere/studio.txtpb"));
}

TEST(AddSetting, SetsOneOptionAndTheLastCounts) {
  v1::PipelineOptions options;
  for (const char* setting :
       {"triangulation.consensus.inlier_radius_mm=2", "decode.corners=false",
        "triangulation.consensus.inlier_radius_mm=1.5", "decode.levels=4", "alignment.push.depth_mm=-2"}) {
    const absl::Status status = AddSetting(setting, {}, options);
    ASSERT_TRUE(status.ok()) << status;
  }
  EXPECT_EQ(options.triangulation().consensus().inlier_radius_mm(), 1.5);
  EXPECT_FALSE(options.decode().corners());
  EXPECT_EQ(options.decode().levels(), 4);
  EXPECT_EQ(options.alignment().push().depth_mm(), -2);
}

TEST(AddSetting, NamesTheOptionThatIsMeant) {
  EXPECT_EQ(ProblemOfSetting("triangulation.consensus.inlier_radius=1.5"),
            "--set triangulation.consensus.inlier_radius: no such option; did you mean "
            "triangulation.consensus.inlier_radius_mm? `weft options` lists all");
  EXPECT_THAT(ProblemOfSetting("inlier_radius_mm=1"),
              HasSubstr("did you mean triangulation.consensus.inlier_radius_mm?"));
  EXPECT_THAT(ProblemOfSetting("triangulation.consensus.min_sigma_px=1"),
              HasSubstr("did you mean triangulation.refinement.min_sigma_px?"));
  EXPECT_THAT(ProblemOfSetting("zzzzzz.qqqqqqqqqq=1"), AllOf(HasSubstr("no such option; `weft options`")));
}

TEST(AddSetting, NamesWhatTheValueMayBe) {
  EXPECT_EQ(ProblemOfSetting("decode.levels=two"),
            "--set decode.levels=two: must be a whole number at least 1, at most 8");
  EXPECT_EQ(ProblemOfSetting("decode.levels=9"),
            "--set decode.levels=9: must be a whole number at least 1, at most 8");
  EXPECT_EQ(ProblemOfSetting("decode.levels="),
            "--set decode.levels=: must be a whole number at least 1, at most 8");
  EXPECT_EQ(ProblemOfSetting("decode.corners=maybe"), "--set decode.corners=maybe: must be true or false");
  EXPECT_EQ(ProblemOfSetting("alignment.push.weight=nan"),
            "--set alignment.push.weight=nan: must be a number at least 0, at most 1e+06");
  EXPECT_THAT(ProblemOfSetting("decode.levels"), HasSubstr("is no OPTION=VALUE"));
  EXPECT_THAT(ProblemOfSetting("decode.growth=1"), HasSubstr("decode.growth is a group of options"));
}

TEST(AddSetting, NamesTheStagesOfTheCommand) {
  v1::PipelineOptions options;
  EXPECT_EQ(
      std::string(AddSetting("alignment.push.weight=1", {"decode", "triangulation"}, options).message()),
      "--set alignment.push.weight=1: this command has no stage alignment, it has decode, triangulation");
  EXPECT_TRUE(AddSetting("decode.levels=1", {"decode", "triangulation"}, options).ok());
}

TEST(OptionFileText, IsReadAsItWasWritten) {
  const auto paper = PresetOptions("paper");
  ASSERT_TRUE(paper.ok());
  const std::string text = OptionFileText(*paper);
  EXPECT_THAT(text,
              HasSubstr("    # Distance up to which a ray takes part in a point; above 0, at most 1000.\n"
                        "    inlier_radius_mm: 1\n"));
  v1::PipelineOptions read;
  const absl::Status status = AddOptionText(text, "paper", read);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(read, *paper));
}

}  // namespace
}  // namespace weft

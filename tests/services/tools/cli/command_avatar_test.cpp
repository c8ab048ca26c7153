// weft avatar train, show; weft evaluate --avatar.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/avatar_text.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/work/animation/waving_takes.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CommandAvatar : public ::testing::Test {
 protected:
  CommandRun Train(std::vector<std::string> words) const {
    words.insert(words.begin(), {"avatar", "train", walk_, "--hold-out", held_, "--out", out_});
    return RunCommand(AddAvatarCommand, std::move(words), false);
  }
  CommandRun Score(std::vector<std::string> words) const {
    words.insert(words.begin(), {"evaluate", source_, "--avatar", takes_.Avatar()});
    return RunCommand(AddEvaluateCommand, std::move(words), false);
  }

  WavingTakes& takes_ = WavingTakes::Get();
  const TempFolder folder_;
  const std::string out_ = folder_ / "tube.avatar", source_ = folder_ / "seen",
                    walk_ = takes_.Write(folder_ / "walk", 14, 0),
                    held_ = takes_.Write(folder_ / "held", 3, 3);
};

TEST_F(CommandAvatar, LearnsAsTheOptionsSay) {
  const CommandRun run =
      Train({"--components", "3", "--max-frames", "10", "--seed", "7", "--threads", "2", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::Avatar about;
  ASSERT_TRUE(ParseJson(run.out, "avatar", about).ok()) << run.out;
  EXPECT_EQ(about.components(), 3);
  EXPECT_EQ(about.training().max_frames(), 10);
  EXPECT_EQ(about.training().seed(), 7u);
  EXPECT_EQ(about.training_frames(), 10);
  ASSERT_EQ(about.sources_size(), 2);
  EXPECT_EQ(about.sources(0).name(), walk_);
  EXPECT_FALSE(about.has_net());
  EXPECT_EQ(run.err, "");

  const CommandRun show = RunCommand(AddAvatarCommand, {"avatar", "show", out_});
  ASSERT_TRUE(show.status.ok()) << show.status;
  EXPECT_EQ(show.out, AvatarText(out_, about));
  v1::Avatar shown;
  ASSERT_TRUE(
      ParseJson(RunCommand(AddAvatarCommand, {"avatar", "show", out_, "--json"}).out, "avatar", shown).ok());
  EXPECT_EQ(shown.SerializeAsString(), about.SerializeAsString());
}

TEST_F(CommandAvatar, TellsWhatItLearntAndHowLongItTook) {
  const CommandRun run = Train({"--components", "2"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, ::testing::StartsWith(out_));
  EXPECT_THAT(run.out, ::testing::ContainsRegex("\ntrained in [0-9]+\\.[0-9] s\n$"));
}

TEST_F(CommandAvatar, OptionsOfANetNeedOne) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--steps", "5"}, {"--hours", "1"}, {"--keep"}}) {
    const CommandRun run = Train(words);
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(run.message(), HasSubstr(words[0] + " requires --net"));
  }
  EXPECT_THAT(Train({"--preset", "paper", "--net"}).message(), HasSubstr("excludes"));
  EXPECT_THAT(Train({"--preset", "paper", "--components", "5"}).message(), HasSubstr("excludes"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(CommandAvatar, IsReadWhereItCannotDoHarm) {
  const auto show = ConfinementOfCommand(AddAvatarCommand, {"avatar", "show", "a.avatar"});
  ASSERT_TRUE(show);
  EXPECT_THAT(show->readable, ElementsAre("a.avatar"));
  EXPECT_THAT(show->writable, ElementsAre());
  EXPECT_FALSE(ConfinementOfCommand(AddAvatarCommand, {"avatar", "train", "take", "--out", "a.avatar"}));
  const auto score = ConfinementOfCommand(
      AddEvaluateCommand, {"evaluate", "set", "--avatar", "a.avatar", "--baseline", "b.avatar", "--template",
                           "shirt", "--out", "o", "--meshes", "m"});
  ASSERT_TRUE(score);
  EXPECT_THAT(score->readable, ElementsAre("a.avatar", "b.avatar", "set", "shirt"));
  EXPECT_THAT(score->writable, ElementsAre("o", "m"));
  EXPECT_FALSE(ConfinementOfCommand(AddEvaluateCommand, {"evaluate", "result"}));
}

TEST_F(CommandAvatar, IsScoredAsTheOptionsSay) {
  takes_.Write(source_, 8, 17);
  const std::string out = folder_ / "scores", meshes = folder_ / "meshes";
  const CommandRun run = Score(
      {"--cameras", "2", "--frames", "1:5", "--out", out, "--meshes", meshes, "--threads", "2", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::AvatarEvaluation printed, written;
  ASSERT_TRUE(ParseJson(run.out, "scores", printed).ok()) << run.out;
  ASSERT_TRUE(ReadJsonFile(out + "/avatar-evaluation.json", written).ok());
  EXPECT_EQ(printed.SerializeAsString(), written.SerializeAsString());
  ASSERT_GT(printed.scores_size(), 0);
  for (const v1::AvatarScore& score : printed.scores()) {
    EXPECT_EQ(score.cameras(), score.method() == "driven" || score.method() == "carrier" ? 2 : 0);
    EXPECT_EQ(score.frames() + score.lost_frames(), 4);
  }
  EXPECT_TRUE(std::filesystem::exists(meshes));
  const CommandRun text = Score({"--cameras", "2", "--frames", "1:5"});
  // The same but for the time that a driven frame took.
  const std::string expected = AvatarEvaluationText(printed);
  EXPECT_EQ(text.out.substr(0, text.out.find("driven ")), expected.substr(0, expected.find("driven ")));
}

TEST_F(CommandAvatar, FramesThatAreNoRangeAreRefusedBeforeTheWork) {
  const CommandRun run = RunCommand(AddEvaluateCommand, {"evaluate", "set", "--avatar", "none", "--frames",
                                                         "5:5", "--out", folder_ / "scores"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "scores"));
}

}  // namespace
}  // namespace weft

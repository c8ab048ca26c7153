// weft dataset list, info, check.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "services/tools/cli/commands.h"
#include "simulation/dataset_presets.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

CommandRun Dataset(std::vector<std::string> words) {
  words.insert(words.begin(), "dataset");
  return RunCommand(AddDatasetCommand, std::move(words));
}

TEST(CommandDataset, ListsTheTakesOfASetInTheOrderInWhichTheyAreMade) {
  const DatasetPreset preset = *DatasetPresetNamed("tiny-drive");
  const CommandRun run = Dataset({"list", "tiny-drive"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  std::istringstream lines(run.out);
  std::string line, name, split, motion;
  std::getline(lines, line);
  EXPECT_THAT(line, StartsWith("take "));
  for (const DatasetTake& take : preset.takes) {
    int frames = 0;
    lines >> name >> split >> motion >> frames;
    EXPECT_EQ(name, take.Name());
    EXPECT_EQ(split, NameOf(take.split));
    EXPECT_EQ(motion, NameOf(take.motion));
    EXPECT_EQ(frames, take.frames);
  }
  EXPECT_FALSE(lines >> name);
}

TEST(CommandDataset, NamesTheSetsThereAre) {
  const TempFolder folder;
  const CommandRun list = Dataset({"list", "huge"}),
                   make = Dataset({"make", "huge", "--out", folder / "set"});
  for (const CommandRun& run : {list, make}) {
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
    for (const DatasetPreset& preset : DatasetPresets())
      EXPECT_THAT(run.message(), HasSubstr(std::string(preset.name)));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "set"));
}

TEST(CommandDataset, InfoCountsWhatIsCompleteOfEachSplit) {
  const TempFolder folder;
  WriteBytes(folder / "dataset.json",
             R"({"name": "mine", "made_by": "weft 1.0", "vertices": 12, "cell_mm": 6, "fps": 60,
 "template_hash": "abc", "takes": [
 {"name": "train-walk-1", "split": "train", "motion": "walk", "motion_seed": "1", "frames": 9,
  "frames_hash": "0123456789abcdef"},
 {"name": "train-wave-2", "split": "train", "motion": "wave", "motion_seed": "2", "frames": 5},
 {"name": "test-unseen-squat-3", "split": "test-unseen", "motion": "squat", "motion_seed": "3", "frames": 7,
  "frames_hash": "0123456789abcdef"}]})");
  const CommandRun run = Dataset({"info", folder.path()});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, folder.path() +
                         ": mine, made by weft 1.0, 12 vertices of 6 mm cells, 60 frames a second, template "
                         "abc\n"
                         "test-unseen  1 of 1 takes are complete, 7 frames: squat\n"
                         "train        1 of 2 takes are complete, 9 frames: walk, wave\n"
                         "chaos floor: not known before a take of the split chaos is complete\n");
  // The frames that the record knows are not there.
  const CommandRun check = Dataset({"check", folder.path()});
  EXPECT_EQ(check.status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(check.message(), HasSubstr("train-walk-1"));
}

TEST(CommandDataset, CheckTellsThatNothingLeaks) {
  const TempFolder folder;
  WriteBytes(
      folder / "dataset.json",
      R"({"takes": [{"name": "train-walk-1", "split": "train", "motion": "walk", "motion_seed": "1"}]})");
  const CommandRun run = Dataset({"check", folder.path()});
  EXPECT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("no test leaks into training"));
  WriteBytes(folder / "dataset.json",
             R"({"takes": [{"name": "train-walk-1", "split": "train", "motion": "walk", "motion_seed": "1"},
 {"name": "test-known-walk-1", "split": "test-known", "motion": "walk", "motion_seed": "1"}]})");
  EXPECT_EQ(Dataset({"check", folder.path()}).status.code(), absl::StatusCode::kInvalidArgument);
}

TEST(CommandDataset, AFolderWithoutASetTellsWhatMakesOne) {
  const TempFolder folder;
  for (const char* command : {"info", "check"}) {
    const CommandRun run = Dataset({command, folder.path()});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound);
    EXPECT_THAT(run.message(), AllOf(HasSubstr(folder.path()), HasSubstr("`weft dataset make` writes it")));
  }
}

}  // namespace
}  // namespace weft

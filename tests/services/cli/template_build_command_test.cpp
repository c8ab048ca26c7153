// `weft template build`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "services/files/board_file.h"
#include "services/files/cloud_file.h"
#include "services/files/template_file.h"
#include "tests/alignment/template_build/sewn_tubes.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/cli/weft_process.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class TemplateBuildCommand : public ::testing::Test {
 protected:
  TemplateBuildCommand() {
    const testing::Tube tube = testing::TwoPanels(0);
    EXPECT_TRUE(WriteBoard(folder_ / "board", testing::PlainBoard(tube)).ok());
    EXPECT_TRUE(WriteCloud(folder_ / "cloud.ply", testing::TubeCloud(tube)).ok());
  }

  WeftRun Build(const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"template",        "build", folder_ / "cloud.ply", "--board",
                                          folder_ / "board", "--out", folder_ / "skirt"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunWeft(arguments);
  }

  TempFolder folder_;
};

TEST_F(TemplateBuildCommand, WritesATemplateAndItsReport) {
  const WeftRun run = Build({"--openings", "2"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("2 panels, 2 seams, 2 openings; 2800 vertices"),
                             HasSubstr("seam     panel 1 to panel 2, 117 mm"), HasSubstr("opening  2")));
  const auto garment = ReadTemplate(folder_ / "skirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "skirt");
  EXPECT_EQ(garment->board_hash, ReadBoard(folder_ / "board")->ContentHash());
  EXPECT_THAT(ReadBytes(folder_ / "skirt/report.html"),
              AllOf(HasSubstr("2 panels, 2 seams, 2 openings"), HasSubstr("Panels on the board")));
}

TEST_F(TemplateBuildCommand, WritesNothingWhenTheOpeningsAreOthers) {
  const WeftRun run = Build({"--openings", "4"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("has 2 openings, expected were 4"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "skirt"));
}

TEST_F(TemplateBuildCommand, RefusesAPanelImageOfAnotherBoard) {
  EXPECT_TRUE(WriteBoard(folder_ / "other", *GenerateBoard(8, 9, 3, 1)).ok());
  const WeftRun run = Build({"--panels", folder_ / "other/board.png"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("has 9 x 8 pixels, the board 120 x 100 cells"));
}

}  // namespace
}  // namespace weft

// `weft template build`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "services/files/board_file.h"
#include "services/files/cloud_file.h"
#include "services/files/garment_parts_file.h"
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
  EXPECT_THAT(run.out, AllOf(HasSubstr("2 panels, 2 seams, 2 openings; "),
                             HasSubstr("seam     panel 1 to panel 2, 117 mm"), HasSubstr("opening  2")));
  const auto garment = ReadTemplate(folder_ / "skirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "skirt");
  EXPECT_EQ(garment->board_hash, ReadBoard(folder_ / "board")->ContentHash());
  EXPECT_THAT(ReadBytes(folder_ / "skirt/report.html"),
              AllOf(HasSubstr("2 panels, 2 seams, 2 openings"), HasSubstr("Panels on the board"),
                    HasSubstr("packed into a square")));
  const auto parts = ReadGarmentParts(folder_ / "skirt");
  ASSERT_TRUE(parts.ok()) << parts.status();
  EXPECT_EQ(parts->panels.size(), 2u);
  EXPECT_EQ(parts->seams.size(), 2u);
  EXPECT_EQ(parts->openings.size(), 2u);
  EXPECT_EQ(parts->expected_openings, 2);
  size_t vertices = 2800;  // of cells
  for (const Seam& seam : parts->seams) vertices += seam.middle.size();
  EXPECT_GT(vertices, 2880u);
  EXPECT_EQ(garment->rest.vertices_mm.size(), vertices);
  EXPECT_EQ(parts->texture_mm.size(), vertices);
  const WeftRun check = RunWeft({"template", "check", folder_ / "skirt"});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_THAT(check.out, AllOf(HasSubstr("openings 2: "), HasSubstr("2 panels, 2 seams"),
                               HasSubstr("texture  panels cover")));
}

TEST_F(TemplateBuildCommand, PrintsJson) {
  const WeftRun run = Build({"--openings", "2", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(::testing::StartsWith("{"), HasSubstr("\"seams\": 2"),
                             HasSubstr("\"expected_openings\": 2"), HasSubstr("\"warnings\": []")));
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
  EXPECT_THAT(run.err, HasSubstr("8 rows and 9 columns of pixels, the board has 100x120 cells"));
}

}  // namespace
}  // namespace weft

// `weft template build`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/template_file.h"
#include "tests/alignment/template_build/sewn_tubes.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/page_data.h"
#include "tests/services/tools/cli/weft_process.h"
#include "weft/v1/page_reports.pb.h"

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
  EXPECT_THAT(run.out, AllOf(HasSubstr("good: 2 panels, 2 seams, 2 openings, "),
                             HasSubstr("seam     panel 1 to panel 2, 117 mm"), HasSubstr("opening  2")));
  const auto garment = ReadTemplate(folder_ / "skirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "skirt");
  EXPECT_EQ(garment->board_hash, ReadBoard(folder_ / "board")->ContentHash());
  const std::string report = ReadBytes(folder_ / "skirt/report.html");
  EXPECT_THAT(MemberOf<v1::TemplateSummary>(report, "summary").verdict().reason(),
              HasSubstr("2 panels, 2 seams, 2 openings"));
  const auto page = MemberOf<v1::TemplatePage>(report, "page");
  ASSERT_EQ(page.outlines_size(), 2);
  EXPECT_EQ(page.outlines(0).cells_size(), page.outlines(0).texture_mm_size());
  EXPECT_EQ(page.sewn_size(), 2);
  const auto parts = ReadGarmentParts(folder_ / "skirt");
  ASSERT_TRUE(parts.ok()) << parts.status();
  EXPECT_EQ(parts->panels.size(), 2u);
  EXPECT_EQ(parts->seams.size(), 2u);
  for (size_t i = 0; i < parts->seams.size(); ++i)
    EXPECT_EQ(static_cast<size_t>(page.seams(static_cast<int>(i)).side_a().cells_size()),
              2 * parts->seams[i].side_a.size());
  EXPECT_NE(page.seams(0).color(), page.seams(1).color());
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

TEST_F(TemplateBuildCommand, CornersBecomeVertices) {
  const WeftRun run = Build({"--openings", "2", "--corners", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("\"vertices_with_cell\": 2800"), HasSubstr("\"openings_mm\"")));
  const auto garment = ReadTemplate(folder_ / "skirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  const auto corners = std::ranges::count_if(garment->node_of_vertex, &VertexNode::IsCorner);
  EXPECT_GT(corners, 2500);
  EXPECT_EQ(MemberOf<v1::TemplateSummary>(ReadBytes(folder_ / "skirt/report.html"), "summary")
                .vertices_with_corner(),
            corners);
  const WeftRun check = RunWeft({"template", "check", folder_ / "skirt", "--openings", "2"});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_THAT(check.out,
              HasSubstr(absl::StrCat("2,800 vertices with a cell, ", corners / 1000, ",",
                                     absl::Dec(corners % 1000, absl::kZeroPad3), " on a corner, ")));

  // What was built can be imported.
  const WeftRun imported = RunWeft({"template", "import", "--mesh", folder_ / "skirt/mesh.ply", "--cells",
                                    folder_ / "skirt/cells.txt", "--corners", folder_ / "skirt/corners.txt",
                                    "--board", folder_ / "board", "--out", folder_ / "again"});
  ASSERT_EQ(imported.status, 0) << imported.err;
  EXPECT_EQ(ReadTemplate(folder_ / "again")->ContentHash(), garment->ContentHash());
  EXPECT_THAT(imported.out, HasSubstr(absl::StrCat(corners, " on a corner")));
  const WeftRun twice = RunWeft({"template", "import", "--mesh", folder_ / "skirt/mesh.ply", "--cells",
                                 folder_ / "skirt/cells.txt", "--corners", folder_ / "skirt/cells.txt",
                                 "--board", folder_ / "board", "--out", folder_ / "twice"});
  EXPECT_EQ(twice.status, 2);
  EXPECT_THAT(twice.err, HasSubstr("vertex 0: has cell"));
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

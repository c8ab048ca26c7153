// weft template join, build of dumps: what they read and say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "capture/image/image_file.h"
#include "pattern/board/board_generation.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/tools/cli/commands.h"
#include "simulation/studio_rig.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class CommandTemplateJoin : public ::testing::Test {
 protected:
  CommandTemplateJoin() {
    unsetenv("WEFT_SERVER");
    const Board skirt = *GenerateBoard(8, 8, 1, 1);
    BoardGenerationOptions apart;
    apart.rows = apart.cols = 8, apart.cell_mm = 1, apart.seed = 2, apart.apart_from = {skirt};
    EXPECT_TRUE(WriteBoard(folder_ / "skirt board", skirt).ok());
    EXPECT_TRUE(WriteBoard(folder_ / "shirt board", *GenerateBoard(apart, [](double) { return true; })).ok());
    for (const char* name : {"skirt", "shirt"}) {
      const TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {1, -1, 0}}, {{0, 2, 1}, {2, 3, 1}}};
      const auto garment = ImportTemplate(
          name, square, {{0, 0, NodeKind::kCenter}, {0, 1, NodeKind::kCenter}, {1, 0, NodeKind::kCenter}, {}},
          *ReadBoard(folder_ / (std::string(name) + " board")));
      EXPECT_TRUE(garment.ok() && WriteTemplate(folder_ / name, *garment).ok());
    }
  }
  AloudRun Template(std::vector<std::string> words) const {
    words.insert(words.begin(), "template");
    return RunAloud(AddTemplateCommand, std::move(words));
  }

  const TempFolder folder_;
};

TEST_F(CommandTemplateJoin, GarmentsOfAJointBoardBecomeOne) {
  const AloudRun board = RunAloud(AddPatternCommand, {"pattern", "join", folder_ / "skirt board",
                                                      folder_ / "shirt board", "--out", folder_ / "both"});
  ASSERT_TRUE(board.status.ok()) << board.status;
  const auto joint = ReadBoard(folder_ / "both");
  EXPECT_EQ(board.out,
            absl::StrCat(folder_ / "both", "/board.json: ", joint->rows, " rows, 8 columns, hash ",
                         joint->ContentHash(), "\n  rows 0 to 7: ", folder_ / "skirt board", "\n  rows ",
                         joint->rows - 8, " to ", joint->rows - 1, ": ", folder_ / "shirt board", "\n"));
  const auto join = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"join", folder_ / "skirt", folder_ / "shirt", "--board", folder_ / "both",
                               "--out", folder_ / "outfit"});
    return Template(more);
  };
  const AloudRun run = join({});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto outfit = ReadTemplate(folder_ / "outfit");
  ASSERT_TRUE(outfit.ok()) << outfit.status();
  EXPECT_EQ(outfit->id, "outfit");
  EXPECT_EQ(run.out, (folder_ / "outfit") + "/template.json: 8 vertices, 4 faces, hash " +
                         outfit->ContentHash() + "\n  vertices 0 to 3: skirt\n  vertices 4 to 7: shirt\n");
  EXPECT_TRUE(join({}).status.ok()) << "by itself";
  EXPECT_EQ(join({"--id", "other"}).status.ok() ? ReadTemplate(folder_ / "outfit")->id : "refused", "other");
  WriteBytes(folder_ / "outfit/template.json", "{}");
  EXPECT_EQ(join({}).status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Template({"join", folder_ / "skirt", folder_ / "none", "--board", folder_ / "both", "--out",
                      folder_ / "x"})
                .status.code(),
            absl::StatusCode::kNotFound);
  EXPECT_FALSE(Template({"join", folder_ / "skirt", folder_ / "shirt", "--board", folder_ / "skirt board",
                         "--out", folder_ / "x"})
                   .status.ok());
}

TEST_F(CommandTemplateJoin, CheckTellsAGarmentOfAnotherBoard) {
  const AloudRun run = Template({"check", folder_ / "skirt", "--board", folder_ / "skirt board"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, testing::StartsWith(
                           "good: 1 opening, 4 vertices\nskirt: 4 vertices, 2 faces, 3 vertices with a "
                           "cell, hash "));
  const auto summary = FromJson<v1::TemplateSummary>(
      Template({"check", folder_ / "skirt", "--board", folder_ / "skirt board", "--json"}).out);
  EXPECT_EQ(summary.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(summary.print_scale(), 1);
  EXPECT_FALSE(Template({"check", folder_ / "skirt", "--board", folder_ / "shirt board"}).status.ok());
  const AloudRun two = Template({"check", folder_ / "skirt", "--openings", "2"});
  EXPECT_THAT(two.message(),
              HasSubstr((folder_ / "skirt") + ": the garment has 1 openings, expected were 2."));
  EXPECT_TRUE(Template({"check", folder_ / "skirt", "--openings", "1"}).status.ok());
}

// Pictures of noise: no frame has a cloud.
TEST_F(CommandTemplateJoin, BuildTellsWhichFramesOfADumpAreLeftOut) {
  PatternFrames cameras({"c00", "c01"}, 64, 48, RawFormat::kMono8);
  for (int frame = 0; frame < 7; ++frame)
    for (size_t camera = 0; camera < 2; ++camera) {
      const auto image = ToFrame(cameras.Frame(camera, static_cast<uint64_t>(frame)));
      const std::string path =
          absl::StrCat(folder_.path(), "/dump/000", frame, "/", cameras.camera_ids()[camera], ".png");
      fs::create_directories(fs::path(path).parent_path());
      ASSERT_TRUE(image.ok() && WriteImageFile(path, *image).ok());
    }
  ASSERT_TRUE(WriteRig(folder_ / "rig.json",
                       *MakeStudioRig("studio", {.cameras = 2, .width_px = 64, .height_px = 48}))
                  .ok());
  const auto build = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"build", folder_ / "dump", "--board", folder_ / "skirt board", "--out", folder_ / "out"});
    return Template(more);
  };
  EXPECT_EQ(build({}).status,
            absl::InvalidArgumentError((folder_ / "dump") + ": is a folder, and a dump needs its "
                                                            "cameras: give --rig rig.json"));
  const auto left_out = [&](const std::string& samples, const std::string& frames = "") {
    const AloudRun run = build({"--rig", folder_ / "rig.json", "--samples", samples, "--frames", frames});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kFailedPrecondition) << run.status;
    EXPECT_THAT(run.message(), HasSubstr((folder_ / "dump") + ": no frame has a cloud; the last one: "));
    std::string left;
    for (size_t at = run.err.find("frame 000"); at != std::string::npos;
         at = run.err.find("frame 000", at + 1))
      if (run.err.compare(at + 10, 14, " is left out: ") == 0) left += run.err[at + 9];
    return left;
  };
  EXPECT_EQ(left_out("1"), "0");
  EXPECT_EQ(left_out("2"), "06");
  EXPECT_EQ(left_out("3"), "036");
  EXPECT_EQ(left_out("100"), "0123456");
  EXPECT_EQ(left_out("2", "2:5"), "24");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace weft

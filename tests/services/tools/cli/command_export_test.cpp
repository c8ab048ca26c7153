// weft export.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/services/results/export/filmed_result.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CommandExport : public ::testing::Test {
 protected:
  CommandRun Export(std::vector<std::string> words, bool is_quiet = false) const {
    words.insert(words.begin(), {"export", result_.request.result, "--out", out_});
    return RunCommand(AddExportCommand, std::move(words), is_quiet);
  }
  // As pictures are exported: with the recording.
  CommandRun ExportPictures(std::vector<std::string> words) const {
    words.insert(words.end(), {"--take", result_.recording.dump, "--rig", result_.recording.rig});
    return Export(std::move(words));
  }
  v1::Export Manifest() const {
    v1::Export manifest;
    EXPECT_TRUE(ReadJsonFile(out_ + "/export.json", manifest).ok());
    return manifest;
  }

  const FilmedResult result_;
  const std::string out_ = result_.folder / "exported";
};

TEST_F(CommandExport, TellsWhatWasWritten) {
  const CommandRun run = Export({"--format", "ply", "--unit", "cm", "--up", "z", "--fps", "25"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": ply, 3 frames of 4 vertices and 2 faces, cm, z up, 25 frames/s (--fps)\n");
  EXPECT_TRUE(std::filesystem::exists(out_ + "/0002.ply"));
  const CommandRun again = Export({"--format", "ply", "--unit", "cm", "--up", "z", "--fps", "25"});
  EXPECT_EQ(again.out, out_ +
                           ": ply, 3 frames of 4 vertices and 2 faces, cm, z up, 25 frames/s (--fps); it was "
                           "complete already\n");
}

TEST_F(CommandExport, FramesWithoutAMeshAndBridgedOnesAreCounted) {
  std::filesystem::remove(result_.MeshFile(1));
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_FAILED);
  result_.WriteReport(1, report);
  report.mutable_temporal()->set_bridged(true);
  result_.WriteReport(2, report);
  const CommandRun run = Export({"--format", "obj", "--frames", "0000:0003", "--allow-unfinished"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr(": obj, 2 frames of 4 vertices and 2 faces, m, "));
  EXPECT_THAT(run.out, ::testing::EndsWith(", 1 bridged, 1 without a mesh\n"));
}

TEST_F(CommandExport, WhatIsLeftOutIsAWarning) {
  const CommandRun run = Export({"--format", "ply"});
  EXPECT_THAT(run.err, HasSubstr("weft: warning: Velocities are left out: nothing tells the frame rate"));
  std::filesystem::remove_all(out_);
  EXPECT_EQ(Export({"--format", "ply"}, true).err, "");
}

TEST_F(CommandExport, MeshesMayBeCoarser) {
  const CommandRun run = Export({"--format", "ply", "--max-vertices", "3"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr(": ply, 3 frames of 3 vertices and 1 faces, m, "));
  const CommandRun alone = Export({"--format", "glb", "--fps", "25", "--normal-map", "32"});
  EXPECT_EQ(alone.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(alone.message(),
              HasSubstr("--normal-map: holds what a coarser mesh lacks; say with --max-vertices"));
}

TEST_F(CommandExport, AttributesAreThoseThatWereNamed) {
  ASSERT_TRUE(Export({"--format", "ply", "--attributes", "sigma,state"}).status.ok());
  EXPECT_THAT(ReadBytes(out_ + "/0000.ply"), AllOf(HasSubstr("sigma"), HasSubstr("state")));
  std::filesystem::remove_all(out_);
  ASSERT_TRUE(Export({"--format", "ply", "--attributes", "none"}).status.ok());
  EXPECT_THAT(ReadBytes(out_ + "/0000.ply"), ::testing::Not(HasSubstr("sigma")));
  const CommandRun unknown = Export({"--format", "ply", "--attributes", "colour"});
  EXPECT_EQ(unknown.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(unknown.message(), HasSubstr("colour"));
}

TEST_F(CommandExport, TheManifestIsPrinted) {
  const CommandRun run = Export({"--format", "ply", "--fps", "25", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::Export printed;
  ASSERT_TRUE(ParseJson(run.out, "export", printed).ok()) << run.out;
  EXPECT_EQ(printed.SerializeAsString(), Manifest().SerializeAsString());
  EXPECT_EQ(printed.fps(), 25);
}

TEST_F(CommandExport, PicturesHaveTheMeshOverThem) {
  const CommandRun run = ExportPictures({"--format", "jpg", "--overlay", "state"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": state over the pictures of 2 cameras, 3 frames\n");
  EXPECT_TRUE(std::filesystem::exists(out_ + "/c1/0000.jpg"));
  EXPECT_EQ(Manifest().overlay(), "state");
  EXPECT_EQ(ExportPictures({"--format", "jpg", "--overlay", "state"}).out,
            out_ + ": state over the pictures of 2 cameras, 3 frames; it was complete already\n");
}

TEST_F(CommandExport, PicturesMayBeOfOneCameraAloneAndUndistorted) {
  const CommandRun run = ExportPictures(
      {"--format", "png", "--overlay", "none", "--undistort", "--camera", "c2", "--frames", "0001:"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": the pictures of 1 cameras, undistorted, 2 frames\n");
  EXPECT_FALSE(std::filesystem::exists(out_ + "/c1"));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/c2/0002.png"));
}

TEST_F(CommandExport, TexturesAreFilesOfEachFrame) {
  const CommandRun run = ExportPictures({"--format", "png", "--texture", "64"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": textures of 64 px, 3 frames\n");
  // A normal map is of what a coarser mesh lacks.
  const CommandRun finest = ExportPictures({"--format", "png", "--normal-map", "32", "--max-vertices", "4"});
  EXPECT_EQ(finest.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(finest.message(), HasSubstr("--max-vertices: the mesh has 4 vertices"));
}

TEST_F(CommandExport, AFileMayCarryItsTexture) {
  const CommandRun run =
      ExportPictures({"--format", "glb", "--texture", "64", "--texture-frames", "2", "--fps", "25"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr(", with a texture of 64 px from 2 frames\n"));
}

TEST_F(CommandExport, SaysWhichFormatsGoWithWhat) {
  const auto refused = [this](std::vector<std::string> words) {
    const CommandRun run = ExportPictures(std::move(words));
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << run.out;
    return run.message();
  };
  EXPECT_EQ(refused({"--format", "ply", "--overlay", "state"}),
            "--overlay: needs --format jpg or png, or mp4 or mkv for videos");
  for (const char* format : {"jpg", "png", "mp4", "mkv"})
    EXPECT_EQ(refused({"--format", format}),
              std::string("--format ") + format +
                  ": such pictures are the cameras' images; say with --overlay what is "
                  "drawn over them: wireframe, state, sigma or none");
  EXPECT_EQ(refused({"--format", "jpg", "--texture", "64"}),
            "--texture, --normal-map: need --format png, which loses nothing and has transparency, or glb");
  EXPECT_EQ(refused({"--format", "jpg", "--normal-map", "64"}),
            "--texture, --normal-map: need --format png, which loses nothing and has transparency, or glb");
  EXPECT_THAT(refused({"--format", "ply", "--undistort"}), HasSubstr("requires --overlay"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

}  // namespace
}  // namespace weft

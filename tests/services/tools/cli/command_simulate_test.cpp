// weft simulate: the smallest takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "figure/motion_generator.h"
#include "services/formats/figure/motion_file.h"
#include "services/formats/files/rig_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class CommandSimulate : public ::testing::Test {
 protected:
  AloudRun Simulate(std::vector<std::string> more, const std::string& preset = "tiny") const {
    more.insert(more.begin(), {"simulate", "--preset", preset, "--out", out_});
    return RunAloud(AddSimulateCommand, std::move(more));
  }
  // What the files follow from, behind the version.
  std::string Recipe() const {
    const std::string text = ReadBytes(out_ + "/recipe.txt");
    return text.substr(text.find(" simulate ") + 10);
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "take";
};

TEST_F(CommandSimulate, FilmsWhatItsOptionsSay) {
  const AloudRun run =
      Simulate({"--frames",       "1",     "--cameras", "2",     "--width-px", "96", "--height-px",    "80",
                "--motion",       "twist", "--fps",     "50",    "--seed",     "5",  "--image-format", "jpg",
                "--jpeg-quality", "80",    "--readout", "color", "--gain",     "0.5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(
      Recipe(),
      "--preset tiny --seed 5 --motion twist --frames 1 --fps 50 --cameras 2 --width-px 96 --height-px 80 "
      "--readout color --gain 0.5 --image-format jpg --jpeg-quality 80\n");
  EXPECT_THAT(run.out.substr(0, out_.size()), out_);
  EXPECT_THAT(
      run.out.substr(out_.size()),
      MatchesRegex(
          ": 1 frames, 2 cameras, 1152 cells; [0-9]+ cells in good sight a view, [0-9.]+ px a cell in "
          "the median; [0-9.]+ s\nno frame has self-intersections\n"));
  const auto rig = ReadRig(out_ + "/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 2u);
  EXPECT_EQ(rig->cameras[1].width_px, 96);
  EXPECT_EQ(rig->cameras[1].height_px, 80);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/0000/c01.jpg"));
}

TEST_F(CommandSimulate, MayMakeTheClothAloneAndEndsWhereItIsComplete) {
  const std::vector<std::string> words = {"--frames", "2", "--no-pictures"};
  const AloudRun run = Simulate(words);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(
      run.out.substr(out_.size()),
      MatchesRegex(
          ": 2 frames of 1274 vertices, 7.5 KiB a frame; 2 frames made now in [0-9.]+ s\nnone of these "
          "frames has self-intersections\n"));
  EXPECT_EQ(Recipe(), "--preset tiny --seed 1 --frames 2 --image-format png --no-pictures\n");
  EXPECT_EQ(Simulate(words).out, out_ + ": is complete, all 2 frames\n");
  EXPECT_FALSE(Simulate({"--frames", "3", "--no-pictures"}).status.ok()) << "another take is there";
}

TEST_F(CommandSimulate, FilesThatAreNotThereAreNamed) {
  EXPECT_EQ(Simulate({"--rig", folder_ / "none.json"}).status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Simulate({"--body", folder_ / "none.body"}).status.code(), absl::StatusCode::kNotFound);
  // A motion moves a person, whom a tube has not.
  ASSERT_TRUE(WriteMotion(folder_ / "a.motion", *MakeMotion({MotionKind::kWave, 1, 30, 1})).ok());
  EXPECT_THAT(Simulate({"--motion", folder_ / "a.motion"}).message(), HasSubstr("clip moves a person"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(CommandSimulate, WhatIsNoneIsAnsweredWithThoseThereAre) {
  EXPECT_EQ(Simulate({"--motion", "flying"}).message(),
            "--motion: \"flying\" is none of breathing, twist, jogging, pinch, twist-and-pinch, and no file "
            "of `weft "
            "motion make`");
  WriteBytes(folder_ / "a.motion", "no motion");
  EXPECT_THAT(Simulate({"--motion", folder_ / "a.motion"}).message(), HasSubstr("a.motion"));
  EXPECT_THAT(Simulate({}, "huge").message(), StartsWith("preset \"huge\" is none of tiny, quickstart, "));
  EXPECT_THAT(Simulate({"--garment", "hat"}).message(), HasSubstr("\"hat\" is none of sheet, tube, "));
  EXPECT_THAT(Simulate({"--readout", "film"}).message(),
              HasSubstr("\"film\" is none of color, mosaic, binned"));
  EXPECT_THAT(Simulate({"--bits", "10", "--image-format", "jpg"}).message(),
              HasSubstr("JPEG holds 8 bits, not 10"));
  EXPECT_EQ(Simulate({"--image-format", "bmp"}).status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(out_));
}

// Each option changes a value that may not be: the take is refused, and the message says of what.
TEST_F(CommandSimulate, ValuesThatCannotBeAreRefused) {
  for (const char* option : {"--cell-mm",           "--fps",        "--cameras",     "--width-px",
                             "--height-px",         "--blur-px",    "--f-number",    "--focus-mm",
                             "--focus-error-mm",    "--vignetting", "--exposure-ms", "--time-offset-ms",
                             "--drop-rate",         "--bits",       "--gain",        "--gamma",
                             "--full-well",         "--read-noise", "--sharpening",  "--color-variation",
                             "--exposure-variation"}) {
    const AloudRun run = Simulate({std::string(option) + "=-5"});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << option;
  }
  EXPECT_FALSE(std::filesystem::exists(out_ + "/recipe.txt"));
  EXPECT_FALSE(Simulate({"--show", "nobody"}).status.ok());
}

TEST_F(CommandSimulate, HelpNamesThePresets) {
  CLI::App app;
  CommandLine line;
  AddSimulateCommand(app, line);
  const std::string about = app.get_subcommand("simulate")->get_option("--preset")->get_description();
  EXPECT_THAT(
      about,
      StartsWith("What to film:\ntiny: a small tube before 12 cameras, 3 frames; seconds\nquickstart: "));
  EXPECT_THAT(about, EndsWith("cropped to it; hours"));
}

}  // namespace
}  // namespace weft

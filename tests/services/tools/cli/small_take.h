// Commands of a take of two cameras, made of images: sets 5 to 8, of which set 6 lacks the camera right.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "capture/image/image_file.h"
#include "services/studio/recording/take_copy.h"
#include "services/studio/recording/take_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"
#include "tests/services/tools/cli/run_aloud.h"

namespace weft {

class SmallTakeTest : public ::testing::Test {
 protected:
  SmallTakeTest() {
    unsetenv("WEFT_SERVER");
    PatternFrames cameras({"left", "right"}, 64, 48, RawFormat::kMono8);
    for (const int frame : {5, 6, 7, 8})
      for (size_t camera = 0; camera < 2; ++camera) {
        const std::string place = absl::StrCat(folder_.path(), "/images/000", frame);
        std::filesystem::create_directories(place);
        const auto image = ToFrame(cameras.Frame(camera, static_cast<uint64_t>(frame)));
        EXPECT_TRUE(
            image.ok() &&
            WriteImageFile(absl::StrCat(place, "/", cameras.camera_ids()[camera], ".png"), *image).ok());
      }
    std::filesystem::remove(folder_ / "images/0006/right.png");
    TakeCopyOptions options;
    options.fps = 30;
    options.recorder = SmallRecorder();
    EXPECT_TRUE(ImportImages(folder_ / "images", take_, options).ok());
  }
  static AloudRun Take(std::vector<std::string> words) {
    words.insert(words.begin(), "take");
    return RunAloud(AddTakeCommand, std::move(words));
  }
  static std::string IdOf(const std::string& take) { return ReadTakeFileStrictly(take)->take.id(); }

  const TempFolder folder_;
  const std::string take_ = folder_ / "take";
};

}  // namespace weft

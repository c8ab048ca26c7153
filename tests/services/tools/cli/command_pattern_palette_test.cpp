// weft pattern palette, on photographs of swatches that are made here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "capture/image/image_file.h"
#include "pattern/board/board.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kSwatch_px = 40;

using Inks = std::array<std::array<uint8_t, 3>, kCellColors>;

// Of medium brightness, so that no noise is cut off.
Inks InksOfBoard() {
  Inks inks;
  for (size_t k = 0; k < inks.size(); ++k)
    for (size_t c = 0; c < 3; ++c)
      inks[k][c] = static_cast<uint8_t>(40 + CellColorRgb(static_cast<CellColor>(k))[c] * 3 / 5);
  return inks;
}

// The seven inks and black side by side, with noise of up to 4 grey levels.
void WritePhoto(const std::string& file, const Inks& inks) {
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  uint64_t state = 1;
  for (int y = 0; y < kSwatch_px; ++y) {
    for (int x = 0; x < (kCellColors + 1) * kSwatch_px; ++x) {
      const auto ink = static_cast<size_t>(x / kSwatch_px);
      for (size_t c = 0; c < 3; ++c) {
        state = state * 6364136223846793005ULL + 1442695040888963407ULL;
        const int noise = static_cast<int>(state >> 60) % 9 - 4;
        pixels->push_back(static_cast<uint8_t>((ink < inks.size() ? inks[ink][c] : 20) + noise));
      }
    }
  }
  Frame frame;
  frame.width_px = (kCellColors + 1) * kSwatch_px;
  frame.height_px = kSwatch_px;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = std::move(pixels);
  ASSERT_TRUE(WriteImageFile(file, frame).ok());
}

class CommandPatternPalette : public ::testing::Test {
 protected:
  CommandRun Palette(std::vector<std::string> more) const {
    std::vector<std::string> words = {"palette", photo_};
    words.insert(words.end(), more.begin(), more.end());
    return RunCommand(AddPatternPaletteCommand, words);
  }
  // The middles of the first and of the last swatch.
  CommandRun OfSwatches(std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--swatches", "20", "20", "300", "20"});
    return Palette(more);
  }

  const TempFolder folder_;
  const std::string photo_ = folder_ / "photo.png";
};

TEST_F(CommandPatternPalette, InksThatAreFarApartSeparateWell) {
  WritePhoto(photo_, InksOfBoard());
  const CommandRun run = OfSwatches();
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("; all inks separate well\n"));
  for (int k = 0; k < kCellColors; ++k)
    EXPECT_THAT(run.out, HasSubstr("\n" + std::string(CellColorName(static_cast<CellColor>(k))) + " "));
  EXPECT_THAT(run.out, HasSubstr("100.00 %"));
}

TEST_F(CommandPatternPalette, OfTwoInksThatAreNearlyAlikeOneIsToBeChanged) {
  Inks inks = InksOfBoard();
  const auto magenta = static_cast<size_t>(CellColor::kMagenta), red = static_cast<size_t>(CellColor::kRed);
  inks[magenta] = inks[red];
  inks[magenta][2] = static_cast<uint8_t>(inks[magenta][2] + 3);  // a little more blue
  WritePhoto(photo_, inks);
  const CommandRun run = OfSwatches();
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("weakest pair: " + std::string(CellColorName(CellColor::kRed)) + " and " +
                                 std::string(CellColorName(CellColor::kMagenta)) + ", "));
  EXPECT_THAT(run.out, AllOf(HasSubstr("; change "), HasSubstr(" blue in it moves it away from ")));
}

TEST_F(CommandPatternPalette, JsonHasInksAndTablesAndThePictureIsWritten) {
  WritePhoto(photo_, InksOfBoard());
  const std::string picture = folder_ / "inks.png";
  const CommandRun run = OfSwatches({"--json", "--picture", picture});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, AllOf(HasSubstr("{\"inks\": [{\"color\": \"red\", \"samples\": "),
                             HasSubstr("\"separation\": [[0.00000, "), HasSubstr("\"confusion\": [["),
                             HasSubstr("\"weakest\": [\"")));
  EXPECT_TRUE(ReadImageFile(picture).ok());
}

TEST_F(CommandPatternPalette, TakesABoardOrSwatchesAndNamesThePhoto) {
  WritePhoto(photo_, InksOfBoard());
  for (const CommandRun& run : {Palette({}), OfSwatches({"--board", "board"})}) {
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(run.message(), AllOf(HasSubstr(photo_), HasSubstr("give either --board")));
  }
  const CommandRun outside = Palette({"--swatches", "20", "20", "3000", "20"});
  EXPECT_EQ(outside.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(outside.message(), HasSubstr(photo_));
  std::filesystem::remove(photo_);
  EXPECT_EQ(OfSwatches().status.code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft

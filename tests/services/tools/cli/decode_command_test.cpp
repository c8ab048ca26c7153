// `weft decode`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "services/formats/files/board_file.h"
#include "services/formats/files/observations_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/board_picture.h"
#include "tests/services/tools/cli/weft_process.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kCellPx = 10, kMarginPx = 20, kRows = 16, kCols = 20;

class DecodeCommand : public ::testing::Test {
 protected:
  DecodeCommand() {
    const Board board = *GenerateBoard(kRows, kCols, 2.7, 1);
    EXPECT_TRUE(WriteBoard(folder_ / "board", board).ok());
    picture_ = PictureOfBoard(board, kCellPx, kMarginPx);
    WritePicture("a.png");
  }

  void WritePicture(const std::string& name) {
    fs::create_directories(fs::path(folder_ / name).parent_path());
    EXPECT_TRUE(WriteImageFile(folder_ / name, picture_).ok());
  }

  // Decodes these pictures to o.csv.
  WeftRun Decode(const std::vector<std::string>& pictures, const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"decode"};
    for (const std::string& picture : pictures) arguments.push_back(folder_ / picture);
    for (const std::string& more :
         {std::string("--board"), folder_ / "board", std::string("--out"), folder_ / "o.csv"})
      arguments.push_back(more);
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunWeft(arguments);
  }

  TempFolder folder_;
  Frame picture_;
};

TEST_F(DecodeCommand, FindsTheCellsWhereTheyWereDrawn) {
  const WeftRun run = Decode({"a.png"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("image"), HasSubstr("corners"), HasSubstr("total"), HasSubstr("1 images")));
  const auto images = ReadObservations(folder_ / "o.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 1u);
  EXPECT_EQ((*images)[0].image, "a");
  int centers = 0;
  double furthest_px = 0;
  for (const Observation& o : (*images)[0].observations) {
    const double shift = o.node.kind == NodeKind::kCenter ? 0.5 : 0;
    centers += o.node.kind == NodeKind::kCenter;
    furthest_px =
        std::max(furthest_px, std::hypot(o.x_px - (kMarginPx + (o.node.col + shift) * kCellPx - 0.5),
                                         o.y_px - (kMarginPx + (o.node.row + shift) * kCellPx - 0.5)));
  }
  EXPECT_LT(furthest_px, 0.3);
  EXPECT_GE(centers, kRows * kCols * 9 / 10);
}

TEST_F(DecodeCommand, TruncatedImageIsReportedAndDoesNotLoseTheOthers) {
  WritePicture("b.png");
  const std::string bytes = ReadBytes(folder_ / "b.png");
  WriteBytes(folder_ / "b.png", bytes.substr(0, bytes.size() / 2));
  WritePicture("c.png");
  const WeftRun run = Decode({"a.png", "b.png", "c.png"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("1 of 3 images could not be decoded"),
                             HasSubstr("b.png: the PNG image is damaged or truncated")));
  EXPECT_THAT(run.out, HasSubstr("failed: "));
  const auto images = ReadObservations(folder_ / "o.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2u);
  EXPECT_EQ((*images)[0].image, "a");
  EXPECT_EQ((*images)[1].image, "c");
}

TEST_F(DecodeCommand, WithoutAnyReadableImageNothingIsWritten) {
  const WeftRun run = Decode({"missing.png"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("missing.png: no such file"), HasSubstr("o.csv was not written")));
  EXPECT_FALSE(fs::exists(folder_ / "o.csv"));
}

TEST_F(DecodeCommand, ImagesOfOneNameAreToldApartByTheirPath) {
  WritePicture("0000/cam.png");
  WritePicture("0001/cam.png");
  ASSERT_EQ(Decode({"0000/cam.png", "0001/cam.png"}).status, 0);
  const auto images = ReadObservations(folder_ / "o.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2u);
  EXPECT_EQ((*images)[1].image, folder_ / "0001/cam.png");
  EXPECT_EQ(Decode({"a.png", "a.png"}).status, 2);
}

TEST_F(DecodeCommand, TheSameBytesAtAnyNumberOfThreads) {
  for (const char* name : {"b.png", "c.png", "d.png"}) WritePicture(name);
  const std::vector<std::string> pictures = {"a.png", "b.png", "c.png", "d.png"};
  ASSERT_EQ(Decode(pictures, {"--threads", "1"}).status, 0);
  const std::string one = ReadBytes(folder_ / "o.csv");
  ASSERT_EQ(Decode(pictures, {"--threads", "4"}).status, 0);
  EXPECT_EQ(ReadBytes(folder_ / "o.csv"), one);
}

TEST_F(DecodeCommand, ExplainsItselfWithAPicture) {
  ASSERT_EQ(Decode({"a.png"}, {"--explain", folder_ / "why"}).status, 0);
  const auto drawn = ReadImageFile(folder_ / "why/a.png");
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_EQ(drawn->width_px, picture_.width_px);
  EXPECT_GT(drawn->height_px, picture_.height_px) << "no legend";
  EXPECT_NE(*drawn->pixels, *picture_.pixels);
}

TEST_F(DecodeCommand, PrintsJsonThatNamesWhatFailed) {
  const WeftRun run = Decode({"a.png", "none.png"}, {"--json"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(run.out.front(), '{');
  EXPECT_THAT(run.out, AllOf(HasSubstr("\"images_decoded\": 1"), HasSubstr("\"images_failed\": 1"),
                             HasSubstr("no such file")));
}

TEST_F(DecodeCommand, GreyImagesNeedTheOrderOfTheirMosaic) {
  Frame grey = picture_;
  grey.format = PixelFormat::kGrey8;
  std::vector<uint8_t> mosaic;  // red and green, green and blue
  for (int y = 0; y < grey.height_px; ++y)
    for (int x = 0; x < grey.width_px; ++x) mosaic.push_back(picture_.row(y)[3 * x + x % 2 + y % 2]);
  grey.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(mosaic));
  ASSERT_TRUE(WriteImageFile(folder_ / "raw.png", grey).ok());
  const WeftRun run = Decode({"raw.png"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("raw.png"), HasSubstr("Bayer")));
  EXPECT_EQ(Decode({"raw.png"}, {"--mosaic", "bayer_rg8"}).status, 0);
  const WeftRun order = Decode({"raw.png"}, {"--mosaic", "rgb8"});
  EXPECT_EQ(order.status, 2);
  EXPECT_THAT(order.err, HasSubstr("bayer_rg8, bayer_gr8"));
}

TEST_F(DecodeCommand, BoardAndOutputAreCheckedBeforeTheWork) {
  const WeftRun out =
      RunWeft({"decode", folder_ / "a.png", "--board", folder_ / "board", "--out", folder_ / "no/o.csv"});
  EXPECT_EQ(out.status, 2);
  EXPECT_THAT(out.err, AllOf(HasSubstr("no/o.csv"), HasSubstr("no is missing")));
  const WeftRun board =
      RunWeft({"decode", folder_ / "a.png", "--board", folder_ / "a.png", "--out", folder_ / "o.csv"});
  EXPECT_EQ(board.status, 2);
  EXPECT_THAT(board.err, HasSubstr("a.png"));
}

}  // namespace
}  // namespace weft

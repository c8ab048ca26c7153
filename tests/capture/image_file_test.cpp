#include "capture/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

Frame Gradient(PixelFormat format) {
  Frame frame;
  frame.width_px = 64;
  frame.height_px = 48;
  frame.format = format;
  std::vector<uint8_t> pixels;
  for (int i = 0; i < 64 * 48 * BytesPerPixel(format); ++i) pixels.push_back(static_cast<uint8_t>(i * 7));
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(pixels);
  return frame;
}

TEST(ImageFile, LosslessFormatsRoundTrip) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.tif"}) {
    for (const PixelFormat format : {PixelFormat::kGrey8, PixelFormat::kRgb8}) {
      const Frame frame = Gradient(format);
      ASSERT_TRUE(WriteImageFile(folder / name, frame).ok());
      const auto read = ReadImageFile(folder / name);
      ASSERT_TRUE(read.ok()) << read.status();
      EXPECT_EQ(read->format, format);
      EXPECT_EQ(*read->pixels, *frame.pixels);
    }
  }
}

TEST(ImageFile, ReadsColoursInTheRightOrder) {
  const TempFolder folder;
  cv::Mat red(8, 8, CV_8UC3, cv::Scalar(0, 0, 255));  // OpenCV: blue, green, red
  for (const char* name : {"red.png", "red.jpg", "red.tif"}) {
    cv::imwrite(folder / name, red);
    const auto read = ReadImageFile(folder / name);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_GT(read->row(4)[12], 250) << name;
    EXPECT_LT(read->row(4)[13], 5) << name;
    EXPECT_LT(read->row(4)[14], 5) << name;
  }
}

TEST(ImageFile, ScalesSixteenBitsToEight) {
  const TempFolder folder;
  cv::imwrite(folder / "a.png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(65535)));
  cv::imwrite(folder / "b.tif", cv::Mat(4, 4, CV_16UC1, cv::Scalar(32896)));
  EXPECT_EQ(ReadImageFile(folder / "a.png")->row(0)[0], 255);
  EXPECT_EQ(ReadImageFile(folder / "b.tif")->row(0)[0], 128);
}

TEST(ImageFile, ReadsGreyFilesAsMosaicOnRequest) {
  const TempFolder folder;
  ASSERT_TRUE(WriteImageFile(folder / "raw.png", Gradient(PixelFormat::kGrey8)).ok());
  EXPECT_EQ(ReadImageFile(folder / "raw.png", PixelFormat::kBayerGb8)->format, PixelFormat::kBayerGb8);
  ASSERT_TRUE(WriteImageFile(folder / "rgb.png", Gradient(PixelFormat::kRgb8)).ok());
  EXPECT_EQ(ReadImageFile(folder / "rgb.png", PixelFormat::kBayerGb8)->format, PixelFormat::kRgb8);
}

TEST(ImageFile, RefusesTruncatedImagesOfEveryFormat) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
    ASSERT_TRUE(WriteImageFile(folder / name, Gradient(PixelFormat::kRgb8)).ok());
    const std::string whole = ReadBytes(folder / name);
    for (const double share : {0.01, 0.5, 0.98}) {
      WriteBytes(folder / name,
                 whole.substr(0, static_cast<size_t>(static_cast<double>(whole.size()) * share)));
      const auto read = ReadImageFile(folder / name);
      EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << name << " cut to " << share;
      EXPECT_THAT(std::string(read.status().message()), HasSubstr(name));
    }
  }
}

TEST(ImageFile, TellsAbsentEmptyAndForeignFilesApart) {
  const TempFolder folder;
  EXPECT_EQ(ReadImageFile(folder / "none.png").status().code(), absl::StatusCode::kNotFound);
  WriteBytes(folder / "empty.png", "");
  EXPECT_THAT(std::string(ReadImageFile(folder / "empty.png").status().message()), HasSubstr("empty"));
  WriteBytes(folder / "text.png", "this is no image");
  EXPECT_EQ(ReadImageFile(folder / "text.png").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ImageFile, WritesNothingWhereItCannot) {
  const TempFolder folder;
  EXPECT_EQ(WriteImageFile(folder / "no such folder/a.png", Gradient(PixelFormat::kGrey8)).code(),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(WriteImageFile(folder / "a.xyz", Gradient(PixelFormat::kGrey8)).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace weft

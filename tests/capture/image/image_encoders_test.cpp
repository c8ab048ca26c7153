#include "capture/image/image_encoders.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/image/image_decoders.h"

namespace weft {
namespace {

// Noise and edges, [rows][cols][channels] of 8 or 16 bits, colours in the order red, green, blue.
cv::Mat Ramp(int type) {
  cv::Mat image(53, 71, type);
  cv::RNG random(11);
  random.fill(image, cv::RNG::UNIFORM, 0, image.depth() == CV_16U ? 65536 : 256);
  cv::GaussianBlur(image, image, {0, 0}, 1.5);
  cv::rectangle(image, {20, 10}, {40, 30}, cv::Scalar::all(40), cv::FILLED);
  return image;
}

ImagePixels ViewOf(const cv::Mat& image) {
  return {image.cols,
          image.rows,
          image.channels(),
          image.depth() == CV_16U ? 16 : 8,
          {image.datastart, image.dataend}};
}

// As OpenCV orders colours.
cv::Mat Swapped(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat swapped;
  if (image.channels() == 3) cv::cvtColor(image, swapped, cv::COLOR_RGB2BGR);
  if (image.channels() == 4) cv::cvtColor(image, swapped, cv::COLOR_RGBA2BGRA);
  return swapped;
}

void ExpectOpenCvReads(const std::vector<uint8_t>& file, const cv::Mat& image) {
  const cv::Mat read = cv::imdecode(file, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.type(), image.type());
  EXPECT_EQ(cv::norm(read, Swapped(image), cv::NORM_INF), 0);
}

TEST(ImageEncoders, AnotherLibraryReadsLosslessFilesToTheSamePixels) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    const cv::Mat image = Ramp(type);
    for (const PngEffort effort : {PngEffort::kFast, PngEffort::kSmall})
      ExpectOpenCvReads(EncodePng(ViewOf(image), effort).value(), image);
    ExpectOpenCvReads(EncodeTiff(ViewOf(image)).value(), image);
  }
  const cv::Mat with_alpha = Ramp(CV_8UC4);
  ExpectOpenCvReads(EncodePng(ViewOf(with_alpha)).value(), with_alpha);
}

TEST(ImageEncoders, JpegHasTheBytesOfAnotherProgramAtTheSameQuality) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const cv::Mat image = Ramp(type);
    for (const int quality : {1, 60, 95, 100}) {
      std::vector<uint8_t> expected;
      ASSERT_TRUE(cv::imencode(".jpg", Swapped(image), expected, {cv::IMWRITE_JPEG_QUALITY, quality}));
      EXPECT_EQ(EncodeJpeg(ViewOf(image), quality).value(), expected) << quality;
    }
  }
}

TEST(ImageEncoders, RefusesSizesThatDoNotFit) {
  const std::vector<uint8_t> bytes(11);
  for (const ImagePixels& wrong :
       {ImagePixels{4, 1, 3, 8, bytes}, ImagePixels{11, 1, 2, 8, {}}, ImagePixels{0, 1, 1, 8, {}},
        ImagePixels{11, 1, 1, 12, bytes}, ImagePixels{-1, -11, 1, 8, bytes}}) {
    EXPECT_EQ(EncodePng(wrong).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(EncodeTiff(wrong).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(EncodeJpeg(wrong, 90).status().code(), absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(EncodeTiff({2, 1, 4, 8, {bytes.data(), 8}}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(EncodeJpeg({1, 1, 1, 16, {bytes.data(), 2}}, 90).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft

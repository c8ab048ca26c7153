#include "capture/camera/v4l2_stream.h"

#include <gtest/gtest.h>

#include <vector>

namespace weft {
namespace {

TEST(V4l2Stream, JpegIsWholeFromItsFirstMarkerToItsLast) {
  std::vector<uint8_t> jpeg = {0xff, 0xd8, 1, 2, 3, 0xff, 0xd9, 0, 0};
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), jpeg.size()), 7u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), 6), 0u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data() + 1, 6), 0u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), 0), 0u);
}

TEST(V4l2Stream, PaddingOfLinesIsLeftOut) {
  const std::vector<uint8_t> padded = {1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9};
  std::vector<uint8_t> image(9);
  CopyLines(padded.data(), 4, 3, 3, image.data());
  EXPECT_EQ(image, (std::vector<uint8_t>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

}  // namespace
}  // namespace weft

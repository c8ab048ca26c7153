#include "capture/image/exif_orientation.h"

#include <gtest/gtest.h>

#include <vector>

namespace weft {
namespace {

// A TIFF structure with one entry, by hand: TIFF 6.0, section 2.
std::vector<uint8_t> LittleExif(uint8_t tag_low, uint8_t type, uint8_t value) {
  return {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, tag_low, 1, type, 0, 1, 0, 0, 0, value, 0, 0, 0, 0, 0, 0, 0};
}

TEST(ExifOrientation, IsReadInBothByteOrders) {
  for (uint8_t value = 1; value <= 8; ++value)
    EXPECT_EQ(OrientationInExif(LittleExif(0x12, 3, value)), value);
  const std::vector<uint8_t> big = {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1, 1, 0x12, 0,
                                    3,   0,   0, 0,  1, 0, 6, 0, 0, 0, 0, 0,    0};
  EXPECT_EQ(OrientationInExif(big), 6);
}

TEST(ExifOrientation, IsUprightWhereNothingSaysOtherwise) {
  EXPECT_EQ(OrientationInExif({}), 1);
  EXPECT_EQ(OrientationInExif(LittleExif(0x12, 3, 0)), 1);
  EXPECT_EQ(OrientationInExif(LittleExif(0x12, 3, 9)), 1);
  EXPECT_EQ(OrientationInExif(LittleExif(0x13, 3, 6)), 1);  // another tag
  EXPECT_EQ(OrientationInExif(LittleExif(0x12, 4, 6)), 1);  // no SHORT
  std::vector<uint8_t> no_tiff = LittleExif(0x12, 3, 6);
  no_tiff[2] = 43;
  EXPECT_EQ(OrientationInExif(no_tiff), 1);
}

// Files of strangers: a directory beyond the end, and more entries than there are bytes.
TEST(ExifOrientation, NeedsNoWholeData) {
  const std::vector<uint8_t> whole = LittleExif(0x12, 3, 6);
  for (size_t size = 0; size < 20; ++size) EXPECT_EQ(OrientationInExif({whole.data(), size}), 1) << size;
  EXPECT_EQ(OrientationInExif({whole.data(), 20}), 6);
  std::vector<uint8_t> far = whole;
  far[4] = far[5] = far[6] = far[7] = 0xff;
  EXPECT_EQ(OrientationInExif(far), 1);
  std::vector<uint8_t> many = LittleExif(0x13, 3, 6);
  many[8] = many[9] = 0xff;
  EXPECT_EQ(OrientationInExif(many), 1);
}

}  // namespace
}  // namespace weft

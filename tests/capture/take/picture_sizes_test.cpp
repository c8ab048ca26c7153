#include "capture/take/picture_sizes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "capture/image/image_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PictureSizes : public ::testing::Test {
 protected:
  // Of the next frame.
  std::string Add(const std::string& camera, int width_px) {
    const std::string frame = std::to_string(1000 + images_.frames.size()).substr(1);
    const std::string path = folder_ / (frame + "-" + camera + ".png");
    Frame picture;
    picture.width_px = width_px;
    picture.height_px = 24;
    picture.pixels =
        std::make_shared<const std::vector<uint8_t>>(static_cast<size_t>(width_px) * 24, uint8_t{1});
    EXPECT_TRUE(WriteImageFile(path, picture).ok());
    images_.frames[frame][camera] = path;
    return path;
  }

  const TempFolder folder_;
  ImageFolder images_;
};

TEST_F(PictureSizes, OneOfFourMayHaveAnotherSizeAndIsMissing) {
  for (int i = 0; i < 3; ++i) Add("c02", 32);
  const std::string odd_one = Add("c02", 40);
  const auto odd = FindOddPictures(images_);
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_THAT(odd->why, ElementsAre(std::pair(odd_one, "is 40x24 pixels, most pictures of c02 are 32x24")));
  EXPECT_THAT(odd->notes, ElementsAre(AllOf(HasSubstr("camera c02: its pictures are 32x24 pixels"),
                                            HasSubstr("40x24 (003)"))));
}

TEST_F(PictureSizes, WhereMoreDoNobodyKnowsWhichOneIsMeant) {
  Add("c02", 32), Add("c02", 40), Add("c02", 32);
  const absl::Status status = FindOddPictures(images_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("camera c02"), HasSubstr("32x24 (000, 002)"), HasSubstr("40x24 (001)"),
                    HasSubstr("import each size as a take or a camera of its own")));
}

TEST_F(PictureSizes, CamerasMayHaveSizesOfTheirOwn) {
  Add("c01", 32), Add("c02", 40);
  const auto odd = FindOddPictures(images_);
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_THAT(odd->why, IsEmpty());
  EXPECT_THAT(odd->notes, IsEmpty());
  EXPECT_TRUE(FindOddPictures({})->notes.empty());
}

TEST_F(PictureSizes, WhatCannotBeReadHasNoSize) {
  for (int i = 0; i < 3; ++i) Add("c02", 32);
  WriteBytes(Add("c02", 40), "no picture any more");
  const auto odd = FindOddPictures(images_);
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_THAT(odd->why, IsEmpty());
}

}  // namespace
}  // namespace weft

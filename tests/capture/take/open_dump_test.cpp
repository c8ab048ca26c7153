#include "capture/take/open_dump.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(OpenDump, TakesAMosaicForFoldersOfImagesAlone) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "take/streams");
  const absl::Status of_take = OpenDump(folder / "take", {}, "bayer_rg8").status();
  EXPECT_EQ(of_take.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(of_take.message()), HasSubstr("a mosaic is named for folders of images"));
  const absl::Status unknown = OpenDump(folder / "images", {}, "bayer_xx8").status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("mosaic bayer_xx8 is no order"));
  EXPECT_FALSE(OpenDump(folder / "missing", {}).ok());
}

}  // namespace
}  // namespace weft

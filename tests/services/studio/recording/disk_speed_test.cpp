#include "services/studio/recording/disk_speed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "tests/capture/file_size_limit.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(DiskSpeed, IsMeasuredWithAFileThatGoesAgain) {
  const TempFolder folder;
  const auto speed = MeasureDiskSpeed(folder.path(), 1);
  ASSERT_TRUE(speed.ok()) << speed.status();
  EXPECT_GT(speed->slowest_write_ms, 0);
  // A write of 8 MiB took no longer than the whole.
  EXPECT_GT(speed->bytes_per_s, 0);
  EXPECT_LE(speed->bytes_per_s, 8 * 1048576.0 / (speed->slowest_write_ms / 1e3));
  const std::filesystem::space_info space = std::filesystem::space(folder.path());
  EXPECT_NEAR(static_cast<double>(speed->free_bytes), static_cast<double>(space.available),
              0.2 * static_cast<double>(space.available));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DiskSpeed, SaysWhichFolderIsNone) {
  const TempFolder folder;
  const absl::Status status = MeasureDiskSpeed(folder / "nowhere", 1).status();
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("nowhere"));
}

// Files of more than 12 MiB are refused: one piece of 8 MiB fits, two do not.
TEST(DiskSpeed, WritesWholePiecesAndLeavesNothingWhereTheDiskRefuses) {
  const TempFolder folder;
  const FileSizeLimit limit(12 << 20);
  EXPECT_TRUE(MeasureDiskSpeed(folder.path(), 8 << 20).ok());
  EXPECT_FALSE(MeasureDiskSpeed(folder.path(), (8 << 20) + 1).ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace weft

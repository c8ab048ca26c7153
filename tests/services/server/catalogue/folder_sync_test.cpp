#include "services/server/catalogue/folder_sync.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <optional>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(FolderSync, FlushesFoldersAndSaysWhichItCannot) {
  const TempFolder folder;
  EXPECT_TRUE(SyncFolderOf(folder / "file").ok());
  EXPECT_EQ(SyncFolderOf(folder / "missing/file").code(), absl::StatusCode::kNotFound);
}

// flock is per open file, so this process stands for the second one.
TEST(FileLock, KeepsASecondOneOutUntilItEnds) {
  const TempFolder folder;
  const std::string path = folder / "catalogue";
  {
    const absl::StatusOr<FileLock> first = FileLock::Take(path);
    ASSERT_TRUE(first.ok()) << first.status();
    if (!first->is_effective()) GTEST_SKIP() << "no locks here";
    EXPECT_EQ(FileLock::Take(path).status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(FileLock::Take(path, std::chrono::milliseconds(20)).status().code(),
              absl::StatusCode::kFailedPrecondition);
  }
  EXPECT_TRUE(FileLock::Take(path).ok());
}

TEST(FileLock, GoesWithWhatItIsMovedTo) {
  const TempFolder folder;
  const std::string path = folder / "catalogue";
  absl::StatusOr<FileLock> first = FileLock::Take(path);
  ASSERT_TRUE(first.ok());
  if (!first->is_effective()) GTEST_SKIP() << "no locks here";
  std::optional<FileLock> moved(*std::move(first));
  EXPECT_FALSE(FileLock::Take(path).ok());
  moved.reset();
  EXPECT_TRUE(FileLock::Take(path).ok());
}

TEST(FileLock, NeedsAFolder) {
  const TempFolder folder;
  EXPECT_EQ(FileLock::Take(folder / "missing/catalogue").status().code(),
            absl::StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace weft

#include "capture/file/posix_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/uio.h>

#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(PosixFiles, AreWrittenInPiecesAndReadAnywhere) {
  const TempFolder folder;
  auto file = PosixFile::Open(folder / "a", O_RDWR | O_CREAT);
  ASSERT_TRUE(file.ok()) << file.status();
  std::string first = "0123", second = "456789";
  const iovec pieces[] = {{first.data(), first.size()}, {second.data(), second.size()}};
  ASSERT_TRUE(file->WriteAt(pieces, 2, 0).ok());
  EXPECT_EQ(*file->Size(), 10u);
  char middle[4];
  ASSERT_TRUE(file->ReadAt(middle, 4, 3).ok());
  EXPECT_EQ(std::string(middle, 4), "3456");
  ASSERT_TRUE(file->Truncate(5).ok());
  EXPECT_EQ(*file->ReadAll(), "01234");
}

TEST(PosixFiles, SayWhereTheyEnd) {
  const TempFolder folder;
  WriteBytes(folder / "a", "0123");
  const auto file = PosixFile::Open(folder / "a", O_RDONLY);
  ASSERT_TRUE(file.ok());
  char bytes[8];
  const absl::Status status = file->ReadAt(bytes, 8, 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(status.message(), (folder / "a") + ": ends at byte 4");
  EXPECT_TRUE(file->ReadAt(bytes, 0, 9).ok());
}

// Nobody writes the FIFO, so that opening it as a file would never end.
TEST(PosixFiles, AreNoFoldersAndNoFifos) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(PosixFile::Open(folder / "fifo", O_RDONLY).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(PosixFile::Open(folder.path(), O_RDONLY).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(PosixFile::Open(folder / "missing", O_RDONLY).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft

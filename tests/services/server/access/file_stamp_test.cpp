#include "services/server/access/file_stamp.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(FileStamp, DiffersAfterAWriteOfTheSameLength) {
  const TempFolder folder;
  const std::string path = folder / "list";
  WriteBytes(path, "one");
  const std::string before = FileStamp(path);
  EXPECT_EQ(FileStamp(path), before);
  WriteBytes(path, "two");
  // Clocks of file systems tick too slowly for two writes in a row.
  std::filesystem::last_write_time(path,
                                   std::filesystem::last_write_time(path) + std::chrono::nanoseconds(1));
  EXPECT_NE(FileStamp(path), before);
}

TEST(FileStamp, DiffersWhereAnotherFileTakesTheName) {
  const TempFolder folder;
  WriteBytes(folder / "a", "same");
  WriteBytes(folder / "b", "same");
  std::filesystem::last_write_time(folder / "b", std::filesystem::last_write_time(folder / "a"));
  const std::string before = FileStamp(folder / "a");
  std::filesystem::rename(folder / "b", folder / "a");
  EXPECT_NE(FileStamp(folder / "a"), before);
}

TEST(FileStamp, TellsThatThereIsNoFile) {
  const TempFolder folder;
  const std::string none = FileStamp(folder / "list");
  WriteBytes(folder / "list", "");
  EXPECT_NE(FileStamp(folder / "list"), none);
}

}  // namespace
}  // namespace weft

#include "base/whole_file.h"

#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A process that has ended.
pid_t Dead() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

size_t FilesIn(const std::string& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), {}));
}

TEST(WholeFile, ReplacesAndLeavesNothingElse) {
  const TempFolder temp;
  for (const Flush flush : {Flush::kToDisk, Flush::kLater}) {
    ASSERT_EQ(ReplaceWholeFile(temp / "board.png", "first", 0666, flush), 0);
    ASSERT_EQ(ReplaceWholeFile(temp / "board.png", "second", 0600, flush), 0);
    EXPECT_EQ(ReadBytes(temp / "board.png"), "second");
    EXPECT_EQ(FilesIn(temp.path()), 1u);
  }
  EXPECT_EQ(fs::status(temp / "board.png").permissions(), fs::perms(0600));
}

TEST(WholeFile, LeavesNothingWhereItFails) {
  const TempFolder temp;
  fs::create_directories(temp / "board.png/a folder");
  EXPECT_NE(ReplaceWholeFile(temp / "board.png", "bytes"), 0);
  EXPECT_EQ(ReplaceWholeFile(temp / "none/board.png", "bytes"), ENOENT);
  EXPECT_EQ(FilesIn(temp.path()), 1u);
}

TEST(WholeFile, RemovesWhatKilledWritersOfTheSameFileLeft) {
  const TempFolder temp;
  const std::string dead = std::to_string(Dead());
  for (const std::string& left : {"board.png.tmp." + dead + ".0", "board.png.tmp." + dead})
    WriteBytes(temp / left, "half");
  const std::string others[] = {"notes.tmp." + dead + ".0", "board.png.tmp.x",
                                "board.png.tmp." + dead + ".0.1",
                                "board.png.tmp.1.0"};  // of init, which lives
  for (const std::string& other : others) WriteBytes(temp / other, "kept");
  ASSERT_EQ(ReplaceWholeFile(temp / "board.png", "whole"), 0);
  EXPECT_EQ(FilesIn(temp.path()), 1 + std::size(others));
  for (const std::string& other : others) EXPECT_TRUE(fs::exists(temp / other)) << other;
}

TEST(WholeFile, LeavesWhatAnotherProcessWrites) {
  const TempFolder temp;
  const std::string name = temp / ("board.png.tmp." + std::to_string(Dead()) + ".0");
  WriteBytes(name, "half");
  const int writer = open(name.c_str(), O_RDONLY);
  ASSERT_EQ(flock(writer, LOCK_EX), 0);
  ASSERT_EQ(ReplaceWholeFile(temp / "board.png", "whole"), 0);
  EXPECT_TRUE(fs::exists(name)) << "its lock is held, perhaps on another machine";
  close(writer);
}

// A writer that is killed in the middle, and the next one.
TEST(WholeFile, IsCleanedUpByTheNextRun) {
  const TempFolder temp;
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit = {1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_DFL);  // the kernel kills it within its write
    ReplaceWholeFile(temp / "board.png", std::string(5000, 'x'));
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(FilesIn(temp.path()), 1u);
  EXPECT_FALSE(fs::exists(temp / "board.png"));
  ASSERT_EQ(ReplaceWholeFile(temp / "board.png", "whole"), 0);
  EXPECT_EQ(FilesIn(temp.path()), 1u);
}

TEST(WholeFile, TemporaryNamesAreItsOwn) {
  EXPECT_TRUE(IsTemporaryName("mesh.ply.tmp.123.0"));
  for (const char* other : {"mesh.ply", ".tmp.1.2", "mesh.ply.tmp.1", "mesh.ply.tmp.1.2x", "mesh.ply.tmp..2",
                            "mesh.ply.tmp.1234567890.2"})
    EXPECT_FALSE(IsTemporaryName(other)) << other;
}

}  // namespace
}  // namespace weft

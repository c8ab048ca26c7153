#include "base/path_facts.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace weft {
namespace {

namespace fs = std::filesystem;

class PathFactsTest : public testing::Test {
 protected:
  PathFactsTest() {
    fs::create_directories(folder_ / "inner");
    std::ofstream(folder_ / "inner" / "file") << "12345";
    fs::create_symlink(folder_ / "gone", folder_ / "dangling");
  }
  ~PathFactsTest() override { fs::remove_all(folder_); }

  const fs::path folder_ = testing::TempDir() + "path_facts_" + std::to_string(getpid());
  const fs::path file_ = folder_ / "inner" / "file";
};

TEST_F(PathFactsTest, SayWhatIsThere) {
  EXPECT_TRUE(PathExists(folder_) && PathExists(file_));
  EXPECT_FALSE(PathExists(folder_ / "gone") || PathExists(folder_ / "dangling"));
  EXPECT_TRUE(IsFolder(folder_) && !IsFolder(file_) && !IsFolder(folder_ / "gone"));
  EXPECT_TRUE(IsRegularFile(file_) && !IsRegularFile(folder_) && !IsRegularFile(folder_ / "gone"));
  EXPECT_EQ(FileBytes(file_), 5u);
}

TEST_F(PathFactsTest, WhatCannotBeLookedAtIsNotThere) {
  const fs::path below_a_file = file_ / "below";
  EXPECT_FALSE(PathExists(below_a_file) || IsFolder(below_a_file) || IsRegularFile(below_a_file));
  EXPECT_EQ(FileBytes(below_a_file), 0u);
  EXPECT_EQ(FileBytes(folder_ / "gone"), 0u);
}

TEST_F(PathFactsTest, TakesPathsAway) {
  EXPECT_FALSE(RemoveFile(folder_ / "inner"));  // holds a file
  EXPECT_TRUE(RemoveFile(file_));
  EXPECT_FALSE(RemoveFile(file_));
  EXPECT_FALSE(PathExists(file_));
  RemoveTree(folder_);
  RemoveTree(folder_);
  EXPECT_FALSE(PathExists(folder_));
}

}  // namespace
}  // namespace weft

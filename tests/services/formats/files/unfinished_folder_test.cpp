#include "services/formats/files/unfinished_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(UnfinishedFolder, HasItsNameOnceItIsWhole) {
  const TempFolder temp;
  for (const char* place : {"take", "images/"}) {
    {
      auto folder = UnfinishedFolder::Begin(temp / place);
      ASSERT_TRUE(folder.ok()) << folder.status();
      WriteBytes(folder->path() + "/file", "bytes");
      EXPECT_FALSE(fs::exists(temp / place));
      ASSERT_TRUE(folder->Publish().ok());
    }
    EXPECT_EQ(ReadBytes((fs::path(temp / place) / "file").string()), "bytes");
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(temp.path()), {}), 2);
}

TEST(UnfinishedFolder, GoesAwayWhereItIsNotFinished) {
  const TempFolder temp;
  fs::create_directory(temp / "empty");
  for (const char* place : {"new", "empty"}) {
    const auto folder = UnfinishedFolder::Begin(temp / place);
    ASSERT_TRUE(folder.ok()) << folder.status();
    WriteBytes(folder->path() + "/below/file", "bytes");
  }
  EXPECT_FALSE(fs::exists(temp / "new"));
  EXPECT_TRUE(fs::is_empty(temp / "empty"));
  EXPECT_EQ(std::distance(fs::directory_iterator(temp.path()), {}), 1);
}

TEST(UnfinishedFolder, ReplacesEmptyFoldersAndNothingElse) {
  const TempFolder temp;
  fs::create_directory(temp / "empty");
  {
    auto folder = UnfinishedFolder::Begin(temp / "empty");
    ASSERT_TRUE(folder.ok());
    ASSERT_TRUE(folder->Publish().ok());
  }
  WriteBytes(temp / "full/notes", "kept");
  WriteBytes(temp / "file", "kept");
  fs::create_symlink(temp / "nowhere", temp / "link");
  for (const char* place : {"full", "file", "link"})
    EXPECT_EQ(UnfinishedFolder::Begin(temp / place).status().code(), absl::StatusCode::kAlreadyExists)
        << place;
  // Somebody else was faster.
  auto late = UnfinishedFolder::Begin(temp / "late");
  ASSERT_TRUE(late.ok());
  WriteBytes(temp / "late/notes", "kept");
  EXPECT_EQ(late->Publish().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ReadBytes(temp / "late/notes"), "kept");
}

TEST(UnfinishedFolder, StaysInTheCurrentFolderAndOnItsDisk) {
  const TempFolder temp;
  const fs::path before = fs::current_path();
  for (const char* place : {".", "./"}) {
    fs::create_directories(temp / "here/lost+found");
    fs::create_directories(temp / "here/.unfinished/left");
    fs::current_path(temp / "here");
    auto folder = UnfinishedFolder::Begin(place);
    ASSERT_TRUE(folder.ok()) << folder.status();
    WriteBytes(folder->path() + "/below/file", "bytes");
    ASSERT_TRUE(folder->Publish().ok());
    EXPECT_EQ(ReadBytes(temp / "here/below/file"), "bytes");
    EXPECT_EQ(std::distance(fs::directory_iterator("."), {}), 2);
    EXPECT_EQ(UnfinishedFolder::Begin(place).status().code(), absl::StatusCode::kAlreadyExists);
    fs::current_path(before);
    fs::remove_all(temp / "here");
  }
}

TEST(UnfinishedFolder, RemovesWhatAKilledProcessLeft) {
  const TempFolder temp;
  const pid_t child = fork();
  if (child == 0) {
    const auto folder = UnfinishedFolder::Begin(temp / "take");
    WriteBytes(folder->path() + "/half", "half");
    _exit(folder.ok() ? 0 : 1);  // without destructors
  }
  waitpid(child, nullptr, 0);
  ASSERT_TRUE(fs::exists(temp / "take.unfinished/half"));
  auto folder = UnfinishedFolder::Begin(temp / "take");
  ASSERT_TRUE(folder.ok()) << folder.status();
  EXPECT_TRUE(fs::is_empty(folder->path()));
}

TEST(UnfinishedFolder, HasOneWriter) {
  const TempFolder temp;
  auto first = UnfinishedFolder::Begin(temp / "take");
  ASSERT_TRUE(first.ok());
  const absl::Status second = UnfinishedFolder::Begin(temp / "take").status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(second.message(), HasSubstr("another process writes it"));
  ASSERT_TRUE(first->Publish().ok());
}

// What is there already is the caller's to move away.
TEST(UnfinishedFolder, BesideAPlaceThatIsThereIsMadeAllTheSame) {
  const TempFolder temp;
  WriteBytes(temp / "full/notes", "kept");
  {
    auto folder = UnfinishedFolder::BeginBeside(temp / "full/");
    ASSERT_TRUE(folder.ok()) << folder.status();
    EXPECT_EQ(folder->path(), temp / "full.unfinished");
    EXPECT_TRUE(absl::IsAlreadyExists(folder->Publish()));
    std::filesystem::rename(temp / "full", temp / "moved");
    WriteBytes(folder->path() + "/file", "bytes");
    ASSERT_TRUE(folder->Publish().ok());
  }
  EXPECT_EQ(ReadBytes(temp / "full/file"), "bytes");
  EXPECT_EQ(ReadBytes(temp / "moved/notes"), "kept");
}

TEST(UnfinishedFolder, MovesUpOverNothingThatCameMeanwhile) {
  const TempFolder temp;
  const fs::path before = fs::current_path();
  fs::current_path(temp.path());
  auto folder = UnfinishedFolder::Begin(".");
  fs::current_path(before);
  ASSERT_TRUE(folder.ok()) << folder.status();
  EXPECT_EQ(folder->path(), (fs::canonical(temp.path()) / ".unfinished").string());
  WriteBytes(folder->path() + "/file", "new");
  WriteBytes(temp / "file", "kept");
  const absl::Status status = folder->Publish();
  EXPECT_TRUE(absl::IsAlreadyExists(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("/file: is there already; name another folder"));
  EXPECT_EQ(ReadBytes(temp / "file"), "kept");
}

}  // namespace
}  // namespace weft

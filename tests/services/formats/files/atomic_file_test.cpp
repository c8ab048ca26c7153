#include "services/formats/files/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "base/error_reason.h"
#include "tests/capture/file_size_limit.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

size_t Entries(const std::string& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(WriteFileAtomically, ReplacesAFileAndLeavesNothingElse) {
  const TempFolder folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a.txt", "old").ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "a.txt", std::string("new\0bytes", 9)).ok());
  EXPECT_EQ(ReadBytes(folder / "a.txt"), std::string("new\0bytes", 9));
  EXPECT_EQ(Entries(folder.path()), 1u);
}

TEST(WriteFileAtomically, KeepsTheOldFileWhenTheNewOneCannotBeCompleted) {
  const TempFolder folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a.txt", "old").ok());
  absl::Status status;
  {
    const FileSizeLimit limit(1000);
    status = WriteFileAtomically(folder / "a.txt", std::string(5000, 'x'));
  }
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), AllOf(HasSubstr(folder / "a.txt"), HasSubstr("(ulimit -f)")));
  EXPECT_THAT(status.message(), ::testing::Not(HasSubstr("make room on the disk")));
  EXPECT_EQ(ReasonOf(status), ErrorReason::kDiskFull);
  EXPECT_EQ(ReadBytes(folder / "a.txt"), "old");
  EXPECT_EQ(Entries(folder.path()), 1u);
}

TEST(WriteFileAtomically, NamesTheFileAndTheRemedyWhenTheFolderIsMissing) {
  const TempFolder folder;
  const absl::Status status = WriteFileAtomically(folder / "missing/a.txt", "x");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("missing/a.txt"), HasSubstr("create it first")));
  EXPECT_FALSE(fs::exists(folder / "missing"));
}

TEST(WriteFileAtomically, APathBelowAFileOrOverAFolderLeavesBothAlone) {
  const TempFolder folder;
  WriteBytes(folder / "file", "kept");
  fs::create_directory(folder / "folder");
  EXPECT_EQ(WriteFileAtomically(folder / "file/a.txt", "x").code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(WriteFileAtomically(folder / "folder", "x").ok());
  EXPECT_EQ(ReadBytes(folder / "file"), "kept");
  EXPECT_EQ(Entries(folder.path()), 2u);
  EXPECT_EQ(Entries(folder / "folder"), 0u);
}

// Root writes everywhere; whoever runs the tests as root writes as another user while this lives.
class WithoutRootRights {
 public:
  WithoutRootRights() : user_(geteuid()) {
    if (user_ == 0) {
      EXPECT_EQ(seteuid(kNobody), 0);
    }
  }
  ~WithoutRootRights() { EXPECT_EQ(seteuid(user_), 0); }

 private:
  static constexpr uid_t kNobody = 65534;
  uid_t user_;
};

TEST(WriteFileAtomically, AFolderWithoutWritePermissionIsPermissionDenied) {
  const TempFolder folder;
  WriteBytes(folder / "locked/a.txt", "old");
  const fs::perms read_only =
      fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read | fs::perms::others_exec;
  fs::permissions(folder.path(), read_only | fs::perms::owner_write);
  fs::permissions(folder / "locked", read_only);
  absl::Status status;
  {
    const WithoutRootRights unprivileged;
    status = WriteFileAtomically(folder / "locked/a.txt", "new");
  }
  fs::permissions(folder / "locked", fs::perms::owner_all);
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(status.message(), HasSubstr("may write to"));
  EXPECT_EQ(ReadBytes(folder / "locked/a.txt"), "old");
}

TEST(ReadWholeFile, TellsMissingFilesFoldersAndLargeFilesApart) {
  const TempFolder folder;
  WriteBytes(folder / "a.txt", "12345");
  EXPECT_EQ(*ReadWholeFile(folder / "a.txt"), "12345");
  EXPECT_EQ(ReadWholeFile(folder / "b.txt").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadWholeFile(folder / "a.txt/b.txt").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadWholeFile(folder.path()).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(ReadWholeFile(folder / "a.txt", 4).status().message(),
              AllOf(HasSubstr("5 bytes"), HasSubstr("4")));
}

TEST(CreateFolders, MakesParentsAndRefusesAFileInTheWay) {
  const TempFolder folder;
  EXPECT_TRUE(CreateFolders(folder / "a/b/c").ok());
  EXPECT_TRUE(CreateFolders(folder / "a/b/c").ok());
  EXPECT_TRUE(fs::is_directory(folder / "a/b/c"));
  WriteBytes(folder / "file", "");
  EXPECT_THAT(CreateFolders(folder / "file").message(), AllOf(HasSubstr("file"), HasSubstr("in the way")));
  EXPECT_FALSE(CreateFolders(folder / "file/below").ok());
}

TEST(CopyWholeFile, HasTheBytesOfTheOther) {
  const TempFolder folder;
  const std::string bytes("a\0b\n", 4);
  WriteBytes(folder / "from", bytes);
  ASSERT_TRUE(CopyWholeFile(folder / "from", folder / "to").ok());
  EXPECT_EQ(ReadBytes(folder / "to"), bytes);
  const absl::Status missing = CopyWholeFile(folder / "none", folder / "to");
  EXPECT_TRUE(absl::IsNotFound(missing)) << missing;
  EXPECT_EQ(ReadBytes(folder / "to"), bytes);
}

}  // namespace
}  // namespace weft

#include "services/formats/files/confined_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstdio>
#include <filesystem>
#include <thread>

#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;
using IfMissing = ConfinedFolder::IfMissing;

class ConfinedFolderTest : public ::testing::Test {
 protected:
  ConfinedFolderTest() {
    fs::create_directories(folder_ / "out");
    WriteBytes(folder_ / "elsewhere/mesh.ply", "kept");
  }
  ConfinedFolder Out() { return *ConfinedFolder::Open(folder_ / "out"); }
  std::string Elsewhere() { return ReadBytes(folder_ / "elsewhere/mesh.ply"); }

  TempFolder folder_;
};

TEST_F(ConfinedFolderTest, WritesReadsListsAndRemoves) {
  const absl::StatusOr<ConfinedFolder> frame = Out().Child("0001", IfMissing::kMake);
  ASSERT_TRUE(frame.ok()) << frame.status();
  ASSERT_TRUE(WriteFileAtomically(frame->At("mesh.ply"), "mesh").ok());
  EXPECT_EQ(ReadBytes(folder_ / "out/0001/mesh.ply"), "mesh");
  EXPECT_EQ(*frame->Read("mesh.ply"), "mesh");
  EXPECT_THAT(*frame->Names(), UnorderedElementsAre("mesh.ply"));
  EXPECT_TRUE(frame->Sync().ok());
  EXPECT_TRUE(frame->Remove("mesh.ply").ok());
  EXPECT_TRUE(frame->Remove("mesh.ply").ok());
  EXPECT_EQ(frame->Read("mesh.ply").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ConfinedFolderTest, AMissingFolderIsNotFound) {
  EXPECT_EQ(ConfinedFolder::Open(folder_ / "none").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Out().Child("0001", IfMissing::kFail).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ConfinedFolderTest, RefusesLinksOnTheWayAndNamesThem) {
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/0001");
  fs::create_directory_symlink(folder_ / "out", folder_ / "link");
  for (const IfMissing missing : {IfMissing::kFail, IfMissing::kMake}) {
    const absl::Status status = Out().Child("0001", missing).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(status.message(), AllOf(HasSubstr(folder_ / "out/0001"), HasSubstr("remove the link")));
  }
  EXPECT_THAT(ConfinedFolder::Open(folder_ / "link").status().message(), HasSubstr(folder_ / "link"));
  WriteBytes(folder_ / "out/0002", "a file");
  EXPECT_EQ(Out().Child("0002", IfMissing::kMake).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(ConfinedFolderTest, ReplacesAndRemovesLinksAndNotWhatTheyLeadTo) {
  const ConfinedFolder out = Out();
  for (int i = 0; i < 2; ++i) {
    fs::remove(folder_ / "out/mesh.ply");
    fs::create_symlink(folder_ / "elsewhere/mesh.ply", folder_ / "out/mesh.ply");
    EXPECT_EQ(out.Read("mesh.ply").status().code(), absl::StatusCode::kNotFound);
    EXPECT_TRUE((i == 0 ? out.Remove("mesh.ply") : WriteFileAtomically(out.At("mesh.ply"), "new")).ok());
    EXPECT_EQ(Elsewhere(), "kept");
  }
  EXPECT_EQ(*out.Read("mesh.ply"), "new");
}

TEST_F(ConfinedFolderTest, OpensFilesBelowItAndNothingElse) {
  const ConfinedFolder out = Out();
  WriteBytes(folder_ / "out/0001/mesh.ply", "mesh");
  const absl::StatusOr<UniqueFd> file = out.OpenFile("0001/mesh.ply");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(*ReadOpenFile(file->get(), "mesh.ply"), "mesh");
  fs::create_symlink(folder_ / "elsewhere/mesh.ply", folder_ / "out/0001/link.ply");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/link");
  fs::create_directory_symlink("0001", folder_ / "out/inside");
  for (const char* link : {"0001/link.ply", "link/mesh.ply", "inside/mesh.ply"}) {
    const absl::Status status = out.OpenFile(link).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_THAT(status.message(), HasSubstr("is a symbolic link"));
  }
  ASSERT_EQ(mkfifo((folder_ / "out/fifo").c_str(), 0600), 0);
  for (const char* other : {"0001", "fifo"})
    EXPECT_EQ(out.OpenFile(other).status().code(), absl::StatusCode::kFailedPrecondition) << other;
  for (const char* none : {"mesh.ply", "0002/mesh.ply", "0001/mesh.ply/x"})
    EXPECT_EQ(out.OpenFile(none).status().code(), absl::StatusCode::kNotFound) << none;
  const std::string absolute = folder_ / "elsewhere/mesh.ply";
  for (const std::string& way_out :
       {std::string("../elsewhere/mesh.ply"), std::string("0001/../../elsewhere/mesh.ply"), absolute,
        std::string(""), std::string("./0001/mesh.ply"), std::string("0001/")})
    EXPECT_EQ(out.OpenFile(way_out).status().code(), absl::StatusCode::kInvalidArgument) << way_out;
}

// Another process has the folder and a link to elsewhere change places all the time.
TEST_F(ConfinedFolderTest, ReadsNothingElsewhereWhileALinkAndAFolderChangePlaces) {
  WriteBytes(folder_ / "out/0001/mesh.ply", "mesh");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/link");
  WriteBytes(folder_ / "out/mesh.ply", "mesh");
  fs::create_symlink(folder_ / "elsewhere/mesh.ply", folder_ / "out/link.ply");
  std::jthread exchanges([this](const std::stop_token& stop) {
    const auto exchange = [this](const char* a, const char* b) {
      renameat2(AT_FDCWD, (folder_ / a).c_str(), AT_FDCWD, (folder_ / b).c_str(), RENAME_EXCHANGE);
    };
    while (!stop.stop_requested()) {
      exchange("out/0001", "out/link");
      exchange("out/mesh.ply", "out/link.ply");
    }
  });
  const ConfinedFolder out = Out();
  int read = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    for (const char* path : {"0001/mesh.ply", "mesh.ply"}) {
      const absl::StatusOr<std::string> bytes = out.Read(path);
      ASSERT_TRUE(!bytes.ok() || *bytes == "mesh") << path;
      ++(bytes.ok() ? read : refused);
    }
  }
  EXPECT_GT(read, 0);
  EXPECT_GT(refused, 0);
}

TEST_F(ConfinedFolderTest, StaysWhatItWasWhenALinkTakesItsPlace) {
  const ConfinedFolder out = Out();
  fs::rename(folder_ / "out", folder_ / "moved");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out");
  ASSERT_TRUE(WriteFileAtomically(out.At("mesh.ply"), "new").ok());
  ASSERT_TRUE(out.Child("0001", IfMissing::kMake).ok());
  EXPECT_EQ(Elsewhere(), "kept");
  EXPECT_EQ(ReadBytes(folder_ / "moved/mesh.ply"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "elsewhere/0001"));
}

TEST_F(ConfinedFolderTest, SpeaksOfTheFolderByItsName) {
  const ConfinedFolder out = Out();
  fs::create_directory(folder_ / "out/mesh.ply");
  const absl::Status status = out.InWords(WriteFileAtomically(out.At("mesh.ply"), "new"));
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr(folder_ / "out/mesh.ply"), ::testing::Not(HasSubstr("/proc"))));
}

TEST_F(ConfinedFolderTest, SaysWhyAFolderOrAFileCannotBeOpened) {
  EXPECT_TRUE(absl::IsInvalidArgument(ConfinedFolder::Open("out").status()));
  EXPECT_EQ(ConfinedFolder::Open("").status().message(), "\"\" is no absolute path");
  EXPECT_TRUE(ConfinedFolder::Open("/").ok());
  const ConfinedFolder out = Out();
  const std::string name(300, 'x');  // longer than a name may be
  const absl::Status child = out.Child(name, IfMissing::kFail).status();
  EXPECT_TRUE(absl::IsPermissionDenied(child)) << child;
  EXPECT_EQ(child.message(), folder_ / "out/" + name + ": cannot be opened (File name too long)");
  EXPECT_FALSE(out.Child(name, IfMissing::kMake).ok());
  const absl::Status file = out.OpenFile(name).status();
  EXPECT_TRUE(absl::IsPermissionDenied(file)) << file;
  EXPECT_EQ(file.message(), folder_ / "out/" + name + ": cannot be opened (File name too long)");
  fs::create_directory(folder_ / "out/0001");
  const absl::Status removed = out.Remove("0001");
  EXPECT_TRUE(absl::IsPermissionDenied(removed)) << removed;
  EXPECT_THAT(std::string(removed.message()), HasSubstr("out/0001: cannot be removed ("));
}

TEST_F(ConfinedFolderTest, WithoutFreeDescriptorsIsExhausted) {
  const ConfinedFolder out = Out();
  WriteBytes(folder_ / "out/mesh.ply", "mesh");
  fs::create_directory(folder_ / "out/0001");
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none = {0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const absl::Status child = out.Child("0001", IfMissing::kFail).status(),
                     file = out.OpenFile("mesh.ply").status(), again = out.Again().status(),
                     names = out.Names().status();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_TRUE(absl::IsResourceExhausted(child)) << child;
  EXPECT_TRUE(absl::IsResourceExhausted(file)) << file;
  EXPECT_TRUE(absl::IsResourceExhausted(again)) << again;
  EXPECT_TRUE(absl::IsPermissionDenied(names)) << names;
  EXPECT_THAT(std::string(names.message()), HasSubstr("out: cannot be listed ("));
}

TEST_F(ConfinedFolderTest, ASecondOneIsOfTheSameFolder) {
  absl::StatusOr<ConfinedFolder> first = ConfinedFolder::Open(folder_ / "out");
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = first->Again();
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_NE(second->At("mesh.ply"), first->At("mesh.ply"));
  first = absl::NotFoundError("closed");
  ASSERT_TRUE(WriteFileAtomically(second->At("mesh.ply"), "mesh").ok());
  EXPECT_EQ(*second->Read("mesh.ply"), "mesh");
  EXPECT_EQ(second->Named("mesh.ply"), folder_ / "out/mesh.ply");
}

TEST(TemporaryNames, AreThoseOfWriteFileAtomically) {
  EXPECT_TRUE(IsTemporaryNameOf("mesh.ply.tmp.123.0", "mesh.ply"));
  for (const char* other : {"mesh.ply", "mesh.ply.tmp.", "mesh.ply.tmp.1", "mesh.ply.tmp.1.",
                            "mesh.ply.tmp.1.2x", "cloud.ply.tmp.1.2", "mesh.ply.tmp..2"}) {
    EXPECT_FALSE(IsTemporaryNameOf(other, "mesh.ply")) << other;
  }
}

}  // namespace
}  // namespace weft

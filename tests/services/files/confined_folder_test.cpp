#include "services/files/confined_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/files/atomic_file.h"
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

TEST(TemporaryNames, AreThoseOfWriteFileAtomically) {
  EXPECT_TRUE(IsTemporaryNameOf("mesh.ply.tmp.123.0", "mesh.ply"));
  for (const char* other : {"mesh.ply", "mesh.ply.tmp.", "mesh.ply.tmp.1", "mesh.ply.tmp.1.",
                            "mesh.ply.tmp.1.2x", "cloud.ply.tmp.1.2", "mesh.ply.tmp..2"}) {
    EXPECT_FALSE(IsTemporaryNameOf(other, "mesh.ply")) << other;
  }
}

}  // namespace
}  // namespace weft

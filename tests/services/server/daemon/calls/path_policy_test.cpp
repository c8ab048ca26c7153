#include "services/server/daemon/calls/path_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PathPolicyTest : public ::testing::Test {
 protected:
  PathPolicyTest() {
    fs::create_directories(folder_ / "open/takes");
    fs::create_directories(folder_ / "open-not");
    WriteBytes(folder_ / "open/takes/rig.json", "{}");
    WriteBytes(folder_ / "secret", "x");
    fs::create_symlink(folder_ / "secret", folder_ / "open/way-out");
    fs::create_symlink(folder_ / "open/takes", folder_ / "open/inside");
    fs::create_symlink(folder_ / "nothing-yet", folder_ / "open/dangling");
    policy_ = *PathPolicy::Create({folder_ / "open"});
  }

  TempFolder folder_;
  PathPolicy policy_;
};

TEST_F(PathPolicyTest, AllowsWhatLiesBelowAndResolvesLinks) {
  const std::string rig = fs::canonical(folder_ / "open/takes/rig.json").string();
  EXPECT_EQ(*policy_.CheckInput("rig", folder_ / "open/takes/rig.json"), rig);
  EXPECT_EQ(*policy_.CheckInput("rig", folder_ / "open/takes/../inside/./rig.json"), rig);
  EXPECT_TRUE(policy_.CheckInput("dump", folder_ / "open/takes").ok());
  // A link below it leads out.
  const absl::Status with_way_out = policy_.CheckInput("dump", folder_ / "open").status();
  EXPECT_EQ(with_way_out.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(with_way_out.message()), HasSubstr("way-out is a link"));
  EXPECT_TRUE(policy_.CheckOutput("out", folder_ / "open/new/deep").ok());
}

TEST_F(PathPolicyTest, RefusesWaysOutAndNamesFieldAndRemedy) {
  for (const char* path : {"secret", "open/../secret", "open/way-out", "open-not", "open/takes/../../secret",
                           "no-such-file", "open/dangling", "open/dangling/deeper"}) {
    const absl::Status status = policy_.CheckInput("spec.rig", folder_ / path).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << path << " " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("spec.rig"));
    EXPECT_THAT(std::string(status.message()), HasSubstr("--allow-path"));
    EXPECT_EQ(policy_.CheckOutput("spec.out", folder_ / path).status().code(),
              absl::StatusCode::kPermissionDenied)
        << path;
  }
}

TEST_F(PathPolicyTest, TellsMissingRelativeAndWrongKinds) {
  EXPECT_EQ(policy_.CheckInput("rig", folder_ / "open/none").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(policy_.CheckInput("rig", "open/takes").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(policy_.CheckInput("rig", "").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(policy_.CheckOutput("out", folder_ / "open/takes/rig.json").status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(PathPolicyTest, NeedsFoldersThatExist) {
  EXPECT_EQ(PathPolicy::Create({}).status().code(), absl::StatusCode::kInvalidArgument);
  const auto missing = PathPolicy::Create({folder_ / "none"});
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr(folder_ / "none"));
}

TEST_F(PathPolicyTest, TheRootAllowsEverything) {
  const PathPolicy all = *PathPolicy::Create({"/"});
  EXPECT_TRUE(all.CheckInput("rig", folder_ / "secret").ok());
}

}  // namespace
}  // namespace weft

#include "services/server/daemon/calls/path_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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

// The state folder below a folder that clients may name: takes and results in it are theirs to read.
TEST_F(PathPolicyTest, TheDaemonsOwnFolderIsClosed) {
  const std::string open = fs::canonical(folder_ / "open").string(), state = open + "/state";
  fs::remove(folder_ / "open/way-out");
  fs::remove(folder_ / "open/dangling");
  for (const char* folder : {"/takes", "/results/job", "/library"}) fs::create_directories(state + folder);
  const PathPolicy policy = *PathPolicy::Create({open}, state);
  const auto closed = [&](const std::string& path) {
    return "rig: " + path + " is in the daemon's own folder, " + state +
           ", or contains it; choose another one";
  };
  for (const std::string& path : {state + "/takes", state + "/results/job", open + "/takes"})
    EXPECT_TRUE(policy.CheckInput("rig", path).ok()) << path;
  for (const std::string& path : {state, state + "/library", open}) {
    const absl::Status status = policy.CheckInput("rig", path).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << path;
    EXPECT_EQ(status.message(), closed(path));
  }
  for (const std::string& path : {state, state + "/takes", state + "/results/new"})
    EXPECT_EQ(policy.CheckOutput("rig", path).status().message(), closed(path));
  EXPECT_EQ(policy.CheckOutput("out", open).status().message(),
            "out: " + open + " contains the daemon's own folder, " + state + "; choose another one");
  EXPECT_TRUE(policy.CheckOutput("out", open + "/statement").ok());
  // What those may read that read all.
  WriteBytes(open + "/rig.json", "{}");
  EXPECT_THAT(policy.AllowedButState(), ::testing::UnorderedElementsAre(open + "/takes", open + "/rig.json"));
  const PathPolicy elsewhere = *PathPolicy::Create({open + "/takes"}, state);
  EXPECT_THAT(elsewhere.AllowedButState(), ::testing::ElementsAre(open + "/takes"));
  const PathPolicy inside = *PathPolicy::Create({open + "/takes", state}, state);
  EXPECT_THAT(inside.AllowedButState(), ::testing::ElementsAre(open + "/takes"));
}

TEST_F(PathPolicyTest, SaysWhatIsWrongWithAPath) {
  const std::string open = fs::canonical(folder_ / "open").string();
  ASSERT_EQ(mkfifo((open + "/takes/fifo").c_str(), 0600), 0);
  const absl::Status special = policy_.CheckInput("dump", open + "/takes").status();
  EXPECT_EQ(special.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(special.message(),
            "dump: " + open +
                "/takes/fifo is a FIFO, device or socket, which is not read; remove it, or put "
                "a file in its place");
  const std::pair<absl::Status, std::string> faults[] = {
      {policy_.CheckInput("rig", "").status(),
       "rig: \"\" is not absolute; give the path from the root of the daemon's machine"},
      {policy_.CheckInput("rig", "/etc/passwd").status(),
       "rig: /etc/passwd lies outside the folders that the daemon may use (" + open +
           "); move it there, or start weftd with another --allow-path"},
      {policy_.CheckInput("rig", open + "/none").status(),
       "rig: " + open + "/none: no such file on the daemon's machine; copy it there"},
      {policy_.CheckOutput("out", open + "/takes/rig.json").status(),
       "out: " + open + "/takes/rig.json is a file; give a folder"},
      {policy_.CheckLinks("dump", open),
       "dump: " + open + "/way-out is a link that leads out of the folders that the daemon may use (" + open +
           "); put the file there instead of the link, or start weftd with another --allow-path"},
      {PathPolicy::Create({}).status(), "--allow-path: give at least one folder"},
      {PathPolicy::Create({open + "/takes/rig.json"}).status(),
       "--allow-path: " + open + "/takes/rig.json is no folder"}};
  for (const auto& [status, words] : faults) EXPECT_EQ(status.message(), words);
}

TEST_F(PathPolicyTest, TheRootAllowsEverything) {
  const PathPolicy all = *PathPolicy::Create({"/"});
  EXPECT_TRUE(all.CheckInput("rig", folder_ / "secret").ok());
}

}  // namespace
}  // namespace weft

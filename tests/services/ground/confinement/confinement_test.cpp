#include "services/ground/confinement/confinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <sstream>
#include <thread>

#include "services/formats/files/atomic_file.h"
#include "services/ground/confinement/landlock.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ConfinementTest : public ::testing::Test {
 protected:
  ConfinementTest() {
    if (LandlockVersion() == 0) return;
    for (const char* name : {"in/dump", "out", "allowed", "elsewhere"})
      fs::create_directories(folder_ / name);
    for (const char* name :
         {"in/board.json", "in/board.png", "in/dump/image", "allowed/file", "elsewhere/file"})
      WriteBytes(folder_ / name, "x");
    fs::create_symlink(folder_ / "allowed/file", folder_ / "in/dump/allowed");
    fs::create_symlink(folder_ / "elsewhere/file", folder_ / "in/dump/way_out");
  }
  void SetUp() override {
    if (LandlockVersion() < 6) GTEST_SKIP() << "this kernel has no Landlock that does all of this";
  }

  // What the program printed: errno by name. `user` as whom it runs; empty: as this one.
  std::map<std::string, int> Try(const std::string& what, const std::string& user = "") {
    const std::string command =
        std::string(CONFINED_PROGRAM) + " " + what + " '" + folder_.path() + "' " + user;
    FILE* pipe = popen(command.c_str(), "r");
    EXPECT_NE(pipe, nullptr);
    std::string text;
    for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) text += static_cast<char>(c);
    EXPECT_EQ(pclose(pipe), 0) << text;
    std::map<std::string, int> tried;
    std::istringstream lines(text);
    std::string name;
    for (int number = 0; lines >> name >> number;) tried[name] = number;
    return tried;
  }

  Confinement Inputs() {
    Confinement files;
    files.readable = {folder_ / "in/board.json", folder_ / "in/dump"};
    files.writable = {folder_ / "out"};
    return files;
  }

  TempFolder folder_;
};

TEST_F(ConfinementTest, AWorkerHasItsJobsFilesAndNothingElse) {
  std::map<std::string, int> tried = Try("worker");
  for (const char* works : {"read_input", "read_beside", "read_link_to_allowed", "write_out", "rename_in_out",
                            "remove_in_out", "null_device"}) {
    EXPECT_EQ(tried.at(works), 0) << works;
  }
  for (const char* denied : {"read_link_out", "read_passwd", "read_elsewhere", "write_input",
                             "make_elsewhere", "remove_elsewhere", "thread_reads_passwd"}) {
    EXPECT_EQ(tried.at(denied), EACCES) << denied;
  }
  for (const char* denied :
       {"truncate_input", "make_link", "change_mode", "tcp_socket", "local_socket", "socket_pair", "signal",
        "mount", "unshare", "bpf", "keyctl", "io_uring", "userfaultfd", "run_program"}) {
    EXPECT_EQ(tried.at(denied), EPERM) << denied;
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_EQ(tried.at("ptrace"), EPERM);
#endif
  EXPECT_LE(tried.at("core_limit"), 1);
  EXPECT_EQ(*ReadWholeFile(folder_ / "in/board.json"), "x");
  EXPECT_TRUE(fs::exists(folder_ / "elsewhere/file"));
}

// Its files may be root's alone.
TEST_F(ConfinementTest, AWorkerOfAnotherUserHasTheSame) {
  if (geteuid() != 0) GTEST_SKIP() << "this user cannot become another one";
  std::map<std::string, int> tried = Try("worker", "nobody");
  EXPECT_EQ(tried.at("user"), 1);
  for (const char* works : {"read_input", "write_out", "rename_in_out", "null_device"})
    EXPECT_EQ(tried.at(works), 0) << works;
  for (const char* denied : {"read_passwd", "read_elsewhere", "make_elsewhere"})
    EXPECT_EQ(tried.at(denied), EACCES) << denied;
}

TEST_F(ConfinementTest, ARecorderKeepsTheNetworkAndWritesInItsFolderAlone) {
  std::map<std::string, int> tried = Try("writing");
  for (const char* works : {"read_passwd", "write_out", "rename_in_out", "null_device", "tcp_socket",
                            "local_socket", "run_program"}) {
    EXPECT_EQ(tried[works], 0) << works;
  }
  for (const char* denied : {"write_input", "make_elsewhere", "remove_elsewhere", "make_link"})
    EXPECT_EQ(tried.at(denied), EACCES) << denied;
  for (const char* denied : {"change_mode", "mount", "bpf", "keyctl", "io_uring"})
    EXPECT_EQ(tried.at(denied), EPERM) << denied;
}

// In a thread of this process, which stays free.
absl::Status RunConfined(const Confinement& files, const std::function<void()>& work) {
  absl::Status status;
  std::thread([&] {
    status = ConfineProcess(files);
    if (status.ok()) work();
  }).join();
  return status;
}

TEST_F(ConfinementTest, ReadsItsInputsAndWritesItsFolderAlone) {
  std::string inside;
  ASSERT_TRUE(RunConfined(Inputs(), [&] {
                inside = std::string(ReadWholeFile("/etc/passwd").status().message());
                EXPECT_TRUE(ReadWholeFile(folder_ / "in/board.png").ok());
                EXPECT_TRUE(WriteFileAtomically(folder_ / "out/file", "written").ok());
                EXPECT_FALSE(WriteFileAtomically(folder_ / "elsewhere/file", "written").ok());
                EXPECT_NE(chmod((folder_ / "in/board.png").c_str(), 0666), 0);
              }).ok());
  EXPECT_THAT(inside, HasSubstr("Permission denied"));
  EXPECT_TRUE(ReadWholeFile("/etc/passwd").ok());
  EXPECT_EQ(*ReadWholeFile(folder_ / "elsewhere/file"), "x");
  EXPECT_EQ(*ReadWholeFile(folder_ / "out/file"), "written");
}

TEST_F(ConfinementTest, NamesThatWereExchangedForLinksAreErrors) {
  fs::remove(folder_ / "out");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out");
  bool ran = false;
  const absl::Status status = RunConfined(Inputs(), [&] { ran = true; });
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(folder_ / "out"));
  EXPECT_FALSE(ran);
}

TEST_F(ConfinementTest, ThisKernelConfinesAll) { EXPECT_EQ(ConfinementGaps(), ""); }

}  // namespace
}  // namespace weft

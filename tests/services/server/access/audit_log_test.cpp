// Who did what, on a disk.
#include "services/server/access/audit_log.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "services/server/access/audit_fields.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/operations.pb.h"
#include "weft/v1/sessions.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class AuditLogTest : public ::testing::Test {
 protected:
  std::unique_ptr<AuditLog> Open(int64_t largest_bytes = AuditLog::kLargestFile_bytes) {
    return AuditLog::Open(
               path_, [this](const std::string& message) { warnings_.push_back(message); }, largest_bytes)
        .value();
  }
  static v1::AuditEntry Entry(const std::string& method, const std::string& caller = "user anna") {
    v1::AuditEntry entry;
    entry.set_caller(caller);
    entry.set_peer("10.0.0.5");
    entry.set_method(method);
    entry.set_outcome("OK");
    return entry;
  }
  std::vector<v1::AuditEntry> Entries(size_t most = 1000) { return ReadAuditLog(path_, most).value(); }

  TempFolder folder_;
  std::string path_ = AuditLogFile(folder_.path());
  std::vector<std::string> warnings_;
};

TEST_F(AuditLogTest, KeepsEntriesAcrossRestartsClosedToOthers) {
  Open()->Record(Entry("Jobs.SubmitJob"));
  Open()->Record(Entry("Jobs.CancelJob"));
  const std::vector<v1::AuditEntry> entries = Entries();
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].method(), "Jobs.SubmitJob");
  EXPECT_EQ(entries[1].method(), "Jobs.CancelJob");
  EXPECT_THAT(entries[0].time(), ::testing::MatchesRegex("20..-..-..T..:..:..Z"));
  struct stat file = {};
  ASSERT_EQ(stat(path_.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600U);
}

TEST_F(AuditLogTest, GoesOnAfterALineThatACrashCut) {
  std::ofstream(path_) << R"({"method":"Jobs.Sub)";
  Open()->Record(Entry("Jobs.CancelJob"));
  ASSERT_EQ(Entries().size(), 1U);
  EXPECT_EQ(Entries()[0].method(), "Jobs.CancelJob");
}

TEST_F(AuditLogTest, FollowsNoLinkToAnotherFile) {
  std::filesystem::create_symlink(folder_ / "other", path_);
  EXPECT_FALSE(AuditLog::Open(path_, [](const std::string&) {}).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "other"));
}

TEST_F(AuditLogTest, RotatesAndReadsOn) {
  const auto log = Open(1000);
  for (int i = 0; i < 60; ++i) log->Record(Entry("M" + std::to_string(i)));
  EXPECT_LE(std::filesystem::file_size(path_), 1000U);
  EXPECT_TRUE(std::filesystem::exists(path_ + ".1"));
  EXPECT_FALSE(std::filesystem::exists(path_ + ".10"));
  const std::vector<v1::AuditEntry> last = Entries(30);
  ASSERT_EQ(last.size(), 30U);
  for (int i = 0; i < 30; ++i) EXPECT_EQ(last[i].method(), "M" + std::to_string(30 + i));
}

TEST_F(AuditLogTest, GathersAFloodOfRefusals) {
  {
    const auto log = Open();
    int told = 0;
    for (int i = 0; i < 1000; ++i) told += log->Refused(Entry("Jobs.ListJobs")) ? 1 : 0;
    EXPECT_LT(told, 20);
    EXPECT_TRUE(log->Refused(Entry("Jobs.ListJobs", "user bert")));
  }
  int times = 0;
  for (const v1::AuditEntry& entry : Entries())
    times += entry.caller() == "user anna" ? std::max(1, entry.times()) : 0;
  EXPECT_EQ(times, 1000);
}

TEST_F(AuditLogTest, TellsHowManyEntriesAFullDiskTook) {
  const auto log = Open();
  signal(SIGXFSZ, SIG_IGN);
  const auto record_on_full_disk = [&](int entries) {
    rlimit before = {};
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit full = before;
    full.rlim_cur = std::filesystem::file_size(path_);
    setrlimit(RLIMIT_FSIZE, &full);
    for (int i = 0; i < entries; ++i) EXPECT_FALSE(log->Record(Entry("lost")));
    setrlimit(RLIMIT_FSIZE, &before);
  };
  log->Record(Entry("first"));
  record_on_full_disk(3);
  EXPECT_TRUE(log->Record(Entry("second")));
  EXPECT_TRUE(log->Record(Entry("third")));
  record_on_full_disk(2);
  EXPECT_TRUE(log->Record(Entry("fourth")));
  std::vector<std::string> told;
  for (const v1::AuditEntry& entry : Entries())
    told.push_back(entry.method().empty() ? absl::StrCat(entry.outcome(), " ", entry.times())
                                          : entry.method());
  EXPECT_THAT(told, ElementsAre("first", "LOST 3", "second", "third", "LOST 2", "fourth"));
  EXPECT_EQ(warnings_.size(), 2U) << "one for each time that the disk is full";
}

TEST_F(AuditLogTest, IsWholeLinesFromManyThreads) {
  const auto log = Open();
  std::vector<std::jthread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&log, t] {
      for (int i = 0; i < 100; ++i) log->Record(Entry("T" + std::to_string(t)));
    });
  }
  threads.clear();
  EXPECT_EQ(Entries().size(), 800U);
}

TEST(AuditFields, NameWhatARequestIsAboutAndNoSecret) {
  v1::StartTakeRequest request;
  request.set_lease("a-lease-that-nobody-may-see");
  request.mutable_recording()->mutable_session()->add_cameras()->mutable_gige()->set_device("cam-7");
  request.set_idempotency_key("key-1");
  v1::AuditEntry entry;
  DescribeRequest(request, entry);
  EXPECT_EQ(entry.about().at("recording.session.cameras.0.gige.device"), "cam-7");
  EXPECT_THAT(entry.DebugString(), Not(HasSubstr("nobody-may-see")));
  v1::CaptureSession session;
  session.set_id("20261124-1");
  session.set_lease("a-lease-that-nobody-may-see");
  DescribeAnswer(session, entry);
  EXPECT_EQ(entry.about().at("id"), "20261124-1");
  EXPECT_THAT(entry.DebugString(), Not(HasSubstr("nobody-may-see")));
}

TEST(AuditFields, AreCutAndEscaped) {
  v1::StartOperationRequest request;
  request.mutable_spec()->set_command(std::string(1000, 'x'));
  for (int i = 0; i < 100; ++i) request.mutable_spec()->add_inputs()->set_value("a\x1b[2J");
  v1::AuditEntry entry;
  DescribeRequest(request, entry);
  EXPECT_EQ(entry.about().at("spec.command").size(), 200U);
  EXPECT_EQ(entry.about().at("spec.inputs.0.value"), "a\\x1b[2J");
  EXPECT_LE(entry.about_size(), 16);
}

TEST_F(AuditLogTest, LinesAreWholeEntries) {
  v1::AuditEntry entry = Entry("Jobs.SubmitJob");
  entry.set_message(std::string(501, 'm'));
  EXPECT_TRUE(Open()->Record(entry));
  const std::string line = ReadBytes(path_);
  EXPECT_THAT(line, ::testing::MatchesRegex(
                        "\\{\"time\":\"[^\"]+\",\"caller\":\"user anna\",\"peer\":\"10.0.0.5\","
                        "\"method\":\"Jobs.SubmitJob\",\"outcome\":\"OK\",\"message\":\"m+\"\\}\n"));
  EXPECT_EQ(Entries()[0].message(), std::string(500, 'm'));
}

TEST_F(AuditLogTest, RotatesWhereTheNextLineDoesNotFit) {
  Open()->Record(Entry("A"));
  const auto line_bytes = static_cast<int64_t>(std::filesystem::file_size(path_));
  {
    const auto log = Open(3 * line_bytes);
    for (const char* method : {"B", "C"}) log->Record(Entry(method));
    EXPECT_FALSE(std::filesystem::exists(path_ + ".1"));
    log->Record(Entry("D"));
    EXPECT_EQ(std::filesystem::file_size(path_ + ".1"), static_cast<uintmax_t>(3 * line_bytes));
    EXPECT_EQ(std::filesystem::file_size(path_), static_cast<uintmax_t>(line_bytes));
  }
  {
    const auto log = Open(line_bytes);
    for (int i = 0; i < 12; ++i) log->Record(Entry("E"));
  }
  EXPECT_TRUE(std::filesystem::exists(path_ + ".9"));
  EXPECT_FALSE(std::filesystem::exists(path_ + ".10"));
  EXPECT_EQ(Entries().size(), 10U);
  EXPECT_EQ(Entries(4).size(), 4U);
  EXPECT_TRUE(Entries(0).empty());
}

TEST_F(AuditLogTest, GathersRefusalsByTheirKind) {
  {
    const auto log = Open();
    v1::AuditEntry several = Entry("Jobs.ListJobs");
    several.set_times(5);
    EXPECT_TRUE(log->Refused(Entry("Jobs.ListJobs")));
    EXPECT_FALSE(log->Refused(several));
    EXPECT_FALSE(log->Refused(Entry("Jobs.ListJobs")));
    EXPECT_TRUE(log->Refused(Entry("Jobs.GetJob")));
    for (const bool of_peer : {true, false}) {
      v1::AuditEntry other = Entry("Jobs.ListJobs");
      of_peer ? other.set_peer("10.0.0.6") : other.set_outcome("ABORTED");
      EXPECT_TRUE(log->Refused(other));
    }
  }
  std::vector<int> times;
  for (const v1::AuditEntry& entry : Entries()) times.push_back(entry.times());
  EXPECT_THAT(times, ::testing::ElementsAre(0, 0, 0, 0, 6));
}

TEST_F(AuditLogTest, GathersAThousandKindsAtMost) {
  const auto log = Open();
  log->Refused(Entry("M"));
  log->Refused(Entry("M"));
  for (int i = 1; i < 1000; ++i) log->Refused(Entry("M" + std::to_string(i)));
  EXPECT_EQ(Entries(2000).size(), 1000U);
  log->Refused(Entry("one more"));
  EXPECT_EQ(Entries(2000).size(), 1002U) << "what was gathered is written";
}

TEST_F(AuditLogTest, IsNoneWhereThereIsNoFile) {
  EXPECT_TRUE(Entries().empty());
  EXPECT_EQ(AuditLogFile("/state"), "/state/audit.log");
  std::filesystem::create_directory(path_);
  EXPECT_FALSE(ReadAuditLog(path_, 10).ok());
  EXPECT_FALSE(AuditLog::Open(path_, [](const std::string&) {}).ok());
}

}  // namespace
}  // namespace weft

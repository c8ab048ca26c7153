// Programs and servers that are told of takes and jobs.
#include "services/server/notice/end_notices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/formats/files/json_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/notice/answering_server.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr char kAccepts[] = "HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

class EndNoticesTest : public ::testing::Test {
 protected:
  std::unique_ptr<EndNotices> Open(const NoticeOptions& options) {
    auto notices = EndNotices::Open(folder_ / "notices", options);
    EXPECT_TRUE(notices.ok()) << notices.status();
    return notices.ok() ? *std::move(notices) : nullptr;
  }
  // A script that `sh` runs.
  std::string Program(const std::string& script) {
    WriteBytes(folder_ / "program", "#!/bin/sh\n" + script);
    EXPECT_EQ(chmod((folder_ / "program").c_str(), 0700), 0);
    return folder_ / "program";
  }
  // Keeps what it reads in `told`.
  std::string Listener() {
    return Program(absl::StrCat("cat > '", folder_ / "half", "' && mv '", folder_ / "half", "' '",
                                folder_ / "told", "'\n"));
  }
  NoticeOptions ToProgram(const std::string& program) {
    NoticeOptions options;
    options.program = program;
    return options;
  }
  static NoticeOptions ToServer(const std::string& url) {
    NoticeOptions options;
    options.server.url = url;
    return options;
  }
  static v1::Job EndedJob(const std::string& id = "a") {
    v1::Job job;
    job.set_id(id);
    job.set_state(v1::JOB_STATE_DONE);
    job.set_finished_unix_ns(17);
    return job;
  }
  static v1::RecordedTake EndedTake(int64_t updated_unix_ns) {
    v1::RecordedTake take;
    take.set_id("t");
    take.mutable_state()->set_updated_unix_ns(updated_unix_ns);
    return take;
  }
  static std::string WrittenOut(const std::string& id, int64_t ended_unix_ns, const std::string& ended) {
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    return absl::StrCat("id: \"", id, "\"\nended_unix_ns: ", ended_unix_ns, "\nhost: \"", host,
                        "\"\nweft_version: \"" WEFT_VERSION "\"\n", ended);
  }
  static std::string TextOf(const std::string& json) {
    v1::EndNotice notice;
    EXPECT_TRUE(ParseJson(json, "notice", notice).ok()) << json;
    return notice.DebugString();
  }
  static void WaitUntil(const std::function<bool()>& reached) {
    for (int i = 0; i < 12'000; ++i) {
      if (reached()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    FAIL() << "a minute was not enough";
  }
  static std::vector<std::string> Names(EndNotices& notices) {
    std::vector<std::string> names;
    for (const Outbox::Waits& waits : notices.Waiting()) names.push_back(waits.name);
    return names;
  }

  TempFolder folder_;
};

TEST_F(EndNoticesTest, AProgramReadsTheWholeJob) {
  const auto notices = Open(ToProgram(Listener()));
  ASSERT_TRUE(notices->JobEnded(EndedJob()).ok());
  WaitUntil([&] { return std::filesystem::exists(folder_ / "told") && notices->Waiting().empty(); });
  EXPECT_EQ(
      TextOf(ReadBytes(folder_ / "told")),
      WrittenOut("17-job-a", 17, "job {\n  id: \"a\"\n  state: JOB_STATE_DONE\n  finished_unix_ns: 17\n}\n"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "notices/url"));
}

TEST_F(EndNoticesTest, AServerGetsTheWholeTake) {
  AnsweringServer server(kAccepts);
  WriteBytes(folder_ / "notices/begun", "100\n");
  const auto notices = Open(ToServer(server.Url("/hook")));
  ASSERT_TRUE(notices->TakeEnded(EndedTake(99)).ok());  // before notices were first kept
  EXPECT_THAT(Names(*notices), IsEmpty());
  ASSERT_TRUE(notices->TakeEnded(EndedTake(100)).ok());
  WaitUntil([&] { return notices->Waiting().empty(); });
  const std::vector<std::string> asked = server.Asked();
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(
      TextOf(asked[0].substr(asked[0].find("\r\n\r\n") + 4)),
      WrittenOut("100-take-t", 100, "take {\n  id: \"t\"\n  state {\n    updated_unix_ns: 100\n  }\n}\n"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "notices/command"));
}

TEST_F(EndNoticesTest, BeginWithTheirFolderAndKeepThatTime) {
  const int64_t before_ns = HostTime_ns();
  const auto begun = [this] { return ReadBytes(folder_ / "notices/begun"); };
  Open({});
  const std::string first = begun();
  EXPECT_GE(std::stoll(first), before_ns);
  EXPECT_LE(std::stoll(first), HostTime_ns());
  Open({});
  EXPECT_EQ(begun(), first);
  WriteBytes(folder_ / "notices/begun", "no number");
  Open({});
  EXPECT_GE(std::stoll(begun()), std::stoll(first));
  struct stat file = {};
  ASSERT_EQ(stat((folder_ / "notices/begun").c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600u);
}

TEST_F(EndNoticesTest, WithoutAnybodyToTellNothingIsKept) {
  const auto notices = Open({});
  ASSERT_TRUE(notices->JobEnded(EndedJob()).ok());
  EXPECT_THAT(Names(*notices), IsEmpty());
  AnsweringServer server(kAccepts);
  notices->SetOptions(ToServer(server.Url("/x")));
  ASSERT_TRUE(notices->JobEnded(EndedJob()).ok());
  WaitUntil([&] { return notices->Waiting().empty(); });
  EXPECT_EQ(server.Asked().size(), 1u);
}

TEST_F(EndNoticesTest, WhatNobodyTakesIsNamedAndGivenUp) {
  NoticeOptions options =
      ToProgram(Program(absl::StrCat("until [ -e '", folder_ / "go", "' ]; do sleep 0.01; done\n")));
  options.server.url = "http://127.0.0.1:1/x";  // nobody listens there
  const auto notices = Open(options);
  const int64_t before_ns = HostTime_ns();
  ASSERT_TRUE(notices->JobEnded(EndedJob()).ok());
  EXPECT_THAT(Names(*notices), ElementsAre("command/17-job-a.json", "url/17-job-a.json"));
  EXPECT_GE(notices->Waiting().back().since_unix_ns, before_ns);
  WaitUntil([&] { return notices->GiveUp("url/17-job-a.json").ok(); });
  EXPECT_EQ(notices->GiveUp("url/17-job-a.json").code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(Names(*notices), ElementsAre("command/17-job-a.json"));
  EXPECT_EQ(notices->GiveUp("other"), absl::NotFoundError("no notice other"));
  WriteBytes(folder_ / "go", "");
  WaitUntil([&] { return notices->Waiting().empty(); });
  EXPECT_EQ(notices->GiveUp("command/17-job-a.json").code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(EndNoticesTest, TwoProgramsRunAtOnce) {
  // Each ends when both have begun.
  const auto notices = Open(
      ToProgram(Program(absl::StrCat("cd '", folder_.path(), "' && touch begun.$$\n",
                                     "until [ $(ls -d begun.* | wc -l) -ge 2 ]; do sleep 0.01; done\n"))));
  ASSERT_TRUE(notices->JobEnded(EndedJob("a")).ok());
  ASSERT_TRUE(notices->JobEnded(EndedJob("b")).ok());
  WaitUntil([&] { return notices->Waiting().empty(); });
}

TEST_F(EndNoticesTest, AProgramThatTakesTooLongIsEnded) {
  NoticeOptions options = ToProgram(Program("exec sleep 600\n"));
  options.program_timeout_s = 0.05;
  const auto notices = Open(options);
  ::testing::internal::CaptureStdout();
  ASSERT_TRUE(notices->JobEnded(EndedJob()).ok());
  WaitUntil([&] { return notices->Waiting().empty(); });
  EXPECT_THAT(::testing::internal::GetCapturedStdout(),
              ::testing::HasSubstr("; --on-end-timeout-s gives it more"));
}

TEST_F(EndNoticesTest, OptionsNameWhatIsNoProgram) {
  const auto validate = [&](const std::string& program) { return ToProgram(program).Validate(); };
  EXPECT_TRUE(NoticeOptions().Validate().ok());
  EXPECT_TRUE(validate("/bin/true").ok());
  EXPECT_EQ(validate("true"), absl::InvalidArgumentError(
                                  "--on-end-command: true: must be an absolute path; no shell looks for it"));
  WriteBytes(folder_ / "text", "");
  for (const std::string& none : {folder_ / "text", folder_ / "missing", folder_.path()})
    EXPECT_EQ(validate(none), absl::NotFoundError(absl::StrCat("--on-end-command: ", none,
                                                               ": no program that this user may run")));
  NoticeOptions both = ToProgram("/bin/true");
  both.server.url = "http://studio.example/";
  EXPECT_TRUE(absl::IsInvalidArgument(both.Validate()));
}

}  // namespace
}  // namespace weft

// weft daemon drain, retention.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandDaemon : public ::testing::Test {
 protected:
  CommandRun Daemon(std::vector<std::string> words, bool is_quiet = false) {
    words.insert(words.begin(), "daemon");
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunCommand(AddDaemonCommand, std::move(words), is_quiet);
  }
  // Answers with this rehearsal, and keeps what was asked, as text.
  void Answer(const std::string& rehearsal) {
    daemon_.info.rehearse = [this, rehearsal](const v1::RehearseRetentionRequest& request,
                                              v1::RetentionRehearsal* answer) {
      asked_ = request.ShortDebugString();
      EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(rehearsal, answer));
      return grpc::Status::OK;
    };
  }

  AnsweringDaemon daemon_;
  std::string asked_;
};

TEST_F(CommandDaemon, DrainTellsWhatIsLeftAndThatTheDaemonHasStopped) {
  int calls = 0;
  daemon_.info.drain = [&calls](const v1::DrainRequest& request, v1::DrainProgress* progress) {
    EXPECT_TRUE(request.finish_jobs());
    if (++calls == 3) return BrokenOff();
    progress->set_frames_running(2);
    progress->set_jobs_unfinished(1);
    return grpc::Status::OK;
  };
  const CommandRun run = Daemon({"drain", "--jobs"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.err, "draining: 2 frames run, 1 jobs have not ended\n");
  EXPECT_EQ(run.out, "the daemon at " + daemon_.address() + " has stopped; its next start goes on\n");
}

TEST_F(CommandDaemon, AQuietDrainTellsTheEndAlone) {
  int calls = 0;
  daemon_.info.drain = [&calls](const v1::DrainRequest& request, v1::DrainProgress* progress) {
    EXPECT_FALSE(request.finish_jobs());
    if (++calls == 2) return BrokenOff();
    progress->set_frames_running(2);
    return grpc::Status::OK;
  };
  const CommandRun run = Daemon({"drain"}, true);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.err, "");
}

TEST_F(CommandDaemon, RulesThatRemoveNothingAreSaidInWords) {
  Answer(
      "rules { keep_trash_days: 30 least_trash_hours: 24 keep_uploads_days: 7 keep_notices_days: 14 } "
      "seen_days: 2.5");
  const CommandRun run = Daemon({"retention"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            "takes: kept at any age; no quota; no room is kept free\n"
            "trash: 30 days, and 24 hours where room is needed\n"
            "jobs: kept; operations: 30 days; uploads: 7 days; notices: 14 days\n"
            "days count while the daemon runs: it has seen 2.50\n"
            "nothing went since its start; audit.log has what went before\n");
  EXPECT_EQ(asked_, "rules { }");
}

TEST_F(CommandDaemon, WhatWentIsListedWithItsReason) {
  Answer(
      "rules { keep_takes_days: 90 takes_quota_gib: 500 least_free_gib: 20.5 keep_jobs_days: 60 } "
      "done { kind: HOLDING_KIND_TAKE id: 'walk' to_trash: true because: 'it is old' bytes: 1610612736 } "
      "done { kind: HOLDING_KIND_JOB id: 'job-1' because: 'it ended' } ");
  const std::string out = Daemon({"retention"}).out;
  EXPECT_THAT(
      out, HasSubstr("takes: 90 days, then the trash; 500 GiB with the trash at most; 20.5 GiB of the disk "
                     "stay free\n"));
  EXPECT_THAT(out, HasSubstr("jobs: 60 days after their end;"));
  EXPECT_THAT(out, ::testing::EndsWith("went since its start, newest first; audit.log has the times:\n"
                                       "  gone         take walk (1.50 GiB) goes to the trash: it is old\n"
                                       "  gone         job job-1 is removed for good: it ended\n"));
}

TEST_F(CommandDaemon, ARehearsalTellsWhatWouldGoAndWhen) {
  Answer(
      "steps { kind: HOLDING_KIND_TRASH id: 'walk' because: 'it is old' } "
      "steps { kind: HOLDING_KIND_UPLOAD id: 'u1' because: 'nobody went on with it' due_in_s: 5400 } "
      "steps { kind: HOLDING_KIND_NOTICE id: 'n1' because: 'nobody took it' due_in_s: 172799 } "
      "steps { kind: HOLDING_KIND_OPERATION id: 'o1' because: 'it ended' due_in_s: 172800 } "
      "notes: 'the quota is not kept' ");
  const CommandRun run = Daemon({"retention", "--dry-run", "--ahead-days", "7"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out,
              ::testing::EndsWith("would go, in this order:\n"
                                  "  now          take in the trash walk is removed for good: it is old\n"
                                  "  in 1.5 hours upload u1 is removed for good: nobody went on with it\n"
                                  "  in 48.0 hours notice n1 is removed for good: nobody took it\n"
                                  "  in 2.0 days  operation o1 is removed for good: it ended\n"
                                  "note: the quota is not kept\n"));
  EXPECT_EQ(asked_, "rules { } ahead_days: 7");
  Answer("");
  EXPECT_THAT(Daemon({"retention", "--dry-run"}).out, ::testing::EndsWith("nothing would go\n"));
}

TEST_F(CommandDaemon, RulesMayBeTriedOut) {
  Answer("seen_days: 3");
  const CommandRun run =
      Daemon({"retention", "--dry-run", "--keep-takes-days", "30", "--least-trash-hours", "0", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(asked_, "rules { keep_takes_days: 30 least_trash_hours: 0 }");
  v1::RetentionRehearsal rehearsal;
  ASSERT_TRUE(ParseJson(run.out, "rehearsal", rehearsal).ok()) << run.out;
  EXPECT_EQ(rehearsal.seen_days(), 3);
  EXPECT_THAT(Daemon({"retention", "--keep-takes-days", "30"}).message(), HasSubstr("requires --dry-run"));
}

}  // namespace
}  // namespace weft

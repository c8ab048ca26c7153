// weft avatar drive: what it asks for, here and at a daemon. tests/system/avatar_test.py drives whole takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CommandAvatarDrive : public ::testing::Test {
 protected:
  CommandAvatarDrive() {
    daemon_.jobs.submit = [this](const v1::SubmitJobRequest& request, v1::Job* job) {
      asked_ = request;
      job->set_id("walk-1");
      return grpc::Status::OK;
    };
    daemon_.jobs.watch = [this](const v1::WatchJobRequest&, grpc::ServerWriter<v1::JobUpdate>* out) {
      v1::JobUpdate update;
      v1::Job& job = *update.mutable_job();
      job.set_id("walk-1");
      job.set_state(v1::JOB_STATE_DONE);
      *job.mutable_spec() = asked_.spec();
      job.mutable_frames()->set_total(1);
      job.mutable_frames()->set_done(1);
      job.mutable_verdict()->set_grade(v1::GRADE_USABLE);
      job.mutable_verdict()->set_reason("two cameras are few");
      v1::LiveDriving& live = *job.mutable_driven()->mutable_live();
      live.set_frames_arrived(10);
      live.set_frames_passed_over(2);
      out->Write(update);
      return grpc::Status::OK;
    };
  }
  std::vector<std::string> Words(std::vector<std::string> more) const {
    more.insert(more.begin(), {"avatar", "drive", "/walk", "--avatar", "/a.avatar", "--rig", "/rig.json",
                               "--board", "/board.json", "--template", "/shirt", "--out", out_});
    return more;
  }
  CommandRun Drive(std::vector<std::string> more, bool is_quiet = false) const {
    return RunCommand(AddAvatarCommand, Words(std::move(more)), is_quiet);
  }
  CommandRun DriveThere(std::vector<std::string> more) const {
    more.insert(more.end(), {"--server", daemon_.address()});
    return Drive(std::move(more));
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "out";
  AnsweringDaemon daemon_;
  v1::SubmitJobRequest asked_;
};

TEST_F(CommandAvatarDrive, ADaemonIsGivenTheWholeJob) {
  const CommandRun run =
      DriveThere({"--cameras", "front,back", "--frames", "3:9", "--fps", "50", "--observations", "--mosaic",
                  "bayer_rg8", "--set", "decode.levels=2", "--priority", "3", "--detach"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "walk-1\n");
  EXPECT_EQ(asked_.priority(), 3);
  v1::RegistrationSpec spec = asked_.spec();
  EXPECT_EQ(spec.options().mosaic(), "bayer_rg8");
  EXPECT_TRUE(spec.options().write_observations());
  EXPECT_EQ(spec.options().pipeline().decode().levels(), 2);
  spec.clear_options();
  EXPECT_EQ(spec.ShortDebugString(),
            "dump: \"/walk\" rig: \"/rig.json\" board: \"/board.json\" garment: \"/shirt\" out: \"" + out_ +
                "\" frames: \"3:9\" driving { avatar: \"/a.avatar\" cameras: \"front\" cameras: \"back\" "
                "fps: 50 }");
}

TEST_F(CommandAvatarDrive, ALiveJobOfADaemonTakesEveryFrame) {
  ASSERT_TRUE(DriveThere({"--live", "--detach"}).status.ok());
  EXPECT_EQ(asked_.spec().live_every(), 1);
  ASSERT_TRUE(DriveThere({"--detach"}).status.ok());
  EXPECT_EQ(asked_.spec().live_every(), 0);
  EXPECT_FALSE(asked_.spec().options().write_observations());
  const CommandRun upload = DriveThere({"--live", "--upload"});
  EXPECT_EQ(upload.status,
            absl::InvalidArgumentError("--live: a take that grows cannot be sent with --upload"));
}

TEST_F(CommandAvatarDrive, TellsWhatBecameOfTheJob) {
  const CommandRun run = DriveThere({});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, ::testing::StartsWith("usable: two cameras are few\n"));
  EXPECT_THAT(run.out, HasSubstr("\nlive     "));
  EXPECT_THAT(run.out, ::testing::EndsWith("results  " + out_ + "\nreport   " + out_ + "/report.html\n"));
  const CommandRun json = DriveThere({"--json"});
  v1::Job job;
  ASSERT_TRUE(ParseJson(json.out, "job", job).ok()) << json.out;
  EXPECT_EQ(job.driven().live().frames_arrived(), 10);
}

TEST_F(CommandAvatarDrive, WhatIsNotThereIsNamed) {
  for (const std::vector<std::string>& how : {std::vector<std::string>{}, {"--live"}}) {
    const CommandRun run = Drive(how);
    EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound) << run.status;
  }
  EXPECT_EQ(Drive({"--set", "align.start=2"}).status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(Drive({"--detach"}).message(), HasSubstr("--detach leaves the job to a daemon"));
}

TEST_F(CommandAvatarDrive, WhatStrangersMadeIsReadWhereItCannotDoHarm) {
  unsetenv("WEFT_SERVER");
  const auto files = ConfinementOfCommand(AddAvatarCommand, Words({}));
  ASSERT_TRUE(files);
  EXPECT_THAT(files->readable, ElementsAre("/walk", "/rig.json", "/board.json", "/shirt", "/a.avatar"));
  EXPECT_THAT(files->writable, ElementsAre(out_));
  EXPECT_FALSE(ConfinementOfCommand(AddAvatarCommand, Words({"--server", "x:1"})));
  EXPECT_FALSE(ConfinementOfCommand(AddAvatarCommand, Words({"--live", "--session", "session.json"})));
}

}  // namespace
}  // namespace weft

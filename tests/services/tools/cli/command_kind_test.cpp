// Commands that are made from the description of a kind of work: that of the toy kind "copy meshes".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/services/results/export/small_result.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandKind : public ::testing::Test {
 protected:
  CommandRun Copy(std::vector<std::string> words, bool is_quiet = false) const {
    words.insert(words.begin(), {"copy-meshes", result_.request.result, "--out", result_.request.out});
    return RunCommand(AddKindCommands, std::move(words), is_quiet);
  }
  bool Exists(const std::string& path) const {
    return std::filesystem::exists(result_.request.out + "/" + path);
  }

  const SmallResult result_;
};

TEST_F(CommandKind, RunsAJobHereAndTellsWhereItsResultsAre) {
  const CommandRun run = Copy({"--every", "2", "--mirror", "--threads", "1"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const std::string& out = result_.request.out;
  EXPECT_THAT(run.out, ::testing::EndsWith("results  " + out + "\nreport   " + out + "/report.html\n"));
  EXPECT_THAT(run.err, HasSubstr("0000    done"));
  EXPECT_TRUE(Exists("0000/mesh.ply"));
  EXPECT_TRUE(Exists("0000/mirror.ply"));
  EXPECT_FALSE(Exists("0001/mesh.ply"));
  EXPECT_TRUE(Exists("0002/mesh.ply"));
  v1::Job job;
  ASSERT_TRUE(ReadJsonFile(out + "/job.json", job).ok());
  EXPECT_EQ(job.spec().work().ShortDebugString(),
            "kind: \"copy meshes\" inputs { name: \"result\" value: \"" + result_.request.result +
                "\" } options { name: \"every\" value: \"2\" } options { name: \"mirror\" }");
}

TEST_F(CommandKind, PrintsTheJob) {
  const CommandRun run = Copy({"--frames", "0001", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::Job job;
  ASSERT_TRUE(ParseJson(run.out, "job", job).ok()) << run.out;
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.frames().total(), 1);
  EXPECT_EQ(job.spec().frames(), "0001");
  const CommandRun quiet = Copy({"--frames", "0001"}, true);
  EXPECT_EQ(quiet.out.find("results"), std::string::npos);
  EXPECT_EQ(quiet.err, "");
}

TEST_F(CommandKind, WhatTheKindRefusesIsSaidBeforeTheWork) {
  const CommandRun run = Copy({"--every", "0"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), HasSubstr("every"));
  EXPECT_FALSE(Exists(""));
  EXPECT_THAT(RunCommand(AddKindCommands, {"copy-meshes", "--out", "out"}).message(),
              HasSubstr("result is required"));
  EXPECT_THAT(Copy({"--detach"}).message(), HasSubstr("--detach leaves the job to a daemon"));
}

TEST_F(CommandKind, ADaemonIsGivenTheWholeJob) {
  AnsweringDaemon daemon;
  v1::SubmitJobRequest asked;
  daemon.jobs.submit = [&asked](const v1::SubmitJobRequest& request, v1::Job* job) {
    asked = request;
    job->set_id("copy-1");
    return grpc::Status::OK;
  };
  const CommandRun run = Copy(
      {"--every", "3", "--frames", "0001:", "--priority", "5", "--server", daemon.address(), "--detach"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "copy-1\n");
  EXPECT_EQ(asked.priority(), 5);
  EXPECT_EQ(asked.spec().ShortDebugString(),
            "out: \"" + result_.request.out +
                "\" frames: \"0001:\" work { kind: \"copy meshes\" inputs { name: "
                "\"result\" value: \"" +
                result_.request.result + "\" } options { name: \"every\" value: \"3\" } }");
}

TEST_F(CommandKind, TheHelpHasExamplesOfTheKind) {
  CLI::App app("Weft", "weft");
  CommandLine line;
  AddKindCommands(app, line);
  const std::string help = app.get_subcommand("copy-meshes")->help();
  EXPECT_THAT(help,
              HasSubstr("Copies the meshes of a result, one after another. Units that are complete from an "
                        "earlier run are kept"));
  EXPECT_THAT(help, HasSubstr("  weft copy-meshes result --out result\n"
                              "  weft copy-meshes result --out result --server 127.0.0.1:7411"));
}

}  // namespace
}  // namespace weft

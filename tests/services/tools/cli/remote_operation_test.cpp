// The commands that a daemon runs, against their descriptions, which clients and forms go by.
#include "services/tools/cli/remote_operation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "services/work/spec/kind_info.h"
#include "tests/services/tools/cli/told_operations.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RemoteOperationTest : public testing::Test {
 protected:
  RemoteOperationTest() {
    AddTakeCommand(app_, line_);
    AddRigCommand(app_, line_);
    AddTemplateCommand(app_, line_);
    AddEvaluateCommand(app_, line_);
    AddExportCommand(app_, line_);
  }

  CLI::App& CommandOf(const v1::WorkKindInfo& kind) {
    CLI::App* command = &app_;
    for (const absl::string_view word : absl::StrSplit(kind.name(), ' '))
      command = command->get_subcommand(std::string(word));
    return *command;
  }

  template <typename Check>
  void ForEachOperation(const Check& check) {
    int operations = 0;
    for (const v1::WorkKindInfo* kind : AllKindInfos()) {
      if (kind->start() != v1::WORK_START_OPERATION) continue;
      ++operations;
      SCOPED_TRACE(kind->name());
      check(*kind, CommandOf(*kind));
    }
    EXPECT_EQ(operations, 9);
  }

  CLI::App app_;
  CommandLine line_;
};

TEST_F(RemoteOperationTest, EachIsACommandThatADaemonCanBeAskedFor) {
  ForEachOperation([](const v1::WorkKindInfo&, const CLI::App& command) {
    EXPECT_NE(command.get_option_no_throw("--server"), nullptr);
  });
}

// Inputs and options that the command forgets, nobody could give.
TEST_F(RemoteOperationTest, HasTheInputsAndOptionsOfItsDescription) {
  ForEachOperation([](const v1::WorkKindInfo& kind, const CLI::App& command) {
    for (const v1::WorkInputInfo& input : kind.inputs()) {
      SCOPED_TRACE(input.name());
      const CLI::Option* option = nullptr;
      for (const CLI::Option* one : command.get_options()) {
        if (input.is_positional() ? one->get_positional() : one->check_lname(input.name())) option = one;
      }
      ASSERT_NE(option, nullptr);
      EXPECT_EQ(option->get_required(), input.is_required());
      EXPECT_EQ(option->get_expected_max() > 1, input.may_repeat());
    }
    for (const v1::WorkOptionInfo& info : kind.options()) {
      SCOPED_TRACE(info.name());
      const CLI::Option* option = command.get_option_no_throw("--" + info.name());
      ASSERT_NE(option, nullptr);
      EXPECT_EQ(option->get_expected_max() == 0, info.type() == v1::OPTION_TYPE_FLAG);
    }
  });
}

class RemoteRun : public ToldOperationsTest {
 protected:
  // A command that a daemon runs, which ends as the text says.
  AloudRun Take(std::vector<std::string> words, const std::string& end) {
    operations_.answer = FromText<v1::Operation>("id: \"o1\"");
    operations_.watched = {
        FromText<v1::Operation>("id: \"o1\" state: JOB_STATE_RUNNING step: \"reads\" share_done: 0.5"),
        FromText<v1::Operation>("id: \"o1\" " + end)};
    words.insert(words.begin(), "take");
    return Run(AddTakeCommand, std::move(words));
  }
};

TEST_F(RemoteRun, PrintsWhatTheDaemonPrinted) {
  const AloudRun run =
      Take({"info", "take:t1"}, R"(state: JOB_STATE_DONE output: "of t1\n" notes: "a clock jumped")");
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "of t1\n");
  EXPECT_EQ(run.err, "weft: warning: a clock jumped\n");
  EXPECT_THAT(operations_.asked,
              ElementsAre("start command: \"take info\" inputs { name: \"take\" value: \"take:t1\" }",
                          "watch operation_id: \"o1\""));
  EXPECT_NE(operations_.keys[0], "");
  // Files of this machine are named as the daemon finds them; JSON is the daemon's, too.
  Take({"verify", folder_ / "x/../take", "--json"}, "state: JOB_STATE_DONE");
  EXPECT_EQ(operations_.asked[2], "start command: \"take verify\" inputs { name: \"take\" value: \"" +
                                      (folder_ / "take") + "\" } json: true");
  EXPECT_NE(operations_.keys[1], operations_.keys[0]);
  const CommandRun quiet =
      RunCommand(AddTakeCommand, {"take", "info", "take:t1", "--server", daemon_.address()});
  EXPECT_TRUE(quiet.status.ok()) << quiet.status;
}

TEST_F(RemoteRun, BringsFilesHere) {
  const auto run = [&](const std::string& out) {
    operations_.asked.clear();
    return Take({"export", "take:t1", "--format", "proxy", "--demosaic", "--out", out},
                R"(state: JOB_STATE_DONE output: "done\n")");
  };
  const AloudRun named = run(folder_ / "new/images");
  ASSERT_TRUE(named.status.ok()) << named.status;
  EXPECT_EQ(named.out, "done\n");
  EXPECT_THAT(
      operations_.asked,
      ElementsAre(
          "start command: \"take export\" inputs { name: \"take\" value: \"take:t1\" } options { name: "
          "\"format\" value: \"proxy\" } options { name: \"demosaic\" } out_name: "
          "\"images\"",
          "watch operation_id: \"o1\"", "files o1"));
  EXPECT_EQ(ReadBytes(folder_ / "new/images/0005/left.png"), "abc");
  // What ends in no name gets one.
  for (const char* out : {"/..", "/new/."}) run(folder_.path() + out);
  EXPECT_THAT(operations_.asked[0], HasSubstr(R"(out_name: "result")"));
}

TEST_F(RemoteRun, ATakeIsNamedAndStaysThere) {
  const std::string end = R"(state: JOB_STATE_DONE output: "trimmed\n" take_id: "t2")";
  EXPECT_EQ(Take({"trim", "take:t1", "--frames", "3:5"}, end).out, "trimmed\ntake:t2\n");
  EXPECT_EQ(operations_.asked.size(), 2u) << "no files";
  EXPECT_EQ(
      operations_.asked[0],
      "start command: \"take trim\" inputs { name: \"take\" value: \"take:t1\" } options { name: \"frames\" "
      "value: \"3:5\" }");
  EXPECT_EQ(Take({"trim", "take:t1", "--frames", "3:5", "--json"}, end).out, "trimmed\n");
}

TEST_F(RemoteRun, EndsAsTheOperationDid) {
  const auto end = [&](const std::string& text) {
    return Take({"export", "take:t1", "--out", folder_ / "x"}, text).status;
  };
  EXPECT_TRUE(IsVerdict(end("state: JOB_STATE_DONE exit_status: 1")));
  EXPECT_TRUE(end("state: JOB_STATE_DONE exit_status: 2").ok());
  operations_.asked.clear();
  EXPECT_EQ(end("state: JOB_STATE_CANCELLED"), absl::CancelledError("the operation was cancelled"));
  EXPECT_EQ(end("state: JOB_STATE_FAILED exit_status: 2 message: \"no such take\""),
            absl::InvalidArgumentError("no such take"));
  EXPECT_EQ(end("state: JOB_STATE_FAILED exit_status: 1 message: \"a crash\""),
            absl::InternalError("a crash"));
  EXPECT_THAT(operations_.asked, testing::Not(testing::Contains("files o1"))) << "of one that failed";
}

TEST_F(RemoteRun, WhatADaemonDoesNotTakeIsNamed) {
  const AloudRun run = Run(AddTemplateCommand, {"template", "build", "take:t1", "--board", "library:b",
                                                "--out", folder_ / "shirt", "--force"});
  EXPECT_EQ(run.status,
            absl::InvalidArgumentError("--force: a daemon does not take it; leave it out, or run the "
                                       "command without --server"));
  EXPECT_TRUE(operations_.asked.empty());
  operations_.watched = {FromText<v1::Operation>("id: \"o1\" state: JOB_STATE_DONE")};
  const AloudRun threads =
      Run(AddRigCommand, {"rig", "plan", "--rig", "library:r", "--template", "library:t", "--cameras", "9",
                          "--threads", "2", "--out", folder_ / "plan"});
  EXPECT_TRUE(threads.status.ok()) << threads.status;
  EXPECT_EQ(
      operations_.asked[0],
      "start command: \"rig plan\" inputs { name: \"rig\" value: \"library:r\" } inputs { name: \"template\" "
      "value: \"library:t\" } options { name: \"cameras\" value: \"9\" } out_name: \"plan\"");
}

TEST_F(RemoteRun, AnEmptyServerIsThisMachine) {
  setenv("WEFT_SERVER", daemon_.address().c_str(), 1);
  const AloudRun here = RunAloud(AddTakeCommand, {"take", "info", folder_ / "none", "--server", ""});
  EXPECT_EQ(here.status.code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(operations_.asked.empty());
  operations_.watched = {FromText<v1::Operation>("id: \"o1\" state: JOB_STATE_DONE output: \"there\\n\"")};
  EXPECT_EQ(RunAloud(AddTakeCommand, {"take", "info", "take:t1"}).out, "there\n");
  unsetenv("WEFT_SERVER");
}

}  // namespace
}  // namespace weft

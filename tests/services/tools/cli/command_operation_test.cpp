// weft operation: what is asked of a daemon, and what it answers in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/tools/cli/commands.h"
#include "tests/services/tools/cli/told_operations.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CommandOperation : public ToldOperationsTest {
 protected:
  AloudRun Operation(std::vector<std::string> words) const {
    words.insert(words.begin(), "operation");
    return Run(AddOperationCommand, std::move(words));
  }
};

TEST_F(CommandOperation, ListsWhatEachDoesAndHowFarItIs) {
  operations_.list = FromText<v1::ListOperationsResponse>(R"(
    warnings: "o9 cannot be read"
    operations { id: "o3" state: JOB_STATE_RUNNING spec { command: "export" } about: "job:1" step: "meshes" share_done: 0.426 }
    operations { id: "o2" state: JOB_STATE_FAILED spec { command: "take verify" } step: "reads" message: "no such take" }
    operations { id: "o1" state: JOB_STATE_RUNNING spec { command: "rig plan" } })");
  const AloudRun run = Operation({"list", "--limit", "5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            "o3  running    weft export job:1  (meshes, 43 %)\n"
            "o2  failed     weft take verify  (no such take)\n"
            "o1  running    weft rig plan\n");
  EXPECT_EQ(run.err, "weft: warning: o9 cannot be read\n");
  const AloudRun json = Operation({"list", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::ListOperationsResponse>(json.out)), TextOf(operations_.list));
  EXPECT_EQ(json.err, "");
  operations_.list.Clear();
  EXPECT_EQ(Operation({"list"}).out, "no operations at " + daemon_.address() + "\n");
  EXPECT_THAT(operations_.asked, ElementsAre("list limit: 5", "list limit: 20", "list limit: 20"));
}

TEST_F(CommandOperation, CancelAndDeleteNameTheOperation) {
  operations_.answer =
      FromText<v1::Operation>("id: \"o1\" state: JOB_STATE_CANCELLED spec { command: \"export\" }");
  EXPECT_EQ(Operation({"cancel", "o1"}).out, "o1  cancelled  weft export\n");
  EXPECT_EQ(Operation({"delete", "o1"}).out, "operation o1 is deleted\n");
  for (const char* call : {"cancel", "delete"})
    EXPECT_EQ(TextOf(FromJson<v1::Operation>(Operation({call, "o1", "--json"}).out)),
              TextOf(operations_.answer));
  EXPECT_THAT(operations_.asked, ElementsAre("cancel operation_id: \"o1\"", "delete operation_id: \"o1\"",
                                             "cancel operation_id: \"o1\"", "delete operation_id: \"o1\""));
}

TEST_F(CommandOperation, HelpNamesAllThatADaemonRuns) {
  CLI::App app;
  CommandLine line;
  AddOperationCommand(app, line);
  EXPECT_THAT(
      app.get_subcommand("operation")->get_description(),
      HasSubstr("by their option --server: rig calibrate, rig plan, template build, evaluate, export, take "
                "verify, take info, take trim, take export."));
}

}  // namespace
}  // namespace weft

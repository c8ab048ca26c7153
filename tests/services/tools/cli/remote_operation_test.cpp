// The commands that a daemon runs, against their descriptions, which clients and forms go by.
#include "services/tools/cli/remote_operation.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "services/tools/cli/commands.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

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

}  // namespace
}  // namespace weft

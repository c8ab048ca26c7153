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

// What the command says of a value; empty: it takes it.
std::string Refusal(CLI::Option& option, const std::string& value) {
  std::string copy = value;
  return option.get_validator(0)->operator()(copy);
}

TEST_F(RemoteOperationTest, EachIsACommandThatADaemonCanBeAskedFor) {
  ForEachOperation([](const v1::WorkKindInfo&, const CLI::App& command) {
    EXPECT_NE(command.get_option_no_throw("--server"), nullptr);
  });
}

TEST_F(RemoteOperationTest, HasTheInputsOfItsCommand) {
  ForEachOperation([](const v1::WorkKindInfo& kind, const CLI::App& command) {
    for (const v1::WorkInputInfo& input : kind.inputs()) {
      SCOPED_TRACE(input.name());
      const CLI::Option* option = nullptr;
      for (const CLI::Option* one : command.get_options()) {
        const bool is_it = input.is_positional()
                               ? one->get_positional()
                               : !one->get_lnames().empty() && one->get_lnames().front() == input.name();
        if (is_it) option = one;
      }
      ASSERT_NE(option, nullptr);
      EXPECT_EQ(option->get_required(), input.is_required());
      EXPECT_EQ(option->get_expected_max() > 1, input.may_repeat());
    }
  });
}

TEST_F(RemoteOperationTest, HasTheOptionsOfItsCommandWithTheirTypesAndChoices) {
  ForEachOperation([](const v1::WorkKindInfo& kind, CLI::App& command) {
    for (const v1::WorkOptionInfo& info : kind.options()) {
      SCOPED_TRACE(info.name());
      CLI::Option* option = command.get_option_no_throw("--" + info.name());
      ASSERT_NE(option, nullptr);
      EXPECT_EQ(option->get_expected_max() == 0, info.type() == v1::OPTION_TYPE_FLAG);
      EXPECT_TRUE(!info.is_required() || option->get_required());
      for (const std::string& choice : info.choices()) EXPECT_EQ(Refusal(*option, choice), "") << choice;
      EXPECT_TRUE(info.choices().empty() || !Refusal(*option, "no such choice").empty());
      if (info.least() != 0 || info.most() != 0) {
        const auto text = [&](double value) {
          return info.type() == v1::OPTION_TYPE_INTEGER ? std::to_string(static_cast<int>(value))
                                                        : std::to_string(value);
        };
        EXPECT_EQ(Refusal(*option, text(info.least())), "");
        EXPECT_EQ(Refusal(*option, text(info.most())), "");
        EXPECT_NE(Refusal(*option, text(info.least() - 1)), "");
        EXPECT_NE(Refusal(*option, text(info.most() + 1)), "");
      }
    }
  });
}

}  // namespace
}  // namespace weft

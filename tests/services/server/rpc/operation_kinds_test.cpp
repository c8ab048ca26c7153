#include "services/server/rpc/operation_kinds.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace weft {
namespace {

TEST(OperationKinds, AreFoundByTheirWholeName) {
  const OperationKind* trim = FindOperationKind("take trim");
  ASSERT_NE(trim, nullptr);
  EXPECT_EQ(trim->out, OperationOut::kTake);
  EXPECT_EQ(FindOperationKind("take"), nullptr);
  EXPECT_EQ(FindOperationKind("take trim "), nullptr);
  EXPECT_EQ(FindOperationKind(""), nullptr);
}

// Their arguments come from clients, so nothing of a kind may be ambiguous.
TEST(OperationKinds, HaveNoNameTwice) {
  std::set<std::string> commands;
  for (const OperationKind& kind : OperationKinds()) {
    EXPECT_TRUE(commands.insert(kind.command).second) << kind.command;
    std::set<std::string> names;
    for (const OperationInputKind& input : kind.inputs)
      EXPECT_TRUE(names.insert(input.name).second) << kind.command << " " << input.name;
    for (const char* option : kind.options)
      EXPECT_TRUE(names.insert(option).second) << kind.command << " " << option;
  }
}

TEST(OperationKinds, HaveOnePositionalInputAtTheMostWhichComesFirst) {
  for (const OperationKind& kind : OperationKinds()) {
    for (size_t i = 0; i < kind.inputs.size(); ++i) {
      const OperationInputKind& input = kind.inputs[i];
      EXPECT_TRUE(i == 0 || !input.is_positional) << kind.command;
      EXPECT_TRUE(input.is_positional || !input.may_repeat) << kind.command;
    }
  }
}

}  // namespace
}  // namespace weft

#include "services/server/daemon/work/operation_command.h"

#include <gmock/gmock.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

v1::OperationSpec Spec(const std::string& command) {
  v1::OperationSpec spec;
  spec.set_command(command);
  return spec;
}

v1::OperationSpec WithInput(v1::OperationSpec spec, const std::string& name, const std::string& value) {
  v1::OperationInput& input = *spec.add_inputs();
  input.set_name(name);
  input.set_value(value);
  return spec;
}

v1::OperationSpec WithOption(v1::OperationSpec spec, const std::string& name, const std::string& value) {
  v1::OperationOption& option = *spec.add_options();
  option.set_name(name);
  option.set_value(value);
  return spec;
}

v1::OperationSpec WithOut(v1::OperationSpec spec, const std::string& name) {
  spec.set_out_name(name);
  return spec;
}

absl::StatusOr<std::string> Allowed(const std::string& field, v1::ItemKind, const std::string& value) {
  if (value == "/secret") return absl::PermissionDeniedError(field + ": outside");
  return "/data/" + value;
}

TEST(OperationCommand, IsTheCommandLineWithResolvedInputs) {
  v1::OperationSpec spec =
      WithInput(WithInput(Spec("rig calibrate"), "dump", "boards"), "target", "target.json");
  spec = WithOut(WithOption(WithOption(spec, "min-views", "3"), "world-floor", ""), "rig.json");
  spec.set_json(true);
  ASSERT_TRUE(CheckOperationSpec(spec).ok()) << CheckOperationSpec(spec);
  EXPECT_THAT(CommandOf(spec, Allowed)->arguments,
              ElementsAre("rig", "calibrate", "--min-views=3", "--world-floor", "--target=/data/target.json",
                          "--out=rig.json", "--json", "--", "/data/boards"));
  EXPECT_THAT(CommandOf(spec, Allowed)->inputs, UnorderedElementsAre("/data/boards", "/data/target.json"));
  const v1::OperationSpec trim = WithInput(Spec("take trim"), "take", "take:1");
  EXPECT_THAT(CommandOf(trim, Allowed)->inputs, ElementsAre("/data/take:1"));
  EXPECT_THAT(CommandOf(trim, Allowed)->arguments,
              ElementsAre("take", "trim", "--out=take", "--", "/data/take:1"));
}

TEST(OperationCommand, InputsThatMayNotBeReadAreRefused) {
  const absl::Status status = CommandOf(WithInput(Spec("take verify"), "take", "/secret"), Allowed).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(status.message()), HasSubstr("spec.inputs.take"));
}

TEST(OperationCommand, RefusesWhatIsNoneOfItsOwn) {
  const v1::OperationSpec verify = WithInput(Spec("take verify"), "take", "a");
  const v1::OperationSpec exported = WithInput(Spec("take export"), "take", "a");
  const std::pair<v1::OperationSpec, const char*> bad[] = {
      {Spec(""), "spec.command"},
      {Spec("take record"), "is none that a daemon runs"},
      {Spec("take verify"), "take is missing"},
      {WithInput(verify, "take", "b"), "take is given 2 times"},
      {WithInput(verify, "board", "b"), "is no input of take verify"},
      {WithInput(Spec("take verify"), "take", ""), "take is empty"},
      {WithInput(Spec("take verify"), "take", "a\nb"), "control character"},
      {WithOption(verify, "out", "/etc"), "is no option of take verify"},
      {WithOption(WithOut(exported, "x"), "config", "/etc/passwd"), "is no option of take export"},
      {WithOption(WithOut(exported, "x"), "format", std::string(5000, 'x')), "spec.options"},
      {WithOut(verify, "x"), "spec.out_name: is given"},
      {exported, "spec.out_name: is missing"},
      {WithOut(exported, "../x"), "spec.out_name"},
      {WithOut(exported, "--json"), "begins with a dash"}};
  for (const auto& [spec, words] : bad) {
    const absl::Status status = CheckOperationSpec(spec);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << spec.ShortDebugString();
    EXPECT_THAT(std::string(status.message()), HasSubstr(words));
  }
}

}  // namespace
}  // namespace weft

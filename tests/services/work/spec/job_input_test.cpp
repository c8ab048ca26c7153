#include "services/work/spec/job_input.h"

#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/work/pipeline/job_confinement.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

v1::RegistrationSpec SpecWithAll() {
  v1::RegistrationSpec spec;
  spec.set_dump("/takes/t1");
  spec.set_rig("/inputs/rig.json");
  spec.set_board("/inputs/board.json");
  spec.set_garment("/inputs/shirt");
  spec.mutable_driving()->set_avatar("/inputs/shirt.avatar");
  spec.mutable_options()->set_scans("/scans");
  spec.mutable_options()->set_starts("/starts");
  return spec;
}

TEST(InputsOf, FindsEachPathThatTheSpecNames) {
  std::vector<std::string> paths;
  for (const JobInput& input : InputsOf(SpecWithAll())) paths.push_back(input.path);
  EXPECT_THAT(paths, UnorderedElementsAre("/takes/t1", "/inputs/rig.json", "/inputs/board.json",
                                          "/inputs/shirt", "/inputs/shirt.avatar", "/scans", "/starts"));
  EXPECT_EQ(paths.back(), "/takes/t1");
  v1::RegistrationSpec without = SpecWithAll();
  without.clear_driving();
  EXPECT_EQ(InputsOf(without).size(), paths.size() - 1);
  without.mutable_driving();
  EXPECT_THAT(std::string(CheckInputsGiven(without).message()), HasSubstr("spec.driving.avatar is empty"));
}

TEST(InputsOf, LeavesTheSpecAsItIs) {
  const v1::RegistrationSpec empty;
  for (const JobInput& input : InputsOf(empty)) EXPECT_EQ(input.path, "");
  EXPECT_EQ(empty.ByteSizeLong(), 0u);
}

// A field with a path that is added to the schema belongs into the list, or is named here with its reason.
TEST(InputsOf, HasEveryTextFieldThatIsAPath) {
  const std::set<std::string> no_inputs = {"out", "frames", "preset", "mosaic", "cloud_format", "set"};
  std::set<std::string> listed;
  for (const JobInput& input : InputsOf(SpecWithAll())) listed.insert(input.field);
  const auto look = [&](const google::protobuf::Descriptor* message, const std::string& prefix) {
    for (int i = 0; i < message->field_count(); ++i) {
      const google::protobuf::FieldDescriptor* field = message->field(i);
      if (field->cpp_type() != field->CPPTYPE_STRING || field->is_repeated()) continue;
      if (no_inputs.contains(field->name())) continue;
      EXPECT_TRUE(listed.contains(prefix + field->name())) << prefix + field->name();
    }
  };
  look(v1::RegistrationSpec::descriptor(), "spec.");
  look(v1::RegistrationOptions::descriptor(), "spec.options.");
  look(v1::DrivingSpec::descriptor(), "spec.driving.");
}

TEST(SetInput, ReplacesOnePath) {
  v1::RegistrationSpec spec = SpecWithAll();
  for (const JobInput& input : InputsOf(spec)) SetInput(input, "/there" + input.path, &spec);
  for (const JobInput& input : InputsOf(spec)) EXPECT_EQ(input.path.rfind("/there/", 0), 0u) << input.field;
  EXPECT_EQ(spec.driving().avatar(), "/there/inputs/shirt.avatar");
}

TEST(CheckInputsGiven, NamesTheFieldThatIsEmpty) {
  EXPECT_TRUE(CheckInputsGiven(SpecWithAll()).ok());
  for (const JobInput& input : InputsOf(SpecWithAll())) {
    v1::RegistrationSpec spec = SpecWithAll();
    SetInput(input, "", &spec);
    const absl::Status status = CheckInputsGiven(spec);
    EXPECT_EQ(status.ok(), !input.is_required) << input.field;
    if (!status.ok()) {
      EXPECT_THAT(std::string(status.message()), HasSubstr(input.field + " is empty"));
    }
    SetInput(input, std::string("/a\0b", 4), &spec);
    EXPECT_THAT(std::string(CheckInputsGiven(spec).message()), HasSubstr(input.field + " holds a zero byte"));
  }
}

TEST(IsReadFrom, HoldsForEachInputAndWhatLiesBelow) {
  const v1::RegistrationSpec spec = SpecWithAll();
  for (const JobInput& input : InputsOf(spec)) EXPECT_TRUE(IsReadFrom(spec, input.path)) << input.field;
  EXPECT_TRUE(IsReadFrom(spec, "/takes"));
  EXPECT_FALSE(IsReadFrom(spec, "/takes/t"));
  EXPECT_FALSE(IsReadFrom(spec, "/takes/t1/0001"));
}

TEST(ConfinementOf, MayReadAllInputs) {
  const Confinement confinement = ConfinementOf(SpecWithAll(), {});
  EXPECT_EQ(confinement.readable.size(), InputsOf(SpecWithAll()).size());
}

v1::RegistrationSpec OfWork(const std::string& kind,
                            const std::vector<std::pair<std::string, std::string>>& given) {
  v1::RegistrationSpec spec;
  spec.mutable_work()->set_kind(kind);
  for (const auto& [name, value] : given) {
    v1::NamedValue& input = *spec.mutable_work()->add_inputs();
    input.set_name(name);
    input.set_value(value);
  }
  return spec;
}

TEST(InputsOf, HasEachThatIsGivenToWork) {
  const v1::RegistrationSpec spec =
      OfWork("template build",
             {{"sources", "/one"}, {"board", "/board.json"}, {"other", "/x"}, {"sources", "/two"}});
  const std::vector<JobInput> inputs = InputsOf(spec);
  ASSERT_EQ(inputs.size(), 3u);
  const char* const fields[] = {"spec.work.inputs.sources", "spec.work.inputs.sources",
                                "spec.work.inputs.board"};
  const char* const paths[] = {"/one", "/two", "/board.json"};
  const int places[] = {0, 3, 1};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(inputs[i].field, fields[i]);
    EXPECT_EQ(inputs[i].path, paths[i]);
    EXPECT_EQ(inputs[i].of_work, places[i]);
    EXPECT_TRUE(inputs[i].is_required);
  }
  EXPECT_EQ(inputs[0].what, "Recordings of the garment, or clouds of frames");
  EXPECT_EQ(inputs[0].kind, v1::ITEM_KIND_DUMP);
  EXPECT_EQ(inputs[2].kind, v1::ITEM_KIND_BOARD);
  EXPECT_TRUE(CheckInputsGiven(spec).ok());
}

TEST(InputsOf, HasRequiredOnesOfWorkThatAreMissing) {
  const v1::RegistrationSpec spec = OfWork("template build", {{"sources", "/one"}});
  const std::vector<JobInput> inputs = InputsOf(spec);
  ASSERT_EQ(inputs.size(), 2u);
  EXPECT_EQ(inputs[1].field, "spec.work.inputs.board");
  EXPECT_EQ(inputs[1].path, "");
  EXPECT_EQ(inputs[1].of_work, -1);
  EXPECT_EQ(CheckInputsGiven(spec),
            absl::InvalidArgumentError("the field spec.work.inputs.board is empty: name Board of the cloth"));
}

TEST(InputsOf, HasNoneOfAKindThatThereIsNot) {
  EXPECT_TRUE(InputsOf(OfWork("weave", {{"yarn", "/yarn"}})).empty());
  EXPECT_TRUE(CheckInputsGiven(OfWork("weave", {})).ok());
}

TEST(SetInput, ReplacesTheOneOfWork) {
  v1::RegistrationSpec spec =
      OfWork("template build", {{"board", "/b"}, {"sources", "/one"}, {"sources", "/two"}});
  const std::vector<JobInput> inputs = InputsOf(spec);
  ASSERT_EQ(inputs.size(), 3u);
  SetInput(inputs[1], "/three", &spec);
  SetInput(inputs[2], "/c", &spec);
  EXPECT_EQ(spec.work().inputs(0).value(), "/c");
  EXPECT_EQ(spec.work().inputs(1).value(), "/one");
  EXPECT_EQ(spec.work().inputs(2).value(), "/three");
}

TEST(CheckInputsGiven, SaysWhatToName) {
  v1::RegistrationSpec spec = SpecWithAll();
  spec.clear_garment();
  EXPECT_EQ(CheckInputsGiven(spec),
            absl::InvalidArgumentError("the field spec.garment is empty: name the template"));
  spec.clear_rig();
  EXPECT_EQ(CheckInputsGiven(spec), absl::InvalidArgumentError("the field spec.rig is empty: name the rig"));
  spec = SpecWithAll();
  spec.mutable_options()->set_scans(std::string("/a\0b", 4));
  EXPECT_EQ(CheckInputsGiven(spec),
            absl::InvalidArgumentError("the field spec.options.scans holds a zero byte"));
}

TEST(IsReadFrom, LooksAtTheInputsOfWork) {
  const v1::RegistrationSpec spec = OfWork("template build", {{"sources", "/takes/one"}});
  EXPECT_TRUE(IsReadFrom(spec, "/takes"));
  EXPECT_TRUE(IsReadFrom(spec, "/takes/one"));
  EXPECT_FALSE(IsReadFrom(spec, "/takes/on"));
}

}  // namespace
}  // namespace weft

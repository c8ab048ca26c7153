#include "services/work/spec/kind_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <string>
#include <vector>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

void Add(v1::NamedValue* added, const std::string& name, const std::string& value) {
  added->set_name(name);
  added->set_value(value);
}

v1::WorkSpec Calibrating() {
  v1::WorkSpec work;
  work.set_kind("rig calibrate");
  Add(work.add_inputs(), "dump", "take:20260131-104500-1a2b3c4d");
  Add(work.add_inputs(), "target", "/inputs/target.json");
  Add(work.add_options(), "every", "4");
  return work;
}

SpecFault FaultOf(const v1::WorkSpec& work) {
  return FaultOfWork(*FindKindInfo(work.kind()), work, "spec.work").value_or(SpecFault{});
}

TEST(KindInfos, AreFoundByTheirWholeName) {
  const v1::WorkKindInfo* trim = FindKindInfo("take trim");
  ASSERT_NE(trim, nullptr);
  EXPECT_EQ(trim->out(), v1::WORK_OUT_TAKE);
  EXPECT_EQ(trim->start(), v1::WORK_START_OPERATION);
  for (const char* name : {"take", "take trim ", ""}) EXPECT_EQ(FindKindInfo(name), nullptr) << name;
}

// Their arguments come from clients, so nothing of a kind may be ambiguous.
TEST(KindInfos, HaveNoNameTwice) {
  std::set<std::string> kinds;
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    EXPECT_TRUE(kinds.insert(kind->name()).second) << kind->name();
    std::set<std::string> names;
    for (const v1::WorkInputInfo& input : kind->inputs())
      EXPECT_TRUE(names.insert(input.name()).second) << kind->name() << " " << input.name();
    for (const v1::WorkOptionInfo& option : kind->options())
      EXPECT_TRUE(names.insert(option.name()).second) << kind->name() << " " << option.name();
  }
}

TEST(KindInfos, SayAllThatFormsShow) {
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    EXPECT_FALSE(kind->title().empty() || kind->verb().empty() || kind->about().empty()) << kind->name();
    EXPECT_NE(kind->start(), v1::WORK_START_UNSPECIFIED) << kind->name();
    EXPECT_NE(kind->out(), v1::WORK_OUT_UNSPECIFIED) << kind->name();
    EXPECT_TRUE(kind->start() != v1::WORK_START_OPERATION || kind->out() != v1::WORK_OUT_NAMED ||
                !kind->out_name().empty())
        << kind->name();
    for (const v1::WorkInputInfo& input : kind->inputs()) EXPECT_FALSE(input.label().empty()) << input.name();
    for (const v1::WorkOptionInfo& option : kind->options()) {
      EXPECT_FALSE(option.label().empty()) << kind->name() << " " << option.name();
      EXPECT_NE(option.type(), v1::OPTION_TYPE_UNSPECIFIED) << kind->name() << " " << option.name();
      EXPECT_TRUE(option.choices().empty() || option.type() == v1::OPTION_TYPE_TEXT) << option.name();
      EXPECT_LE(option.least(), option.most()) << option.name();
    }
  }
}

TEST(KindInfos, HaveOnePositionalInputAtTheMost) {
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    int positional = 0;
    for (const v1::WorkInputInfo& input : kind->inputs()) {
      positional += input.is_positional() ? 1 : 0;
      EXPECT_TRUE(input.is_positional() || !input.may_repeat()) << kind->name();
    }
    EXPECT_LE(positional, 1) << kind->name();
  }
}

TEST(FaultOfWork, FindsNoneInARightRequest) {
  EXPECT_FALSE(FaultOfWork(*FindKindInfo("rig calibrate"), Calibrating(), "spec.work"));
}

TEST(FaultOfWork, NamesInputsThatAreWrong) {
  v1::WorkSpec work = Calibrating();
  work.mutable_inputs()->RemoveLast();
  EXPECT_EQ(FaultOf(work).field, "spec.work.inputs");
  EXPECT_EQ(FaultOf(work).why, "target is missing");
  work = Calibrating();
  Add(work.add_inputs(), "target", "/another.json");
  EXPECT_EQ(FaultOf(work).why, "target is given 2 times");
  work = Calibrating();
  Add(work.add_inputs(), "board", "/board.json");
  EXPECT_EQ(FaultOf(work).why, "\"board\" is no input of rig calibrate");
  EXPECT_EQ(FaultOf(work).remedy, "it has dump, target, rig");
  work = Calibrating();
  Add(work.add_inputs(), "rig", "");
  EXPECT_EQ(FaultOf(work).why, "rig is empty");
  for (const std::string& path : {std::string("/a\0b", 4), std::string("/a\nb")}) {
    work.mutable_inputs(2)->set_value(path);
    EXPECT_EQ(FaultOf(work).why, "rig holds a control character");
  }
  work.mutable_inputs(2)->set_value(std::string(4097, 'a'));
  EXPECT_EQ(FaultOf(work).why, "rig has 4097 bytes");
  work = Calibrating();
  for (int i = 0; i < 1000; ++i) Add(work.add_inputs(), "dump", "/d");
  EXPECT_EQ(FaultOf(work).why, "are too many");
}

TEST(FaultOfWork, TakesTheSameInputAgainWhereTheKindDoes) {
  v1::WorkSpec work;
  work.set_kind("template build");
  Add(work.add_inputs(), "sources", "/one");
  Add(work.add_inputs(), "sources", "/two");
  Add(work.add_inputs(), "board", "/board.json");
  EXPECT_EQ(FaultOf(work).why, "");
}

TEST(FaultOfWork, NamesOptionsThatAreWrong) {
  const auto why_of = [](const std::string& name, const std::string& value) {
    v1::WorkSpec work = Calibrating();
    work.clear_options();
    Add(work.add_options(), name, value);
    const SpecFault fault = FaultOf(work);
    EXPECT_EQ(fault.field, fault.why.empty() ? "" : "spec.work.options");
    return fault.why + "; " + fault.remedy;
  };
  for (const char* good : {"1", "10000"}) EXPECT_EQ(why_of("every", good), "; ") << good;
  for (const char* bad : {"0", "10001", "-1", "1.5", "one", "", "1e3"}) {
    EXPECT_EQ(why_of("every", bad),
              std::string("every is \"") + bad + "\"; give a whole number from 1 to 10000");
  }
  for (const char* good : {"0.3", "4", "2.2"}) EXPECT_EQ(why_of("gamma", good), "; ") << good;
  for (const char* bad : {"0.29", "4.01", "nan", "inf", "x"})
    EXPECT_THAT(why_of("gamma", bad), HasSubstr("give a number from 0.3 to 4")) << bad;
  EXPECT_EQ(why_of("max-rms-px", "1e9"), "; ");
  for (const char* bad : {"0", "-3", "inf"})
    EXPECT_THAT(why_of("max-rms-px", bad), HasSubstr("; give a number above 0")) << bad;
  EXPECT_EQ(why_of("world-floor", ""), "; ");
  EXPECT_THAT(why_of("world-floor", "yes"), HasSubstr("without a value"));
  EXPECT_EQ(why_of("scale", "bar"), "; ");
  EXPECT_EQ(why_of("scale", "bars"), "scale is \"bars\"; give one of tags, bar");
  EXPECT_THAT(why_of("threads", "4"), HasSubstr("\"threads\" is no option of rig calibrate"));
  EXPECT_THAT(why_of("id", "a\nb"), HasSubstr("id holds a control character"));
}

TEST(FaultOfWork, AsksForRequiredOptions) {
  v1::WorkSpec work;
  work.set_kind("export");
  Add(work.add_inputs(), "result", "job:1");
  EXPECT_EQ(FaultOf(work).why, "format is missing");
  Add(work.add_options(), "format", "glb");
  EXPECT_EQ(FaultOf(work).why, "");
}

TEST(UnknownKind, NamesThoseThatThereAre) {
  const SpecFault fault = UnknownKind("rig\x01", v1::WORK_START_OPERATION, "spec.command");
  EXPECT_EQ(fault.field, "spec.command");
  EXPECT_EQ(fault.why, "\"rig\\x01\" is none that a daemon runs");
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    EXPECT_EQ(fault.remedy.find(kind->name()) != std::string::npos, kind->start() == v1::WORK_START_OPERATION)
        << kind->name();
  }
}

TEST(KindNameOf, IsThatOfTheFieldsThatAreGiven) {
  v1::RegistrationSpec spec;
  EXPECT_EQ(KindNameOf(spec), kRegisterKind);
  spec.mutable_driving();
  EXPECT_EQ(KindNameOf(spec), kDriveKind);
  spec.mutable_work()->set_kind("copy meshes");
  EXPECT_EQ(KindNameOf(spec), "copy meshes");
}

// As the daemon answers it.
std::string SaidOf(const v1::WorkSpec& work) {
  const SpecFault fault = FaultOf(work);
  return fault.field + " | " + fault.why + " | " + fault.remedy;
}

TEST(FaultOfWork, SaysWhatToDoAboutInputs) {
  v1::WorkSpec work = Calibrating();
  work.mutable_inputs()->RemoveLast();
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | target is missing | rig calibrate needs it");
  work = Calibrating();
  for (int i = 0; i < 2; ++i) Add(work.add_inputs(), "rig", "/rig.json");
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | rig is given 2 times | give it once");
  work.mutable_inputs(3)->set_value("");
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | rig is empty | ");
  work.mutable_inputs(3)->set_value("/a\tb");
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | rig holds a control character | remove it");
  work.mutable_inputs(3)->set_value(std::string(4097, 'a'));
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | rig has 4097 bytes | at most 4096 are allowed");
  work = Calibrating();
  Add(work.add_inputs(), "b\n", "/b");
  EXPECT_EQ(SaidOf(work),
            "spec.work.inputs | \"b\\x0a\" is no input of rig calibrate | it has dump, target, rig");
  work = Calibrating();
  for (int i = 0; i < 999; ++i) Add(work.add_inputs(), "dump", "/d");
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | are too many | give at most 1000");
}

TEST(FaultOfWork, TakesWhatIsJustAllowed) {
  v1::WorkSpec work = Calibrating();
  Add(work.add_inputs(), "rig", std::string(4096, 'a'));
  EXPECT_EQ(SaidOf(work), " |  | ");
  work = v1::WorkSpec();
  work.set_kind("template build");
  Add(work.add_inputs(), "board", "/board.json");
  for (int i = 1; i < 1000; ++i) Add(work.add_inputs(), "sources", "/one");
  for (int i = 0; i < 100; ++i) Add(work.add_options(), "set", "a=b");
  EXPECT_EQ(SaidOf(work), " |  | ");
  Add(work.add_options(), "set", "a=b");
  EXPECT_EQ(SaidOf(work), "spec.work.options | are too many | give at most 100");
  Add(work.add_inputs(), "sources", "/one");
  EXPECT_EQ(SaidOf(work), "spec.work.inputs | are too many | give at most 1000");
}

TEST(FaultOfWork, SaysWhatToDoAboutOptions) {
  const auto said = [](const std::string& kind, const std::string& name, const std::string& value) {
    v1::WorkSpec work;
    work.set_kind(kind);
    for (const v1::WorkInputInfo& input : FindKindInfo(kind)->inputs()) {
      if (input.is_required()) Add(work.add_inputs(), input.name(), "/given");
    }
    Add(work.add_options(), name, value);
    const SpecFault fault = FaultOf(work);
    return fault.why + " | " + fault.remedy;
  };
  const std::string fine = " | ";
  EXPECT_EQ(said("rig plan", "min-pitch-px", "-0.5"),
            "min-pitch-px is \"-0.5\" | give a number of 0 or more");
  EXPECT_EQ(said("rig plan", "min-pitch-px", "0"), fine);
  EXPECT_EQ(said("rig plan", "min-pitch-px", "a\n"), "min-pitch-px holds a control character | remove it");
  EXPECT_EQ(said("rig plan", "moments", "-1"), "moments is \"-1\" | give a whole number of 0 or more");
  EXPECT_EQ(said("rig plan", "moments", "2.5"), "moments is \"2.5\" | give a whole number of 0 or more");
  EXPECT_EQ(said("rig plan", "moments", "0"), fine);
  EXPECT_EQ(said("rig plan", "noise-px", "0"), "noise-px is \"0\" | give a number above 0");
  EXPECT_EQ(said("rig plan", "cell", "1"),
            "\"cell\" is no option of rig plan | "
            "it has cameras, views, moments, max-facing-deg, min-pitch-px, noise-px");
  EXPECT_EQ(said("take info", "a\n", "1"), "\"a\\x0a\" is no option of take info | it has none");
  EXPECT_EQ(said("take export", "camera-width-px", "8193"),
            "camera-width-px is \"8193\" | give a whole number from 0 to 8192");
  EXPECT_EQ(said("take export", "camera-width-px", "8192"), fine);
  EXPECT_EQ(said("take export", "demosaic", "a\"b"),
            "demosaic has the value \"a\"b\" | it is given or not, without a value");
  EXPECT_EQ(said("take export", "format", ""), "format is \"\" | give one of images, ffv1, proxy");
  EXPECT_EQ(said("template build", "openings", "-2"),
            "openings is \"-2\" | give a whole number from -1 to 100");
  EXPECT_EQ(said("template build", "openings", "-1"), fine);
  EXPECT_EQ(said("evaluate", "seed", "-9007199254740993"), fine);
  EXPECT_EQ(said("evaluate", "seed", "1.0"), "seed is \"1.0\" | give a whole number");
  EXPECT_EQ(said("take trim", "shift", std::string(4097, 'a')),
            "shift has 4097 bytes | at most 4096 are allowed");
  EXPECT_EQ(said("export", "frames", "0001"), "format is missing | export needs it");
}

TEST(FaultOfWork, LooksAtNumbersWithoutRange) {
  v1::WorkKindInfo kind;
  kind.set_name("weigh");
  v1::WorkOptionInfo& number = *kind.add_options();
  number.set_name("mass");
  number.set_type(v1::OPTION_TYPE_NUMBER);
  v1::WorkOptionInfo& below = *kind.add_options();
  below.set_name("depth");
  below.set_type(v1::OPTION_TYPE_NUMBER);
  below.set_least(-5);
  const auto said = [&kind](const std::string& name, const std::string& value) {
    v1::WorkSpec work;
    Add(work.add_options(), name, value);
    const SpecFault fault = FaultOfWork(kind, work, "of").value_or(SpecFault{});
    return fault.field + " | " + fault.why + " | " + fault.remedy;
  };
  for (const char* good : {"0", "-1e300", "7.25"}) EXPECT_EQ(said("mass", good), " |  | ") << good;
  EXPECT_EQ(said("mass", "inf"), "of.options | mass is \"inf\" | give a number");
  EXPECT_EQ(said("mass", "much"), "of.options | mass is \"much\" | give a number");
  for (const char* good : {"0", "-5"}) EXPECT_EQ(said("depth", good), " |  | ") << good;
  EXPECT_EQ(said("depth", "1"), "of.options | depth is \"1\" | give a number from -5 to 0");
}

TEST(KindInfos, AreJobsFirst) {
  std::vector<std::string> names;
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    if (kind->start() == v1::WORK_START_JOB_FIELDS || kind->start() == v1::WORK_START_OPERATION)
      names.push_back(kind->name());
  }
  EXPECT_THAT(names,
              ElementsAre("register", "drive", "rig calibrate", "rig plan", "template build", "evaluate",
                          "export", "take verify", "take info", "take trim", "take export"));
}

TEST(KindInfosDeathTest, TakeNoNameTwice) {
  v1::WorkKindInfo kind;
  kind.set_name("take trim");
  EXPECT_DEATH(AddKindInfo(kind), "");
}

TEST(KindInfosDeathTest, ListAddedJobsBeforeOperations) {
  v1::WorkKindInfo kind;
  kind.set_name("a new one");
  const auto add_and_leave = [&kind] {
    AddKindInfo(kind);
    const std::vector<const v1::WorkKindInfo*> all = AllKindInfos();
    std::exit(all[2]->name() == "a new one" && FindKindInfo("a new one") == all[2] ? 0 : 1);
  };
  EXPECT_EXIT(add_and_leave(), ::testing::ExitedWithCode(0), "");
}

TEST(UnknownKind, SaysWhichOnesThereAre) {
  const SpecFault fault = UnknownKind("none", v1::WORK_START_JOB_FIELDS, "spec.work.kind");
  EXPECT_EQ(fault.field, "spec.work.kind");
  EXPECT_EQ(fault.why, "\"none\" is none that a daemon runs");
  EXPECT_EQ(fault.remedy, "give one of register, drive");
  EXPECT_EQ(UnknownKind("none", v1::WORK_START_UNSPECIFIED, "kind").remedy, "it runs none");
}

TEST(HasFieldsOfItsOwn, IsThatOfDrivingAndOfLiveJobs) {
  v1::RegistrationSpec spec;
  spec.set_rig("/rig.json");
  EXPECT_FALSE(HasFieldsOfItsOwn(spec));
  spec.set_live_every(1);
  EXPECT_TRUE(HasFieldsOfItsOwn(spec));
  spec.set_live_every(0);
  spec.mutable_driving();
  EXPECT_TRUE(HasFieldsOfItsOwn(spec));
}

}  // namespace
}  // namespace weft

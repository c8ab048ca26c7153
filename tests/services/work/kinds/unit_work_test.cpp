// What UnitKind keeps of units and says about them, with units whose inputs are numbers in memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/work/kinds/unit_kind.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// What the units read, and what was computed of them.
struct Necklace {
  std::vector<int> read = {10, 20, 30};
  std::string hash = "aa";
  std::vector<std::string> computed;
  std::string failing;  // the name of one that cannot be computed
  std::string stop_at;
  std::stop_source stop;
};

class BeadUnits : public Units {
 public:
  explicit BeadUnits(Necklace& thread) : necklace_(thread) {}

  std::vector<std::string> Names() const override {
    std::vector<std::string> names;
    for (size_t i = 0; i < necklace_.read.size(); ++i) names.push_back(absl::StrCat("bead", i));
    return names;
  }
  std::vector<v1::NamedValue> Hashes() const override {
    v1::NamedValue hash;
    hash.set_name("beads");
    hash.set_value(necklace_.hash);
    return {hash};
  }
  std::vector<std::string> Warnings() const override { return {"beads are small"}; }
  absl::StatusOr<std::string> Fingerprint(size_t unit) const override {
    if (necklace_.read[unit] < 0) return absl::NotFoundError("no bead");
    return absl::StrCat("of ", necklace_.read[unit]);
  }
  absl::Status Compute(size_t unit, const UnitPlace& place) override {
    const std::string name = absl::StrCat("bead", unit);
    necklace_.computed.push_back(absl::StrCat(name, " after '", place.state, "'"));
    place.advance(0.25);
    place.state = absl::StrCat(necklace_.read[unit]);
    if (name == necklace_.stop_at) necklace_.stop.request_stop();
    if (name != necklace_.failing) return absl::OkStatus();
    place.report.set_state(v1::FRAME_STATE_FAILED);
    place.report.set_reason("is cracked");
    return absl::OkStatus();
  }

 private:
  Necklace& necklace_;
};

v1::WorkKindInfo BeadInfo() {
  v1::WorkKindInfo info;
  info.set_name("thread beads");
  for (const char* name : {"colour", "size", "knots"}) info.add_options()->set_name(name);
  info.mutable_options(0)->set_type(v1::OPTION_TYPE_TEXT);
  info.mutable_options(1)->set_type(v1::OPTION_TYPE_NUMBER);
  info.mutable_options(1)->set_preset("2.5");
  info.mutable_options(2)->set_type(v1::OPTION_TYPE_FLAG);
  v1::WorkInputInfo& input = *info.add_inputs();
  input.set_name("beads");
  return info;
}

class BeadKind : public UnitKind {
 public:
  BeadKind(Necklace& thread, Order order)
      : UnitKind(BeadInfo(), order, {{"sort", 4}, {"pierce", 7}}), necklace_(thread) {}

 protected:
  absl::StatusOr<std::unique_ptr<Units>> Open(const WorkArguments&) const override {
    return std::make_unique<BeadUnits>(necklace_);
  }

 private:
  Necklace& necklace_;
};

class UnitWorkTest : public testing::Test {
 protected:
  UnitWorkTest() {
    std::string name = (fs::temp_directory_path() / "weft unit work XXXXXX").string();
    out_ = mkdtemp(name.data());
    spec_.set_out(out_);
    spec_.mutable_work()->set_kind("thread beads");
  }
  ~UnitWorkTest() override { fs::remove_all(out_); }

  absl::Status Run(const std::vector<size_t>& units) {
    heard_.clear();
    RegistrationEvents events;
    events.started = [this](const std::string& name) { heard_.push_back("starts " + name); };
    events.advanced = [this](const std::string& name, double share) {
      heard_.push_back(absl::StrCat(name, " at ", share));
    };
    events.finished = [this](const v1::FrameInfo& info) {
      heard_.push_back((info.reused() ? "keeps " : "has ") + info.frame());
    };
    WorkPlace place{out_, {}, "", 0};
    place.limits.threads = 3;
    const auto work = Kind().Load(spec_, WorkKind::LoadFor::kTask);
    if (!work.ok()) return work.status();
    necklace_.computed.clear();
    return (*work)->Run(units, place, events, necklace_.stop.get_token());
  }

  BeadKind Kind() { return BeadKind(necklace_, order_); }

  std::string ReportPath(const std::string& unit) const { return out_ + "/" + unit + "/report.json"; }
  v1::FrameReport ReportOf(const std::string& unit) const {
    v1::FrameReport report;
    EXPECT_TRUE(ReadJsonFile(ReportPath(unit), report).ok()) << unit;
    return report;
  }
  template <typename Change>
  void ChangeReport(const std::string& unit, const Change& change) const {
    v1::FrameReport report = ReportOf(unit);
    change(report);
    ASSERT_TRUE(WriteJsonFile(ReportPath(unit), report).ok());
  }

  // Position and reason of each that is incomplete; a * where inputs have changed.
  std::vector<std::string> Incomplete(const std::vector<v1::FrameState>& states) {
    std::vector<v1::FrameInfo> frames;
    for (size_t i = 0; i < states.size(); ++i) {
      frames.emplace_back().set_frame(absl::StrCat("bead", i));
      frames.back().set_state(states[i]);
    }
    v1::Job job;
    *job.mutable_spec() = spec_;
    const auto found = Kind().FindIncomplete(job, frames);
    EXPECT_TRUE(found.ok()) << found.status();
    std::vector<std::string> said;
    for (const IncompleteFrame& frame : *found)
      said.push_back(absl::StrCat(frame.position, " ", frame.why, frame.inputs_changed ? "*" : ""));
    return said;
  }

  static constexpr v1::FrameState kDone = v1::FRAME_STATE_DONE, kFailed = v1::FRAME_STATE_FAILED,
                                  kWaiting = v1::FRAME_STATE_WAITING;
  Necklace necklace_;
  WorkKind::Order order_ = WorkKind::Order::kInSequence;
  std::string out_;
  v1::RegistrationSpec spec_;
  std::vector<std::string> heard_;
};

TEST_F(UnitWorkTest, TellsOfEachUnitOnce) {
  ASSERT_EQ(Run({2, 0, 1}), absl::OkStatus());
  EXPECT_THAT(heard_,
              ElementsAre("starts bead0", "bead0 at 0.25", "has bead0", "starts bead1", "bead1 at 0.25",
                          "has bead1", "starts bead2", "bead2 at 0.25", "has bead2"));
  EXPECT_THAT(necklace_.computed, ElementsAre("bead0 after ''", "bead1 after '10'", "bead2 after '20'"));
  ASSERT_EQ(Run({0, 2}), absl::OkStatus());
  EXPECT_THAT(heard_, ElementsAre("keeps bead0", "keeps bead2"));
  EXPECT_THAT(necklace_.computed, IsEmpty());
}

TEST_F(UnitWorkTest, ReportsWhatAUnitIsComputedFrom) {
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  const v1::FrameReport report = ReportOf("bead1");
  EXPECT_EQ(report.frame(), "bead1");
  EXPECT_EQ(report.state(), v1::FRAME_STATE_DONE);
  ASSERT_EQ(report.inputs().work_size(), 1);
  EXPECT_EQ(report.inputs().work(0).value(), "aa");
  EXPECT_FALSE(report.weft_version().empty());
  EXPECT_EQ(report.threads(), 3);
  EXPECT_EQ(report.images_fingerprint(), "of 20");
  EXPECT_EQ(report.unit().follows(), HashOf("10"));
  EXPECT_EQ(report.unit().state(), "20");
  EXPECT_EQ(ReportOf("bead0").unit().follows(), HashOf(""));
  ASSERT_EQ(report.keys_size(), 2);
  EXPECT_EQ(report.keys(0).stage(), "sort");
  EXPECT_EQ(report.keys(0).version(), 4);
  EXPECT_EQ(report.keys(1).stage(), "pierce");
  EXPECT_EQ(report.keys(1).version(), 7);
  for (const v1::StageKey& key : report.keys()) {
    EXPECT_EQ(key.inputs(), HashOf("beads aa\n"));
    EXPECT_EQ(key.options(), HashOf("size=2.5\n"));
  }
}

TEST_F(UnitWorkTest, UnitsApartKnowNothingOfOthers) {
  order_ = WorkKind::Order::kApart;
  ASSERT_EQ(Run({2}), absl::OkStatus());
  EXPECT_THAT(necklace_.computed, ElementsAre("bead2 after ''"));
  EXPECT_FALSE(ReportOf("bead2").has_unit());
  EXPECT_FALSE(fs::exists(out_ + "/bead0"));
  ASSERT_EQ(Run({1, 2}), absl::OkStatus());
  EXPECT_THAT(heard_, ElementsAre("starts bead1", "bead1 at 0.25", "has bead1", "keeps bead2"));
  EXPECT_THAT(Incomplete({kWaiting, kDone, kDone}), IsEmpty());
}

TEST_F(UnitWorkTest, EarlierUnitsAreComputedWithoutAWord) {
  ASSERT_EQ(Run({1}), absl::OkStatus());
  EXPECT_THAT(heard_, ElementsAre("starts bead1", "bead1 at 0.25", "has bead1"));
  EXPECT_THAT(necklace_.computed, ElementsAre("bead0 after ''", "bead1 after '10'"));
  EXPECT_FALSE(fs::exists(out_ + "/bead2"));
  ASSERT_EQ(Run({}), absl::OkStatus());
  EXPECT_THAT(heard_, IsEmpty());
}

TEST_F(UnitWorkTest, UnitsOutOfUseArePassedOver) {
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  ChangeReport("bead1", [](v1::FrameReport& report) {
    report.set_state(kFailed);
    report.set_set_aside(true);
    report.clear_keys();
  });
  fs::remove_all(out_ + "/bead2");
  ASSERT_EQ(Run({2}), absl::OkStatus());
  EXPECT_THAT(necklace_.computed, ElementsAre("bead2 after '10'"));
  EXPECT_THAT(Incomplete({kDone, kFailed, kDone}), IsEmpty());
  fs::remove_all(out_ + "/bead2");
  ASSERT_EQ(Run({1, 2}), absl::OkStatus());  // now somebody asks for it
  EXPECT_EQ(heard_.back(), "has bead2");
  EXPECT_EQ(ReportOf("bead1").unit().state(), "20");
  EXPECT_THAT(necklace_.computed, ElementsAre("bead1 after '10'", "bead2 after '20'"));
}

TEST_F(UnitWorkTest, StopsBetweenUnits) {
  necklace_.stop_at = "bead1";
  EXPECT_EQ(Run({0, 1, 2}), absl::CancelledError("the work was cancelled"));
  EXPECT_EQ(heard_.back(), "has bead1");
  EXPECT_FALSE(fs::exists(out_ + "/bead2"));
}

TEST_F(UnitWorkTest, SaysWhichUnitsAreIncomplete) {
  EXPECT_THAT(Incomplete({kWaiting, kWaiting, kWaiting}), IsEmpty());
  EXPECT_THAT(Incomplete({kDone, kWaiting, kFailed}),
              ElementsAre("0 is not as this job wrote it", "2 is not as this job wrote it"));
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), IsEmpty());
  EXPECT_THAT(Incomplete({kDone, kFailed, kDone}), ElementsAre("1 is in another state than its report says"));
  necklace_.read[1] = 21;
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), ElementsAre("1 is not as this job wrote it*"));
  EXPECT_THAT(Incomplete({kDone, kWaiting, kDone}), IsEmpty());
  necklace_.read[1] = -1;
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), ElementsAre("1 is not as this job wrote it*"));
  necklace_.read[1] = 20;
  ChangeReport("bead0", [](v1::FrameReport& report) { report.set_frame("bead9"); });
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), ElementsAre("0 is not as this job wrote it"));
}

TEST_F(UnitWorkTest, SeesThatAUnitFollowsAnotherState) {
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  ChangeReport("bead1", [](v1::FrameReport& report) { report.mutable_unit()->set_state("19"); });
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), ElementsAre("2 is not as this job wrote it"));
  // What the one before knew is not known here.
  EXPECT_THAT(Incomplete({kDone, kWaiting, kDone}), IsEmpty());
}

TEST_F(UnitWorkTest, KeepsUnitsThatFailed) {
  necklace_.failing = "bead1";
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  EXPECT_EQ(ReportOf("bead1").reason(), "is cracked");
  EXPECT_THAT(Incomplete({kDone, kFailed, kDone}), IsEmpty());
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}), ElementsAre("1 is in another state than its report says"));
  ASSERT_EQ(Run({0, 1, 2}), absl::OkStatus());
  EXPECT_THAT(heard_, ElementsAre("keeps bead0", "keeps bead1", "keeps bead2"));
}

TEST_F(UnitWorkTest, ListsWhatIsAskedForAndWarns) {
  spec_.set_frames("bead1");
  const auto work = Kind().Load(spec_, WorkKind::LoadFor::kListing);
  ASSERT_TRUE(work.ok()) << work.status();
  EXPECT_THAT((*work)->inputs().frames, ElementsAre("bead1"));
  EXPECT_THAT((*work)->inputs().warnings, ElementsAre("beads are small"));
  EXPECT_FALSE((*work)->inputs().driven);
  ASSERT_EQ(Run({0}), absl::OkStatus());
  EXPECT_THAT(heard_, ElementsAre("starts bead1", "bead1 at 0.25", "has bead1"));
  EXPECT_FALSE(fs::exists(out_ + "/bead0"));
  EXPECT_EQ(ReportOf("bead1").unit().state(), "20");
}

TEST_F(UnitWorkTest, NamesTheInputOfAnotherHash) {
  v1::NamedValue& expected = *spec_.mutable_expected()->add_work();
  expected.set_name("beads");
  expected.set_value("aa");
  EXPECT_EQ(Run({0}), absl::OkStatus());
  expected.set_value("bb");
  EXPECT_EQ(Run({0}), absl::FailedPreconditionError("spec.expected.work: beads has hash aa, expected bb"));
  expected.set_name("pearls");
  EXPECT_EQ(Run({0}), absl::FailedPreconditionError("spec.expected.work: pearls has hash none, expected bb"));
}

TEST_F(UnitWorkTest, NeedsUnits) {
  necklace_.read.clear();
  EXPECT_EQ(Run({}), absl::NotFoundError("thread beads: its inputs hold no unit"));
}

TEST(WorkArguments, AreThoseGivenOrThePresets) {
  const v1::WorkKindInfo info = BeadInfo();
  v1::WorkSpec work;
  const auto give = [](v1::NamedValue* given, const char* name, const char* value) {
    given->set_name(name);
    given->set_value(value);
  };
  {
    const WorkArguments none(info, work);
    EXPECT_EQ(none.Input("beads"), "");
    EXPECT_EQ(none.Text("size"), "2.5");
    EXPECT_EQ(none.Text("colour"), "");
    EXPECT_EQ(none.Text("weight"), "");
    EXPECT_EQ(none.Number("size"), 2.5);
    EXPECT_EQ(none.Number("colour"), 0);
    EXPECT_FALSE(none.Has("size"));
    EXPECT_EQ(none.OptionsText(), "size=2.5\n");
  }
  give(work.add_inputs(), "beads", "/glass");
  give(work.add_options(), "knots", "");
  give(work.add_options(), "size", "-7");
  give(work.add_options(), "colour", "red");
  give(work.add_options(), "colour", "9 blue");
  const WorkArguments given(info, work);
  EXPECT_EQ(given.Input("beads"), "/glass");
  EXPECT_EQ(given.Input("colour"), "");
  EXPECT_EQ(given.Number("size"), -7);
  EXPECT_EQ(given.Text("colour"), "red");
  EXPECT_TRUE(given.Has("knots"));
  EXPECT_EQ(given.OptionsText(), "colour=red\ncolour=9 blue\nsize=-7\nknots=\n");
}

}  // namespace
}  // namespace weft

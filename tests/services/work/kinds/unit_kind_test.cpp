#include "services/work/kinds/unit_kind.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "copy_meshes.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/kinds/local_job.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class UnitKindTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { AddKind(MakeCopyMeshes()); }

  UnitKindTest() {
    std::string name = (fs::temp_directory_path() / "weft unit kind XXXXXX").string();
    folder_ = mkdtemp(name.data());
    for (const char* frame : {"0000", "0001", "0002", "0003"}) WriteMeshOf(frame, 1);
    spec_.mutable_work()->set_kind("copy meshes");
    v1::NamedValue& result = *spec_.mutable_work()->add_inputs();
    result.set_name("result");
    result.set_value(folder_ / "from");
    spec_.set_out(folder_ / "out");
  }
  ~UnitKindTest() override { fs::remove_all(folder_); }

  void WriteMeshOf(const std::string& frame, double size_mm) const {
    fs::create_directories(folder_ / "from" / frame);
    const TriangleMesh mesh{{{0, 0, 0}, {size_mm, 0, 0}, {0, size_mm, 0}}, {{0, 1, 2}}};
    ASSERT_TRUE(WriteMesh(folder_ / "from" / frame / "mesh.ply", mesh).ok());
  }

  v1::FrameReport ReportOf(const std::string& frame) const {
    v1::FrameReport report;
    EXPECT_TRUE(ReadJsonFile((folder_ / "out" / frame / "report.json").string(), report).ok());
    return report;
  }

  // The names of the units that a run computed anew.
  std::vector<std::string> RunLocally() {
    std::vector<std::string> computed;
    const auto job = RunLocalJob({spec_, spec_, "weft copy-meshes", {}},
                                 [&](const v1::JobUpdate& update) {
                                   for (const v1::FrameInfo& info : update.frames())
                                     if (info.state() == v1::FRAME_STATE_DONE && !info.reused())
                                       computed.push_back(info.frame());
                                 },
                                 {});
    EXPECT_TRUE(job.ok()) << job.status();
    if (job.ok()) job_ = *job;
    return computed;
  }

  // Of these units by position, with a kind of this version.
  std::vector<std::string> RunOf(int version, const std::vector<size_t>& units) {
    std::vector<std::string> computed;
    const auto kind = MakeCopyMeshes(version);
    const auto work = kind->Load(spec_, WorkKind::LoadFor::kTask);
    EXPECT_TRUE(work.ok()) << work.status();
    RegistrationEvents events;
    events.finished = [&](const v1::FrameInfo& info) {
      if (!info.reused()) computed.push_back(info.frame());
    };
    EXPECT_EQ((*work)->Run(units, {spec_.out(), {}, "", 0}, events, {}), absl::OkStatus());
    return computed;
  }

  std::vector<size_t> IncompleteWith(int version) const {
    std::vector<v1::FrameInfo> frames;
    for (const char* frame : {"0000", "0001", "0002", "0003"}) {
      frames.emplace_back().set_frame(frame);
      frames.back().set_state(v1::FRAME_STATE_DONE);
    }
    v1::Job job;
    *job.mutable_spec() = spec_;
    const auto incomplete = MakeCopyMeshes(version)->FindIncomplete(job, frames);
    EXPECT_TRUE(incomplete.ok()) << incomplete.status();
    std::vector<size_t> positions;
    for (const IncompleteFrame& frame : *incomplete) positions.push_back(frame.position);
    return positions;
  }

  fs::path folder_;
  v1::RegistrationSpec spec_;
  v1::Job job_;
};

TEST_F(UnitKindTest, ComputesEachUnitAfterTheOneBefore) {
  EXPECT_THAT(RunLocally(), ElementsAre("0000", "0001", "0002", "0003"));
  EXPECT_EQ(job_.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job_.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(job_.verdict().reason(), "4 of 4 frames done");
  EXPECT_EQ(ReportOf("0003").unit().state(), "4");
  EXPECT_TRUE(fs::exists(folder_ / "out/0003/mesh.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "out/report.html"));
}

TEST_F(UnitKindTest, KeepsUnitsOfAnEarlierRun) {
  RunLocally();
  EXPECT_THAT(RunLocally(), IsEmpty());
  fs::remove(folder_ / "out/0002/mesh.ply");
  EXPECT_THAT(RunLocally(), ElementsAre("0002"));  // 0003 follows the same state
}

TEST_F(UnitKindTest, ComputesAgainWhatReadsOtherBytes) {
  RunLocally();
  WriteMeshOf("0001", 2);
  EXPECT_THAT(RunLocally(), ElementsAre("0001"));
}

TEST_F(UnitKindTest, ComputesAgainWhereTheVersionOfAStageIsAnother) {
  EXPECT_THAT(RunOf(1, {0, 1, 2, 3}), ElementsAre("0000", "0001", "0002", "0003"));
  EXPECT_THAT(IncompleteWith(1), IsEmpty());
  EXPECT_THAT(IncompleteWith(2), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(RunOf(2, {0, 1, 2, 3}), ElementsAre("0000", "0001", "0002", "0003"));
  EXPECT_THAT(RunOf(2, {0, 1, 2, 3}), IsEmpty());
}

TEST_F(UnitKindTest, ComputesAgainWhereAnOptionHasAnotherValue) {
  RunLocally();
  v1::NamedValue& every = *spec_.mutable_work()->add_options();
  every.set_name("every");
  every.set_value("1");  // the preset
  EXPECT_THAT(RunLocally(), IsEmpty());
  every.set_value("2");
  EXPECT_THAT(RunLocally(), ElementsAre("0000", "0002"));
}

TEST_F(UnitKindTest, GoesOnFromUnitsThatNobodyAskedFor) {
  EXPECT_THAT(RunOf(1, {2}), ElementsAre("0002"));  // after two that had to come first
  EXPECT_EQ(ReportOf("0002").unit().state(), "3");
  EXPECT_THAT(RunOf(1, {3}), ElementsAre("0003"));
  EXPECT_THAT(IncompleteWith(1), IsEmpty());
}

TEST_F(UnitKindTest, AUnitThatFollowsAnotherStateIsIncomplete) {
  RunLocally();
  v1::FrameReport report = ReportOf("0001");
  report.mutable_unit()->set_state("7");
  ASSERT_TRUE(WriteJsonFile((folder_ / "out/0001/report.json").string(), report).ok());
  EXPECT_THAT(IncompleteWith(1), ElementsAre(2));
}

TEST_F(UnitKindTest, AUnitThatCannotBeComputedFailsAlone) {
  RunLocally();
  fs::remove_all(folder_ / "out");
  std::ofstream(folder_ / "from/0001/mesh.ply") << "ply\nnonsense\n";
  EXPECT_THAT(RunLocally(), ElementsAre("0000", "0002", "0003"));
  EXPECT_EQ(job_.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job_.frames().failed(), 1);
  EXPECT_THAT(ReportOf("0001").reason(), HasSubstr("0001/mesh.ply"));
  EXPECT_EQ(ReportOf("0003").unit().state(), "3");
}

TEST_F(UnitKindTest, StopsWithWhatIsComplete) {
  v1::NamedValue& pause = *spec_.mutable_work()->add_options();
  pause.set_name("pause-ms");
  pause.set_value("20");
  std::stop_source stop;
  const auto job = RunLocalJob(
      {spec_, spec_, "weft copy-meshes", {}},
      [&](const v1::JobUpdate& update) {
        if (update.job().frames().done() == 2) stop.request_stop();
      },
      stop.get_token());
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(job->frames().done(), 2);
  EXPECT_THAT(RunLocally(), ElementsAre("0002", "0003"));
}

TEST_F(UnitKindTest, TakesARangeOfUnits) {
  spec_.set_frames("0001:0003");
  EXPECT_THAT(RunLocally(), ElementsAre("0001", "0002"));
  spec_.set_frames("0007");
  EXPECT_EQ(ListInputs(spec_).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(UnitKindTest, RefusesInputsOfOtherHashesAndFaults) {
  v1::NamedValue& expected = *spec_.mutable_expected()->add_work();
  expected.set_name("result");
  expected.set_value("0123456789abcdef");
  EXPECT_EQ(ListInputs(spec_).status().code(), absl::StatusCode::kFailedPrecondition);
  spec_.clear_expected();
  spec_.mutable_work()->clear_inputs();
  EXPECT_EQ(ListInputs(spec_).status().message(),
            "spec.work.inputs: result is missing; copy meshes needs it");
}

TEST(UnknownWork, SaysThatItIsUnknown) {
  v1::RegistrationSpec spec;
  spec.mutable_work()->set_kind("knit");
  EXPECT_EQ(KindOf(spec).name(), "unknown");
  EXPECT_EQ(ListInputs(spec).status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(ListInputs(spec).status().message()), HasSubstr("\"knit\""));
  ASSERT_TRUE(KindOf(spec).FaultOf(spec));
  EXPECT_EQ(KindOf(spec).FaultOf(spec)->field, "spec.work.kind");
}

TEST(UnitKind, HasNothingToDoWithoutUnits) {
  class NoUnits : public UnitKind {
   public:
    NoUnits() : UnitKind({}, Order::kApart, {{"rest", 1}}) {}

   protected:
    absl::StatusOr<std::unique_ptr<Units>> Open(const WorkArguments&) const override {
      class None : public Units {
        std::vector<std::string> Names() const override { return {}; }
        std::vector<v1::NamedValue> Hashes() const override { return {}; }
        absl::StatusOr<std::string> Fingerprint(size_t) const override { return "none"; }
        absl::Status Compute(size_t, const UnitPlace&) override { return absl::OkStatus(); }
      };
      return std::make_unique<None>();
    }
  };
  EXPECT_EQ(NoUnits().Load({}, WorkKind::LoadFor::kListing).status().code(), absl::StatusCode::kNotFound);
}

TEST(StagesOf, HaveTheVersionsOfThePipelineBeforeTheirOwn) {
  const std::vector<WorkStage> stages = StagesOf(StageList<Stage::kDecode, Stage::kAlign>(), {{"dress", 3}});
  ASSERT_EQ(stages.size(), 3u);
  EXPECT_EQ(stages[0].name, "decode");
  EXPECT_EQ(stages[0].version, AlgorithmVersion(Stage::kDecode));
  EXPECT_EQ(stages[1].name, "align");
  EXPECT_EQ(stages[2].name, "dress");
  EXPECT_EQ(stages[2].version, 3);
}

TEST(UnitKindDeathTest, IsNoneWithoutStages) {
  class NoStages : public UnitKind {
   public:
    explicit NoStages(std::vector<WorkStage> stages) : UnitKind({}, Order::kApart, std::move(stages)) {}

   protected:
    absl::StatusOr<std::unique_ptr<Units>> Open(const WorkArguments&) const override {
      return absl::UnimplementedError("");
    }
  };
  EXPECT_DEATH(NoStages({}), "");
  EXPECT_DEATH(NoStages({{"copy", 0}}), "");
  EXPECT_DEATH(NoStages({{"", 1}}), "");
}

}  // namespace
}  // namespace weft

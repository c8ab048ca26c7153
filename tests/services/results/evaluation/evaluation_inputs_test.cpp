#include "services/results/evaluation/evaluation_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "services/formats/files/json_file.h"
#include "services/results/evaluation/evaluate_job.h"
#include "tests/services/results/evaluation/sheet_on_disk.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

TEST(EvaluationRequest, WhatCannotBeMeantIsRefused) {
  EvaluationRequest right;
  right.result = "/result";
  EXPECT_TRUE(right.Validate().ok());
  right.truth = "/truth";
  EXPECT_TRUE(right.Validate().ok());
  const std::map<std::string, std::function<void(EvaluationRequest&)>> cases = {
      {"the folder of the result is empty", [](auto& r) { r.result.clear(); }},
      {"a truth is named and left out at once", [](auto& r) { r.no_truth = true; }},
      {"fps must not be negative", [](auto& r) { r.fps = -1; }},
      {"samples must not be negative", [](auto& r) { r.samples = -1; }},
      {"well_seen_views must be at least 1", [](auto& r) { r.scores.well_seen_views = 0; }},
  };
  for (const auto& [message, change] : cases) {
    EvaluationRequest request = right;
    change(request);
    EXPECT_EQ(request.Validate().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(request.Validate().message(), message);
    EXPECT_EQ(LoadEvaluationInputs(request).status(), request.Validate());
  }
  EvaluationRequest alone = right;
  alone.truth.clear(), alone.no_truth = true;
  EXPECT_TRUE(alone.Validate().ok());
  right.geodesics.sources = 0;
  EXPECT_FALSE(right.Validate().ok());
}

class EvaluationInputsTest : public testing::Test {
 protected:
  EvaluationInputsTest() {
    for (const char* frame : {"0000", "0001"}) {
      sheet_.WriteTruth(frame, sheet_.rest());
      sheet_.WriteResultMesh(frame, sheet_.rest(), {});
      WriteBytes(sheet_.folder / ("take/" + std::string(frame) + "/cam-01.png"), "picture");
    }
    rig_ = *ReadRig(sheet_.folder / "take/rig.json");
    for (const CameraModel& camera : rig_.cameras)
      WriteBytes(sheet_.folder / ("take/0000/" + camera.id + ".png"), "picture");
  }

  EvaluationInputs Loaded(const EvaluationRequest& request) {
    auto inputs = LoadEvaluationInputs(request);
    EXPECT_TRUE(inputs.ok()) << inputs.status();
    return inputs.ok() ? *std::move(inputs) : EvaluationInputs();
  }

  static std::vector<std::string> RemarksOf(const EvaluationInputs& inputs) {
    std::vector<std::string> remarks;
    for (const EvaluationRemark& remark : inputs.remarks)
      remarks.push_back(remark.metric + ": " + remark.reason);
    return remarks;
  }

  void WriteJob(const std::function<void(v1::Job&)>& change) {
    v1::Job job;
    job.set_id("j-1");
    job.mutable_spec()->set_dump(sheet_.folder / "take");
    job.mutable_spec()->set_rig(sheet_.folder / "take/rig.json");
    job.mutable_spec()->set_garment(sheet_.folder / "take/template");
    change(job);
    ASSERT_TRUE(WriteJsonFile(sheet_.folder / "result/job.json", job).ok());
    for (const char* frame : {"0000", "0001"}) WriteReport(frame, {});
  }
  void WriteReport(const std::string& frame, const v1::FrameReport& report) {
    ASSERT_TRUE(WriteJsonFile(sheet_.folder / ("result/" + frame + "/report.json"), report).ok());
  }

  EvaluationRequest OfResult() {
    EvaluationRequest request;
    request.result = sheet_.folder / "result";
    return request;
  }

  SheetOnDisk sheet_;
  Rig rig_;
};

TEST_F(EvaluationInputsTest, WhatIsNotThereIsARemark) {
  const EvaluationInputs inputs = Loaded(OfResult());
  EXPECT_THAT(RemarksOf(inputs),
              ElementsAre("reprojection, texture drift: there is no rig; give --rig",
                          "geodesic distortion, drift: there is no template; give --template",
                          "texture drift: there are no pictures; give --take and --rig",
                          "errors against the truth, exact drift: there is no ground truth; give --truth",
                          "drift per second: the frame rate of the take is unknown, so drift is given per "
                          "frame; --fps gives it per second"));
  EXPECT_FALSE(inputs.rig || inputs.garment || inputs.printed || inputs.dump || inputs.truth_by_node);
  EXPECT_EQ(inputs.result, sheet_.folder / "result");
  EXPECT_EQ(inputs.frames.size(), 2u);
  EXPECT_EQ(inputs.fps, 0);
}

TEST_F(EvaluationInputsTest, AllOfItIsTakenFromTheJob) {
  WriteJob([](v1::Job&) {});
  const EvaluationInputs inputs = Loaded(OfResult());
  EXPECT_EQ(inputs.rig->ContentHash(), rig_.ContentHash());
  ASSERT_TRUE(inputs.printed);
  EXPECT_EQ(inputs.printed->ContentHash(), sheet_.garment.ContentHash());
  EXPECT_EQ(inputs.garment.get(), inputs.printed.get());
  ASSERT_TRUE(inputs.dump);
  EXPECT_EQ(inputs.dump_path, sheet_.folder / "take");
  EXPECT_EQ(inputs.truth, sheet_.folder / "take/truth");
  EXPECT_EQ(inputs.job.id(), "j-1");
  EXPECT_EQ(RemarksOf(inputs).size(), 1u) << "the frame rate";
  EXPECT_FALSE(inputs.truth_by_node || inputs.rows_of_garment);
}

TEST_F(EvaluationInputsTest, FilesThatAreNotOfTheJobAreNotUsed) {
  for (const char* frame : {"0002", "0003"}) {
    sheet_.WriteTruth(frame, sheet_.rest());
    sheet_.WriteResultMesh(frame, sheet_.rest(), {});
  }
  WriteJob([](v1::Job& job) {
    job.mutable_inputs()->set_board("ab");
    job.set_first_frame("0000"), job.set_last_frame("0002");
  });
  v1::FrameReport of_others;
  of_others.mutable_inputs()->set_board("cd");
  WriteReport("0001", of_others);
  WriteReport("0003", {});  // of a job before it
  const EvaluationInputs inputs = Loaded(OfResult());
  EXPECT_EQ(inputs.frames.size(), 3u) << "0001 and 0002 are frames without a mesh";
  EXPECT_TRUE(inputs.Uses("0000"));
  EXPECT_FALSE(inputs.Uses("0001")) << "of another board";
  EXPECT_FALSE(inputs.Uses("0002")) << "without a report";
  EXPECT_FALSE(inputs.Uses("0003")) << "not asked for";
  const std::string why =
      ": its report.json is missing, damaged, or of other inputs, so its files are not used; `weft register` "
      "with the same inputs computes it again";
  EXPECT_THAT(RemarksOf(inputs),
              testing::IsSupersetOf({"frames: frame 0001" + why, "frames: frame 0002" + why}));
  EXPECT_THAT(RemarksOf(inputs), testing::Contains(HasSubstr("1 frame that this job was not asked for")));

  const auto evaluated = EvaluateJob(OfResult());
  ASSERT_TRUE(evaluated.ok()) << evaluated.status();
  EXPECT_EQ(evaluated->verdict.grade(), v1::GRADE_BAD) << evaluated->verdict.DebugString();
  EXPECT_THAT(evaluated->frames[1].missing, ElementsAre("observations.csv", "cloud.ply", "mesh.ply"));
  std::filesystem::remove(sheet_.folder / "result/job.json");
  EXPECT_TRUE(Loaded(sheet_.Request()).Uses("0002")) << "nothing tells whose it is";
}

TEST_F(EvaluationInputsTest, WhatTheJobNamesMayBeGone) {
  WriteJob([](v1::Job& job) {
    job.mutable_spec()->set_rig("/nowhere/rig.json");
    job.mutable_spec()->set_garment("/nowhere/template");
    job.mutable_spec()->set_dump("/nowhere/take");
  });
  EXPECT_EQ(RemarksOf(Loaded(OfResult())).size(), 5u);
  EvaluationRequest request = OfResult();
  request.rig = "/nowhere/rig.json";
  EXPECT_EQ(LoadEvaluationInputs(request).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(EvaluationInputsTest, AnotherRigOrTemplateThanTheJobsIsRefused) {
  WriteJob([](v1::Job& job) { job.mutable_inputs()->set_rig("ab"); });
  absl::Status status = LoadEvaluationInputs(OfResult()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            absl::StrCat(sheet_.folder / "take/rig.json", ": the rig has hash ", rig_.ContentHash(),
                         ", but the result was computed with ab; give the rig of the job"));
  WriteJob([](v1::Job& job) { job.mutable_inputs()->set_garment("cd"); });
  status = LoadEvaluationInputs(OfResult()).status();
  EXPECT_EQ(
      status.message(),
      absl::StrCat(sheet_.folder / "take/template", ": the template has hash ", sheet_.garment.ContentHash(),
                   ", but the result was computed with cd; give the template of the job"));
  WriteJob([&](v1::Job& job) { job.mutable_inputs()->set_garment(sheet_.garment.ContentHash()); });
  EXPECT_TRUE(LoadEvaluationInputs(OfResult()).ok());
}

TEST_F(EvaluationInputsTest, AGarmentMayBeAMeshWithoutABoard) {
  EvaluationRequest request = sheet_.Request();
  request.garment = sheet_.folder / "take/template/mesh.ply";
  const EvaluationInputs inputs = Loaded(request);
  ASSERT_TRUE(inputs.garment);
  EXPECT_FALSE(inputs.printed);
  EXPECT_EQ(inputs.truth, request.truth) << "its faces are those of the take's template";

  WriteBytes(sheet_.folder / "other.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
  request.garment = sheet_.folder / "other.obj";
  const absl::Status status = LoadEvaluationInputs(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            request.truth +
                ": the result's mesh has other faces than the take's template, and no board relates "
                "them; give --template with a template of the take's board");

  // Beside the take it is left alone, with the reason.
  request.truth.clear(), request.dump = sheet_.folder / "take", request.rig = sheet_.folder / "take/rig.json";
  const EvaluationInputs without = Loaded(request);
  EXPECT_EQ(without.truth, "");
  EXPECT_THAT(RemarksOf(without), testing::Contains(HasSubstr(absl::StrCat(
                                      "errors against the truth, exact drift: ", sheet_.folder / "take/truth",
                                      " beside the take was not used: "))));
  WriteJob([](v1::Job& job) { job.mutable_inputs()->set_garment("ef"); });
  EXPECT_THAT(std::string(LoadEvaluationInputs(request).status().message()),
              HasSubstr("other.obj: the garment's mesh has hash"));
}

TEST_F(EvaluationInputsTest, ATemplateOfAnotherBoardDoesNotFitTheTruth) {
  Template other = sheet_.garment;
  other.board_hash = GenerateBoard(8, 8, 10, 2)->ContentHash();
  ASSERT_TRUE(WriteTemplate(sheet_.folder / "other", other).ok());
  EvaluationRequest request = sheet_.Request();
  request.garment = sheet_.folder / "other";
  // The same faces and cells count as the same vertices, so one more row is lacking.
  Template upper = sheet_.Sheet(6);
  upper.board_hash = other.board_hash;
  ASSERT_TRUE(WriteTemplate(sheet_.folder / "other", upper).ok());
  const absl::Status status = LoadEvaluationInputs(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              testing::AllOf(testing::StartsWith(request.truth + ": "), HasSubstr(other.board_hash),
                             testing::EndsWith("; give the truth of the take that was registered")));
}

TEST_F(EvaluationInputsTest, TheTruthBesideTheTakeIsUsedUnlessItIsLeftOut) {
  EvaluationRequest request = sheet_.Request();
  request.truth.clear(), request.dump = sheet_.folder / "take";
  EXPECT_EQ(Loaded(request).truth, sheet_.folder / "take/truth");
  request.no_truth = true;
  const EvaluationInputs without = Loaded(request);
  EXPECT_EQ(without.truth, "");
  EXPECT_THAT(RemarksOf(without),
              testing::Contains("errors against the truth, exact drift: left out on request (--no-truth)"));
}

TEST_F(EvaluationInputsTest, PicturesThatWereNamedMustBeThere) {
  std::filesystem::create_directories(sheet_.folder / "empty");
  EvaluationRequest request = sheet_.Request();
  request.rig = sheet_.folder / "take/rig.json", request.dump = sheet_.folder / "empty";
  EXPECT_FALSE(LoadEvaluationInputs(request).ok());
  request.dump.clear();
  WriteJob([&](v1::Job& job) { job.mutable_spec()->set_dump(sheet_.folder / "empty"); });
  const EvaluationInputs inputs = Loaded(request);
  EXPECT_FALSE(inputs.dump);
  EXPECT_EQ(inputs.dump_path, "");
  EXPECT_THAT(RemarksOf(inputs),
              testing::Contains(testing::AllOf(testing::StartsWith("texture drift: "), HasSubstr("empty"))));
}

TEST_F(EvaluationInputsTest, TheFrameRateIsGivenOrThatOfThePictures) {
  EvaluationRequest request = sheet_.Request();
  request.fps = 12;
  EXPECT_EQ(Loaded(request).fps, 12);
  EXPECT_EQ(Loaded(request).fps_source, "--fps");
  request.fps = 0;
  WriteBytes(sheet_.folder / "take/truth/pictures.csv",
             "frame,camera,mid_exposure_ns,lost\n0000,a,0,0\n0001,a,40000000,0\n");
  const EvaluationInputs timed = Loaded(request);
  EXPECT_NEAR(timed.fps, 25, 1e-9);
  EXPECT_EQ(timed.fps_source, "the times in " + request.truth + "/pictures.csv");
  EXPECT_THAT(RemarksOf(timed), testing::Not(testing::Contains(HasSubstr("frame rate"))));
  // The times beside the take tell as well where its truth is left out.
  request.truth.clear(), request.no_truth = true, request.dump = sheet_.folder / "take";
  EXPECT_NEAR(Loaded(request).fps, 25, 1e-9);
}

}  // namespace
}  // namespace weft

#include "services/results/evaluation/plan_rig.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "simulation/cloth.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/rig_plan.pb.h"

namespace weft {
namespace {

// A tube in a ring of 16 cameras, on disk; two moments of motion.
class PlanRigTest : public testing::Test {
 protected:
  void SetUp() override {
    const absl::StatusOr<Cloth> cloth = BuildCloth({.rows = 20, .cols = 40, .cell_mm = 5});
    ASSERT_TRUE(cloth.ok());
    const absl::StatusOr<Board> board = GenerateBoard(20, 40, 5, 1);
    const auto garment = ImportTemplate("tube", cloth->rest, cloth->cell_of_vertex, *board);
    ASSERT_TRUE(garment.ok()) << garment.status();
    ASSERT_TRUE(WriteTemplate(folder_ / "template", *garment).ok());
    ASSERT_TRUE(WriteRig(folder_ / "rig.json", *MakeStudioRig("ring", {.cameras = 16})).ok());
    for (const char* frame : {"0", "1"}) {
      std::filesystem::create_directories(folder_ / ("motion/" + std::string(frame)));
      ASSERT_TRUE(WriteMesh(folder_ / ("motion/" + std::string(frame) + "/mesh.ply"), cloth->rest).ok());
    }
    request_.rig = folder_ / "rig.json", request_.garment = folder_ / "template";
    request_.motion = folder_ / "motion";
  }

  TempFolder folder_;
  RigPlanRequest request_;
};

TEST_F(PlanRigTest, WritesARigOfTheChosenCameras) {
  request_.cameras = 9;
  const auto plan = PlanRigFromFiles(request_);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->moments, (std::vector<std::string>{"0", "1"}));
  ASSERT_TRUE(WriteRigPlan(folder_ / "plan", *plan).ok());
  const absl::StatusOr<Rig> rig = ReadRig(folder_ / "plan/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras.size(), 9u);
  v1::RigPlan read;
  ASSERT_TRUE(ReadJsonFile(folder_ / "plan/plan.json", read).ok());
  EXPECT_EQ(read.rig_hash(), rig->ContentHash());
  EXPECT_EQ(read.steps(0).camera(), rig->cameras[0].id);
  const std::string page = ReadBytes(folder_ / "plan/report.html");
  for (const char* id : {"id=\"curves\"", "id=\"rig\"", "id=\"maps\"", "id=\"cameras\""})
    EXPECT_NE(page.find(id), std::string::npos) << id;
  EXPECT_EQ(read.verdict().checks(0).id(), "plan.coverage");
  EXPECT_NE(page.find(read.verdict().checks(0).limits()), std::string::npos);
  EXPECT_NE(page.find("<span>100 %</span>"), std::string::npos);  // no share exceeds that
  for (const CameraModel& camera : rig->cameras)
    EXPECT_NE(page.find("text-anchor=\"middle\">" + camera.id + "</text>"), std::string::npos) << camera.id;
}

TEST_F(PlanRigTest, WithoutANumberAsFewAsAreNearlyAsGoodAsAll) {
  const auto plan = PlanRigFromFiles(request_);
  ASSERT_TRUE(plan.ok()) << plan.status();
  const size_t chosen = plan->rig.cameras.size();
  EXPECT_GE(plan->steps[chosen - 1].coverage, 0.99 * plan->steps.back().coverage);
  EXPECT_LT(plan->steps[chosen - 2].coverage, 0.99 * plan->steps.back().coverage);
}

TEST_F(PlanRigTest, WhatIsMissingIsNamed) {
  std::filesystem::create_directories(folder_ / "empty");
  request_.motion = folder_ / "empty";
  const auto none = PlanRigFromFiles(request_);
  EXPECT_EQ(none.status().code(), absl::StatusCode::kNotFound);
  EXPECT_NE(none.status().message().find("mesh.ply"), std::string::npos);
  request_.motion.clear();
  request_.rig = folder_ / "other.json";
  EXPECT_NE(PlanRigFromFiles(request_).status().message().find("other.json"), std::string::npos);
}

}  // namespace
}  // namespace weft

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
#include "tests/services/results/report/page_data.h"
#include "weft/v1/page_reports.pb.h"
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
  EXPECT_EQ(read.verdict().checks(0).id(), "plan.coverage");
  EXPECT_EQ(MemberOf<v1::RigPlan>(page, "plan").rig_hash(), read.rig_hash());
  const auto maps = MemberOf<v1::PageMaps>(page, "maps");
  ASSERT_EQ(maps.maps_size(), 4);
  EXPECT_EQ(maps.problems_size(), 0);
  EXPECT_EQ(maps.maps(0).key().scale().high(), 100);
  EXPECT_TRUE(maps.maps(0).key().scale().bounded());  // no share exceeds that
  const auto drawn = MemberOf<v1::RigPlanPage>(page, "page");
  ASSERT_EQ(static_cast<size_t>(drawn.cameras_size()), plan->candidates.cameras.size());
  const CameraModel& last = plan->candidates.cameras.back();
  const v1::RigPlanPage::Camera& of_page = *drawn.cameras().rbegin();
  EXPECT_EQ(of_page.id(), last.id);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(of_page.center_mm(i), last.CenterWorld()[i], 1e-9);
    EXPECT_NEAR(of_page.look(i), last.rotation(2, i), 1e-12);
  }
  EXPECT_EQ(drawn.garment_mm_size() % 3, 0);
  EXPECT_GT(drawn.garment_mm_size(), 0);
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

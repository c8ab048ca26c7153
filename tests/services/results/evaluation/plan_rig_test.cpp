#include "services/results/evaluation/plan_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "simulation/cloth.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/page_data.h"
#include "tests/services/results/report/proto_text.h"
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

TEST_F(PlanRigTest, MomentsAreSpreadEvenlyOverTheMotion) {
  const std::string mesh = ReadBytes(folder_ / "motion/0/mesh.ply");
  for (const char* frame : {"2", "3", "4"})
    WriteBytes(folder_ / ("motion/" + std::string(frame) + "/mesh.ply"), mesh);
  request_.cameras = 1;
  const auto moments = [&](int count) {
    request_.moments = count;
    const auto plan = PlanRigFromFiles(request_);
    EXPECT_TRUE(plan.ok()) << plan.status();
    std::string names;
    for (const std::string& name : plan->moments) names += name + " ";
    return names;
  };
  EXPECT_EQ(moments(2), "1 3 ");
  EXPECT_EQ(moments(1), "2 ");
  EXPECT_EQ(moments(0), "0 1 2 3 4 ");
  EXPECT_EQ(moments(9), "0 1 2 3 4 ");
  request_.motion = folder_ / "motion/3/mesh.ply";
  EXPECT_EQ(moments(1), "mesh.ply ");
  request_.motion.clear();
  EXPECT_EQ(moments(1), "template ");
}

TEST_F(PlanRigTest, MeshesOfAnotherGarmentAreRefused) {
  ASSERT_TRUE(
      WriteMesh(folder_ / "motion/1/mesh.ply", {{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, {{0, 1, 2}}}).ok());
  const auto refused = PlanRigFromFiles(request_);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.status().message(),
            folder_ / "motion/1/mesh.ply" + ": has 3 vertices, the template " +
                std::to_string(ReadTemplate(request_.garment)->rest.vertices_mm.size()));
}

TEST_F(PlanRigTest, MoreCamerasThanThereAreAreAll) {
  request_.motion.clear(), request_.cameras = 99;
  std::vector<std::pair<size_t, size_t>> steps;
  const auto plan =
      PlanRigFromFiles(request_, [&](size_t done, size_t all) { steps.emplace_back(done, all); });
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->rig.cameras.size(), plan->steps.size());
  EXPECT_EQ(plan->rig.id, plan->candidates.id);
  EXPECT_FALSE(steps.empty());
  EXPECT_EQ(plan->forecast.coverage.size(), plan->garment.rest.vertices_mm.size());
}

// Two of three candidates, of a garment of 3,000 vertices.
RigPlanResult MadeUpPlan() {
  RigPlanResult plan;
  for (const char* id : {"a", "b", "c"}) plan.candidates.cameras.emplace_back().id = id;
  plan.rig.cameras = {plan.candidates.cameras[1], plan.candidates.cameras[0]};
  plan.moments = {"7", "9"};
  plan.options.views_needed = 4, plan.options.noise_px = 0.25;
  plan.options.viewing.max_facing_deg = 65, plan.options.viewing.min_pitch_px = 4.5;
  plan.steps.resize(2);
  plan.steps[0].camera = 1, plan.steps[0].coverage = 0.25, plan.steps[0].mean_views = 1;
  plan.steps[0].median_sigma_mm = std::nan("");
  plan.steps[1].camera = 0, plan.steps[1].coverage = 0.8125, plan.steps[1].mean_views = 2.5;
  plan.steps[1].median_sigma_mm = 0.125;
  for (int v = 0; v < 3000; ++v) plan.garment.rest.vertices_mm.emplace_back(v, 1, 2);
  plan.garment.rest.faces = {{0, 1, 2}};
  return plan;
}

TEST(RigPlan, TheMessageHoldsEveryStep) {
  const RigPlanResult plan = MadeUpPlan();
  EXPECT_EQ(RigPlanHeadline(plan), "2 of 3 cameras cover 81.2 % of the cells");
  v1::RigPlan message = RigPlanMessage(plan);
  EXPECT_EQ(message.template_hash(), plan.garment.ContentHash());
  EXPECT_EQ(message.candidates_hash(), plan.candidates.ContentHash());
  EXPECT_EQ(message.rig_hash(), plan.rig.ContentHash());
  message.clear_template_hash(), message.clear_candidates_hash(), message.clear_rig_hash();
  EXPECT_EQ(
      message.DebugString(),
      TextOf<v1::RigPlan>(
          R"( candidates: 3 moments: "7" moments: "9" max_facing_deg: 65 min_pitch_px: 4.5 views_needed: 4 noise_px:
0.25 steps { camera: "b" coverage: 0.25 mean_views: 1 } steps { camera: "a" coverage: 0.8125 mean_views:
2.5 median_sigma_mm: 0.125 } chosen: 2 verdict { grade: GRADE_GOOD reason: "2 of 3 cameras cover 81.2 %
of the cells" checks { id: "plan.coverage" name: "cells covered by the selected cameras" grade:
GRADE_GOOD value: "81.2 %" limits: "good from 75 %, usable from 50 %" } })"));
  v1::RigPlan read;
  ASSERT_TRUE(ParseJson(*ToJson(RigPlanMessage(plan)), "json", read).ok());
  EXPECT_EQ(read.rig_hash(), plan.rig.ContentHash());
}

TEST(RigPlan, ThePageShowsSomeOfTheVerticesAndEveryMap) {
  const std::string page = MakeRigPlanReport(MadeUpPlan());
  const auto drawn = MemberOf<v1::RigPlanPage>(page, "page");
  EXPECT_EQ(drawn.headline(), RigPlanHeadline(MadeUpPlan()));
  ASSERT_EQ(drawn.garment_mm_size(), 3 * 1500);
  EXPECT_EQ(drawn.garment_mm(3), 2);
  EXPECT_EQ(drawn.garment_mm(4), 1);
  EXPECT_EQ(MemberOf<v1::PageMaps>(page, "maps").maps_size(), 0) << "nothing was forecast";

  RigPlanResult small = MadeUpPlan();
  small.garment.rest.vertices_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 1}};
  small.forecast.coverage = {0.5, 1, 0}, small.forecast.views = {1, 2, 3};
  small.forecast.pitch_px = {4, 5, 6}, small.forecast.sigma_mm = {0.1, 0.2, 0.3};
  std::string lines;
  const auto maps = MemberOf<v1::PageMaps>(MakeRigPlanReport(small), "maps");
  for (const v1::PageMap& map : maps.maps())
    lines += map.title() + " | " + map.key().scale().label() + " | " + map.key().scale().unit() + " | " +
             std::to_string(map.key().scale().high()) + "\n";
  EXPECT_EQ(lines,
            "Share of the moments in which enough cameras see the cell | share | % | 100.000000\n"
            "Views of a cell, mean | views |  | 3.000000\n"
            "Pitch of the cell in the views that see it | pitch | px | 6.000000\n"
            "Expected sigma | sigma | mm | 0.300000\n");
}

}  // namespace
}  // namespace weft

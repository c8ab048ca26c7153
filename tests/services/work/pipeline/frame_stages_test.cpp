#include "services/work/pipeline/frame_stages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/stage_keys.h"
#include "tests/services/work/pipeline/filmed_take.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using FrameStagesTest = FilmedTakeTest;

TEST_F(FrameStagesTest, MeshesLieOnTheTruth) {
  for (const char* frame : {"0000", "0001", "0002"}) {
    const auto mesh = ReadRegisteredMesh(filmed_take->out + "/" + frame + "/mesh.ply");
    const auto truth = ReadMesh(filmed_take->take + "/truth/" + frame + "/mesh.ply");
    ASSERT_TRUE(mesh.ok() && truth.ok()) << mesh.status() << truth.status();
    ASSERT_EQ(mesh->vertices_mm.size(), truth->vertices_mm.size());
    double sum_mm = 0, count = 0;
    for (size_t v = 0; v < mesh->vertices_mm.size(); ++v) {
      if (mesh->state[v] != VertexState::kObserved) continue;
      sum_mm += (mesh->vertices_mm[v] - truth->vertices_mm[v]).norm();
      ++count;
    }
    EXPECT_GT(count, 500);
    EXPECT_LT(sum_mm / count, 0.3);
    EXPECT_EQ(count, ReportOf(filmed_take->out, frame).mesh().observed());
  }
}

TEST_F(FrameStagesTest, ReportsSayWhatWasComputedFromWhat) {
  const v1::FrameReport report = ReportOf(filmed_take->out);
  const auto inputs = LoadInputs(SpecOf(filmed_take->take));
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  EXPECT_EQ(report.frame(), "0000");
  EXPECT_EQ(report.inputs().rig(), (*inputs)->rig.ContentHash());
  EXPECT_EQ(report.inputs().board(), (*inputs)->hashes.board());
  EXPECT_EQ(report.inputs().garment(), (*inputs)->garment.ContentHash());
  EXPECT_TRUE(AreEqual(report.keys(), KeysOf((*inputs)->hashes, {})));
  EXPECT_EQ(report.images_fingerprint(), *FrameFingerprint(*(*inputs)->dump, 0, {}));
  EXPECT_FALSE(report.weft_version().empty());
  EXPECT_EQ(report.threads(), 2);
  EXPECT_GT(report.peak_memory_mib(), 10);
  EXPECT_LT(report.peak_memory_mib(), 100'000);
  EXPECT_THAT(StagesOf(report), ElementsAre("decode", "triangulate", "second pass", "align"));
  double stages_ms = 0;
  for (const v1::StageTime& stage : report.stages()) {
    EXPECT_GT(stage.time_ms(), 0) << stage.stage();
    stages_ms += stage.time_ms();
  }
  EXPECT_GE(report.total_ms(), stages_ms);
}

TEST_F(FrameStagesTest, ReportsCountWhatEachCameraSaw) {
  const v1::FrameReport report = ReportOf(filmed_take->out);
  EXPECT_EQ(report.views_used(), kFilming);
  EXPECT_EQ(report.views_missing(), 0);
  ASSERT_EQ(report.views_size(), kFilming);
  std::vector<std::string> hashes;
  for (int v = 0; v < kFilming; ++v) {
    const v1::ViewReport& view = report.views(v);
    EXPECT_EQ(view.camera(), "c0" + std::to_string(v));
    EXPECT_EQ(view.missing_reason(), "");
    EXPECT_GT(view.centers(), 50);
    EXPECT_GT(view.corners(), 50);
    EXPECT_GT(view.patches_accepted(), 0);
    EXPECT_GT(view.grey_levels(), 20);
    EXPECT_GT(view.read_ms(), 0);
    EXPECT_GT(view.bias().observations(), 50);
    EXPECT_LT(view.bias().rms_px(), 1);
    EXPECT_GT(view.vertices_seen(), 0);
    EXPECT_GE(view.vertices_in_view(), view.vertices_seen());
    EXPECT_EQ(view.moved_ms(), 0);
    hashes.push_back(view.image_hash());
  }
  std::ranges::sort(hashes);
  EXPECT_NE(hashes.front(), "");
  EXPECT_EQ(std::ranges::adjacent_find(hashes), hashes.end());
  EXPECT_GE(report.second_pass_rounds(), 1);
  EXPECT_LE(report.second_pass_rounds(), 3);
  EXPECT_GT(report.mesh().observed_at_first_look(), 300);
  EXPECT_LE(report.mesh().observed_at_first_look(), report.mesh().observed() + 20);
  EXPECT_NEAR(report.cloud().print_scale(), 1, 0.02);
  EXPECT_NEAR(report.cloud().template_scale(), 1, 0.02);
  EXPECT_FALSE(report.mesh().has_map_fits());
  EXPECT_FALSE(report.mesh().has_scan());
  EXPECT_EQ(report.mesh().unclaimed_points(), 0);
}

TEST_F(FrameStagesTest, OneCameraLessDegradesTheFrame) {
  const std::string take = TakeOfOwn();
  fs::copy(filmed_take->out, out_, fs::copy_options::recursive);
  WriteBytes(take + "/0000/c03.png", "no picture");
  const v1::FrameInfo info = RegisterOne(SpecOf(take));
  EXPECT_EQ(info.state(), v1::FRAME_STATE_DEGRADED);
  EXPECT_EQ(info.reason(), "1 of 10 cameras have no usable image");
  EXPECT_EQ(info.redone_from(), "decode");
  EXPECT_EQ(info.redone_because(), "its images, scan or start changed");
  const v1::FrameReport report = Report();
  EXPECT_EQ(report.views_used(), 9);
  EXPECT_EQ(report.views_missing(), 1);
  EXPECT_THAT(report.views(3).missing_reason(), HasSubstr("c03"));
  EXPECT_EQ(report.views(3).centers(), 0);
  EXPECT_EQ(report.views(3).vertices_seen(), 0);
  EXPECT_FALSE(report.views(3).has_bias());
  EXPECT_TRUE(report.views(4).has_bias());
}

TEST_F(FrameStagesTest, TooFewCamerasFailTheFrameAndTakeItsMesh) {
  const std::string take = TakeOfOwn();
  fs::copy(filmed_take->out, out_, fs::copy_options::recursive);
  for (int camera = 1; camera < kFilming; ++camera)
    fs::remove(take + "/0000/c0" + std::to_string(camera) + ".png");
  const v1::FrameInfo info = RegisterOne(SpecOf(take));
  EXPECT_EQ(info.state(), v1::FRAME_STATE_FAILED);
  EXPECT_THAT(info.reason(), HasSubstr("only 1 of 10 cameras have a usable image"));
  EXPECT_EQ(info.coverage(), 0);
  EXPECT_FALSE(fs::exists(out_ + "/0000/mesh.ply"));
  EXPECT_FALSE(fs::exists(out_ + "/0000/unrefined.ply"));
  EXPECT_EQ(ReadCloud(out_ + "/0000/cloud.ply")->points.size(), 0u);
}

TEST_F(FrameStagesTest, WithoutASecondPassThereIsNoSecondLook) {
  v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  spec.mutable_options()->set_single_pass(true);
  spec.mutable_options()->set_frames_alone(true);
  spec.mutable_options()->set_write_observations(true);
  RegisterOne(spec);
  const v1::FrameReport report = Report(), with = ReportOf(filmed_take->out);
  EXPECT_THAT(StagesOf(report), ElementsAre("decode", "triangulate", "align"));
  EXPECT_EQ(report.second_pass_rounds(), 0);
  EXPECT_EQ(report.mesh().observed_at_first_look(), 0);
  EXPECT_EQ(report.views(0).second_pass_found(), 0);
  // What the second look is said to have added is what a report without it lacks.
  for (int v = 0; v < kFilming; ++v)
    EXPECT_EQ(report.views(v).centers() + with.views(v).second_pass_found(), with.views(v).centers()) << v;
  EXPECT_GE(with.mesh().observed(), report.mesh().observed());
  // Frames that stand alone have no neighbours, and no mesh beside their own.
  EXPECT_FALSE(fs::exists(out_ + "/0000/unrefined.ply"));
  EXPECT_FALSE(report.has_temporal());
  const auto images = ReadObservations(out_ + "/0000/observations.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 10u);
  for (int v = 0; v < kFilming; ++v) {
    EXPECT_EQ((*images)[v].image, report.views(v).camera());
    EXPECT_EQ(static_cast<int>((*images)[v].observations.size()),
              report.views(v).centers() + report.views(v).corners());
  }
}

TEST_F(FrameStagesTest, AStartHasToBeAMeshOfTheTemplate) {
  v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  spec.mutable_options()->set_starts(filmed_take->out);
  EXPECT_EQ(RegisterOne(spec).state(), v1::FRAME_STATE_DONE);
  EXPECT_THAT(std::string(Register(spec, {0}, filmed_take->out).message()),
              HasSubstr("is the folder of the results"));
  TriangleMesh other = *ReadMesh(filmed_take->out + "/0000/mesh.ply");
  other.vertices_mm.emplace_back(0, 0, 0);
  fs::create_directories(root_ + "/starts/0000");
  ASSERT_TRUE(WriteMesh(root_ + "/starts/0000/mesh.ply", other).ok());
  spec.mutable_options()->set_starts(root_ + "/starts");
  const absl::Status status = Register(spec, {0}, root_ + "/other");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("starts/0000/mesh.ply"));
  EXPECT_FALSE(fs::exists(root_ + "/other/0000/report.json"));
}

TEST_F(FrameStagesTest, AScanIsToldOfInTheReport) {
  fs::create_directories(root_ + "/scans");
  fs::copy(filmed_take->take + "/truth/0000/mesh.ply", root_ + "/scans/0000.ply");
  v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  spec.mutable_options()->set_scans(root_ + "/scans");
  RegisterOne(spec);
  const v1::ScanReport scan = Report().mesh().scan();
  EXPECT_EQ(scan.points(), Report().mesh().vertices());
  EXPECT_GT(scan.found(), 500);
  EXPECT_LT(scan.median_distance_mm(), 2);
}

TEST_F(FrameStagesTest, CellsThatTheTemplateLacksExplainWhyItFails) {
  auto inputs = LoadInputs(SpecOf(filmed_take->take));
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  std::vector<VertexNode>& nodes = (*inputs)->garment.node_of_vertex;
  for (size_t v = 2; v < nodes.size(); ++v) nodes[v] = {};
  v1::FrameInfo told;
  RegistrationEvents events;
  events.finished = [&](const v1::FrameInfo& info) { told = info; };
  ASSERT_TRUE(RegisterFrames(**inputs, {0, 1, 2}, {0}, {}, out_, {}, events, {}).ok());
  EXPECT_EQ(told.state(), v1::FRAME_STATE_FAILED);
  const int centers = Report().cloud().centers();
  EXPECT_GT(centers, 200);
  EXPECT_THAT(told.reason(), AllOf(HasSubstr(" of the " + std::to_string(centers) + " cells"),
                                   HasSubstr("template of another part of the board")));
  EXPECT_EQ(Report().second_pass_rounds(), 0) << "there is no mesh to look by";
}

}  // namespace
}  // namespace weft

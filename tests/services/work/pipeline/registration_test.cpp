// A small take from its pictures to its meshes, in one go and in several.
#include "services/work/pipeline/registration.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/pipeline/filmed_take.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using RegistrationTest = FilmedTakeTest;

TEST_F(RegistrationTest, TellsOfEachFrameInItsOrder) {
  EXPECT_THAT(filmed_take->told,
              ElementsAre("started 0000", "reads 0", "finished 0000", "started 0001", "reads 1",
                          "finished 0001", "started 0002", "reads 2", "finished 0002"));
  for (const auto& [frame, shares] : filmed_take->shares) {
    EXPECT_TRUE(std::ranges::is_sorted(shares));
    EXPECT_GE(shares.size(), 6u);
    EXPECT_EQ(shares.back(), 1);
    EXPECT_GT(shares.front(), 0);
    EXPECT_LE(shares.front(), 0.5);
    EXPECT_TRUE(std::ranges::any_of(shares, [](double s) { return s > 0.84 && s < 0.86; })) << "decoded";
  }
  for (const v1::FrameInfo& info : filmed_take->infos) {
    EXPECT_EQ(info.state(), v1::FRAME_STATE_DONE);
    EXPECT_EQ(info.reason(), "");
    EXPECT_FALSE(info.reused());
    EXPECT_EQ(info.redone_from(), "");
    EXPECT_EQ(info.share_done(), 1);
    EXPECT_GT(info.coverage(), 0.4);
    EXPECT_GT(info.total_ms(), 0);
  }
}

TEST_F(RegistrationTest, FilesAreThoseOfTheReport) {
  const auto folder = FrameFolder::Open(filmed_take->out, "0001", ConfinedFolder::IfMissing::kFail);
  ASSERT_TRUE(folder.ok()) << folder.status();
  const auto report = folder->Report();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(folder->CheckAll(*report), "");
  std::vector<std::string> names;
  for (const v1::ResultFile& file : report->files()) names.push_back(file.name());
  std::ranges::sort(names);
  EXPECT_THAT(names, ElementsAre("cloud.ply", "mesh.ply", "unrefined.ply"));
  const auto cloud = ReadCloud(folder->PathOf(FrameFile::kCloud));
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(static_cast<int>(cloud->points.size()), report->cloud().centers() + report->cloud().corners());
  EXPECT_FALSE(cloud->points[0].covariance_mm2.isZero());
  // The frame between two others follows them.
  EXPECT_TRUE(report->temporal().refined());
  EXPECT_THAT(report->temporal().neighbors(), ElementsAre("0000", "0002"));
  const auto is_refined = [](const std::string& frame) {
    const std::string path = filmed_take->out + "/" + frame;
    return ReadRegisteredMesh(path + "/mesh.ply")->vertices_mm !=
           ReadRegisteredMesh(path + "/unrefined.ply")->vertices_mm;
  };
  EXPECT_TRUE(is_refined("0001"));
  EXPECT_FALSE(is_refined("0000")) << "it has one neighbour";
}

TEST_F(RegistrationTest, WholeFramesAreKeptAndNotReadAgain) {
  fs::copy(filmed_take->out, out_, fs::copy_options::recursive);
  const std::string before = Bytes("report.json");
  std::vector<v1::FrameInfo> infos;
  RegistrationEvents events;
  events.reads = [](size_t) { return absl::InternalError("reads"); };
  events.advanced = [](const std::string&, double) { ADD_FAILURE() << "advanced"; };
  events.finished = [&](const v1::FrameInfo& info) { infos.push_back(info); };
  const absl::Status status = Register(SpecOf(filmed_take->take), {0, 1, 2}, out_, events);
  ASSERT_TRUE(status.ok()) << status;
  ASSERT_EQ(infos.size(), 3u);
  EXPECT_TRUE(infos[2].reused());
  EXPECT_EQ(infos[2].frame(), "0002");
  EXPECT_EQ(infos[2].coverage(), filmed_take->infos[2].coverage());
  EXPECT_EQ(Bytes("report.json"), before);
  // A frame whose images have to be read is up to the caller.
  fs::remove(out_ + "/0000/cloud.ply");
  EXPECT_EQ(Register(SpecOf(filmed_take->take), {0}, out_, events).message(), "reads");
}

TEST_F(RegistrationTest, OtherOptionsOfTheAlignmentKeepTheCloud) {
  fs::copy(filmed_take->out, out_, fs::copy_options::recursive);
  v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  spec.mutable_options()->mutable_pipeline()->mutable_alignment()->set_continuation_rings(1);
  const v1::FrameInfo info = RegisterOne(spec);
  EXPECT_FALSE(info.reused());
  EXPECT_EQ(info.redone_from(), "align");
  EXPECT_EQ(info.redone_because(), "align has other options");
  const v1::FrameReport before = ReportOf(filmed_take->out), report = Report();
  EXPECT_THAT(StagesOf(report), ElementsAre("decode", "triangulate", "second pass", "align"));
  EXPECT_EQ(report.stages(0).time_ms(), before.stages(0).time_ms());
  EXPECT_NE(report.stages(3).time_ms(), before.stages(3).time_ms());
  double total_ms = 0;
  for (const v1::StageTime& stage : report.stages()) total_ms += stage.time_ms();
  EXPECT_NEAR(report.total_ms(), total_ms, 1e-6);
  EXPECT_TRUE(Bytes("cloud.ply") == Filed("0000/cloud.ply"));
  EXPECT_EQ(report.mesh().observed_at_first_look(), before.mesh().observed_at_first_look());
  EXPECT_EQ(report.views(0).vertices_in_view(), 0) << "of a mesh that is no more";
  EXPECT_EQ(report.views(0).vertices_seen(), 0);
  EXPECT_EQ(report.state(), v1::FRAME_STATE_DONE);
  // As from the pictures.
  const std::string again = root_ + "/again";
  ASSERT_TRUE(Register(spec, {0}, again).ok());
  EXPECT_TRUE(ReadBytes(again + "/0000/unrefined.ply") == Bytes("unrefined.ply"));
}

TEST_F(RegistrationTest, TheSameWithAnyThreadsAndWithoutKeptPictures) {
  const std::string mesh = Filed("0000/unrefined.ply"), cloud = Filed("0000/cloud.ply");
  RegisterOne(SpecOf(filmed_take->take), {.threads = 1, .kept_image_mib = 0});
  EXPECT_EQ(Report().threads(), 1);
  EXPECT_TRUE(Bytes("unrefined.ply") == mesh);
  EXPECT_TRUE(Bytes("cloud.ply") == cloud);
}

TEST_F(RegistrationTest, StopsBeforeAndWithinAFrame) {
  std::stop_source stop;
  RegistrationEvents events;
  events.advanced = [&](const std::string&, double) { stop.request_stop(); };
  std::vector<std::string> started;
  events.started = [&](const std::string& frame) { started.push_back(frame); };
  const v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  EXPECT_EQ(Register(spec, {0, 1}, out_, events, {}, stop.get_token()).code(), absl::StatusCode::kCancelled);
  EXPECT_THAT(started, ElementsAre("0000"));
  EXPECT_FALSE(fs::exists(out_ + "/0000/report.json"));
  started.clear();
  EXPECT_EQ(Register(spec, {0, 1}, out_, events, {}, stop.get_token()).code(), absl::StatusCode::kCancelled);
  EXPECT_THAT(started, IsEmpty());
}

TEST_F(RegistrationTest, InputsAreCheckedAgainstEachOther) {
  const auto why_not = [](auto&& change) {
    v1::RegistrationSpec spec = SpecOf(filmed_take->take);
    change(spec);
    return std::string(LoadInputs(spec).status().message());
  };
  EXPECT_EQ(why_not([](auto&) {}), "");
  EXPECT_THAT(why_not([](auto& spec) { spec.clear_out(); }), HasSubstr("spec.out is empty"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_options()->set_cloud_format("xyz"); }),
              HasSubstr("\"xyz\" is neither ply nor pcd"));
  EXPECT_EQ(why_not([](auto& spec) { spec.mutable_options()->set_cloud_format("ply"); }), "");
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_expected()->set_rig("0123"); }),
              HasSubstr("/rig.json: the rig has hash "));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_expected()->set_board("0123"); }),
              HasSubstr("/board.json: the board has hash "));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_expected()->set_garment("0123"); }),
              AllOf(HasSubstr("/template: the template has hash "), HasSubstr("made with hash 0123"),
                    HasSubstr("submit the job again")));
  const auto inputs = LoadInputs(SpecOf(filmed_take->take));
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  EXPECT_THAT((*inputs)->warnings, IsEmpty());
  EXPECT_EQ((*inputs)->neighborhoods.size(), (*inputs)->garment.rest.vertices_mm.size());
  EXPECT_FALSE((*inputs)->texture.empty());
}

TEST_F(RegistrationTest, FramesWithoutAScanAreWarnedOf) {
  fs::create_directories(root_ + "/scans");
  WriteBytes(root_ + "/scans/0001.ply", "x");
  v1::RegistrationSpec spec = SpecOf(filmed_take->take);
  spec.mutable_options()->set_scans(root_ + "/scans");
  const auto inputs = LoadInputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  ASSERT_TRUE(AddExtraWarnings(spec, {0, 1}, **inputs).ok());
  EXPECT_THAT((*inputs)->warnings, ElementsAre(root_ + "/scans: 1 of 2 frames have no scan: 0000"));
  EXPECT_EQ(AddExtraWarnings(spec, {0, 2}, **inputs).code(), absl::StatusCode::kInvalidArgument);
  spec.set_live_every(1);
  EXPECT_TRUE(AddExtraWarnings(spec, {0, 2}, **inputs).ok()) << "they may come";
}

// A report without what differs from run to run.
std::string LastingText(v1::FrameReport report) {
  for (v1::ViewReport& view : *report.mutable_views()) {
    view.clear_read_ms(), view.clear_lattice_ms(), view.clear_colors_ms(), view.clear_growth_ms();
    view.clear_refinement_ms(), view.clear_second_pass_ms(), view.clear_image_hash();
  }
  for (v1::AlignmentStage& stage : *report.mutable_mesh()->mutable_stages()) stage.clear_time_ms();
  for (v1::StageTime& stage : *report.mutable_stages()) stage.clear_time_ms();
  report.mutable_temporal()->clear_window(), report.mutable_temporal()->clear_time_ms();
  report.clear_total_ms(), report.clear_peak_memory_mib(), report.clear_weft_version();
  report.clear_images_fingerprint(), report.clear_inputs(), report.clear_options(), report.clear_keys();
  report.clear_files();
  std::string text;
  EXPECT_TRUE(google::protobuf::TextFormat::PrintToString(report, &text));
  return text;
}

// Of chains of solvers that end at a tolerance.
constexpr double kOfSolvers = 1e-5;

TEST_F(RegistrationTest, ReportsStayAsTheyAre) {
  for (const char* frame : {"0000", "0001"})
    ExpectRecorded(LastingText(ReportOf(filmed_take->out, frame)), std::string(".") + frame, kOfSolvers);
}

TEST_F(RegistrationTest, CloudsAndMeshesStayAsTheyAre) {
  Recorded recorded;
  for (const char* frame : {"0000", "0001"}) {
    const std::string path = filmed_take->out + "/" + frame;
    const auto cloud = ReadCloud(path + "/cloud.ply");
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    std::vector<Eigen::Vector3d> points_mm;
    std::vector<double> sigmas_mm;
    for (const CloudPoint& point : cloud->points) {
      points_mm.push_back(point.position_mm);
      sigmas_mm.push_back(point.sigma_mm);
    }
    recorded.Add("points_mm", points_mm);
    recorded.Add("sigmas_mm", sigmas_mm);
    for (const char* file : {"/mesh.ply", "/unrefined.ply"}) {
      const auto mesh = ReadRegisteredMesh(path + file);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      recorded.Add(std::string("vertices_mm of ") + file, mesh->vertices_mm);
      recorded.Add(std::string("sigma_mm of ") + file, mesh->sigma_mm);
    }
  }
  recorded.Expect(kOfSolvers);
}

}  // namespace
}  // namespace weft

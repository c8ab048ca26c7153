#include "services/work/job/split_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

constexpr int kCols = 3, kShirtRow = 10;

// A flat piece of two rows of cells.
void AddSheet(const std::string& id, int first_row, Template& to) {
  const int first = static_cast<int>(to.rest.vertices_mm.size());
  to.garments.push_back({id, first, 2 * kCols, static_cast<int>(to.rest.faces.size()), 2 * (kCols - 1)});
  for (int row = 0; row < 2; ++row)
    for (int col = 0; col < kCols; ++col) {
      to.rest.vertices_mm.emplace_back(5 * col, 5 * row, first_row);
      to.node_of_vertex.push_back({first_row + row, col, NodeKind::kCenter});
    }
  for (int v = first; v + 1 < first + kCols; ++v) {
    to.rest.faces.push_back({v, v + kCols, v + 1});
    to.rest.faces.push_back({v + 1, v + kCols, v + kCols + 1});
  }
}

CloudPoint PointOf(const BoardNode& node, double sigma_mm) {
  CloudPoint point;
  point.node = node, point.views = 4, point.sigma_mm = sigma_mm;
  point.position_mm = Eigen::Vector3d(node.col, node.row, 1);
  return point;
}

class SplitJobTest : public ::testing::Test {
 protected:
  SplitJobTest() {
    joint_.id = "outfit";
    joint_.board_hash = "fedcba9876543210";
    AddSheet("skirt", 0, joint_);
    AddSheet("shirt", kShirtRow, joint_);
    EXPECT_TRUE(WriteTemplate(root_ + "/joint", joint_).ok());
    job_.set_id("j-1");
    job_.set_state(v1::JOB_STATE_DONE);
    job_.mutable_spec()->set_garment(root_ + "/joint");
    job_.mutable_spec()->mutable_expected()->set_garment("as the user expects");
    job_.mutable_inputs()->set_garment(joint_.ContentHash());
    job_.mutable_inputs()->set_board("fedcba9876543210");
    job_.mutable_verdict()->set_grade(v1::GRADE_BAD);
    job_.mutable_usage()->set_tasks(3);
    WriteRegistered();
    WriteFailed();
    WriteJob();
  }

  void WriteJob() { ASSERT_TRUE(WriteJsonFile(result_ + "/job.json", job_).ok()); }
  FrameFolder Folder(const std::string& name) const {
    return FrameFolder::Open(result_, name, ConfinedFolder::IfMissing::kMake).value();
  }
  v1::FrameReport ReportOf(const std::string& name) const {
    v1::FrameReport report;
    report.set_frame(name);
    *report.mutable_inputs() = job_.inputs();
    return report;
  }
  void WriteMesh(int vertices, v1::FrameReport& report) {
    RegisteredMesh mesh;
    for (int v = 0; v < vertices; ++v) {
      mesh.vertices_mm.emplace_back(v, 100, 0);
      mesh.state.push_back(v == 7 || v == 8 ? VertexState::kObserved
                           : v == 9         ? VertexState::kTwoView
                                            : VertexState::kInferred);
      mesh.sigma_mm.push_back(0.25f * static_cast<float>(v));
      mesh.views.push_back(v % 5);
    }
    const std::vector<Face> faces = vertices == 12 ? joint_.rest.faces : std::vector<Face>{{0, 3, 1}};
    ASSERT_TRUE(Folder(report.frame())
                    .Put(
                        FrameFile::kMesh,
                        [&](const std::string& path) { return WriteRegisteredMesh(path, mesh, faces); },
                        report)
                    .ok());
  }
  void WriteRegistered() {
    v1::FrameReport report = ReportOf("0001");
    report.set_state(v1::FRAME_STATE_DEGRADED);
    report.set_reason("one camera is dark");
    report.set_images_fingerprint("0123");
    report.set_weft_version("7.0.0");
    report.mutable_options()->set_preset("paper");
    report.mutable_temporal()->set_refined(true);
    report.mutable_temporal()->set_time_ms(12);
    report.add_views()->set_camera("cam1");
    Cloud cloud;
    cloud.points = {PointOf({0, 0}, 0.5), PointOf({kShirtRow, 1}, 0.25),
                    PointOf({2, 0, NodeKind::kCorner}, 0.75),
                    PointOf({kShirtRow + 2, 1, NodeKind::kCorner}, 1)};
    for (const int row : {1, kShirtRow + 1}) {
      CloudRay ray;
      ray.node = {row, 2};
      cloud.rays.push_back(ray);
    }
    const auto write_cloud = [&](const std::string& path) {
      return WriteCloud(path, cloud, CloudColumns::kWithCovariance);
    };
    ASSERT_TRUE(Folder("0001").Put(FrameFile::kCloud, write_cloud, report).ok());
    const std::vector<ImageObservations> images = {{"cam1", {{1, 2, {0, 1}}, {3, 4, {kShirtRow, 2}}}},
                                                   {"cam2", {{5, 6, {kShirtRow + 1, 0}}}}};
    const auto write_observations = [&](const std::string& path) { return WriteObservations(path, images); };
    ASSERT_TRUE(Folder("0001").Put(FrameFile::kObservations, write_observations, report).ok());
    WriteMesh(12, report);
    ASSERT_TRUE(Folder("0001").Commit(report).ok());
  }
  void WriteFailed() {
    v1::FrameReport report = ReportOf("0002");
    report.set_state(v1::FRAME_STATE_FAILED);
    report.set_reason("dark");
    ASSERT_TRUE(Folder("0002").Commit(report).ok());
  }
  absl::StatusOr<std::vector<SplitGarment>> Split() { return SplitJob(result_, out_, {}, {}); }
  std::string WhyNot() { return std::string(Split().status().message()); }

  const TempFolder temp_;
  const std::string root_ = std::filesystem::canonical(temp_.path()).string();
  const std::string result_ = root_ + "/result", out_ = root_ + "/split";
  Template joint_;
  v1::Job job_;
};

TEST_F(SplitJobTest, EachGarmentGetsAResultOfItsOwn) {
  std::vector<std::pair<int, int>> told;
  const auto done = SplitJob(result_, out_, [&](int k, int all) { told.emplace_back(k, all); }, {});
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_THAT(told, ElementsAre(Pair(1, 4), Pair(2, 4), Pair(3, 4), Pair(4, 4)));
  ASSERT_EQ(done->size(), 2u);
  EXPECT_EQ((*done)[0].id, "skirt");
  EXPECT_EQ((*done)[1].id, "shirt");
  EXPECT_EQ((*done)[1].result, out_ + "/shirt");
  EXPECT_EQ((*done)[1].frames, 1);
  const auto garment = ReadTemplate(out_ + "/shirt/template");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "shirt");
  EXPECT_EQ(garment->board_hash, joint_.board_hash);
  ASSERT_EQ(garment->node_of_vertex.size(), 6u);
  EXPECT_EQ(garment->node_of_vertex[0].row, kShirtRow);
  EXPECT_EQ(garment->node_of_vertex[5].col, 2);
  EXPECT_EQ(garment->rest.vertices_mm[0].z(), kShirtRow);
  EXPECT_EQ(garment->rest.faces[0], (Face{0, 3, 1}));
  v1::Job job;
  ASSERT_TRUE(ReadJsonFile(out_ + "/shirt/job.json", job).ok());
  EXPECT_EQ(job.id(), "j-1");
  EXPECT_EQ(job.spec().garment(), out_ + "/shirt/template");
  EXPECT_EQ(job.spec().out(), out_ + "/shirt");
  EXPECT_EQ(job.spec().expected().garment(), "");
  EXPECT_EQ(job.inputs().garment(), garment->ContentHash());
  EXPECT_EQ(job.inputs().board(), joint_.board_hash);
  EXPECT_FALSE(job.has_verdict());
  EXPECT_FALSE(job.has_usage());
}

TEST_F(SplitJobTest, FramesHoldWhatIsOfTheGarment) {
  ASSERT_TRUE(Split().ok());
  const FrameFolder folder =
      FrameFolder::Open(out_ + "/shirt", "0001", ConfinedFolder::IfMissing::kFail).value();
  const auto report = folder.Report();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(folder.CheckAll(*report), "");
  EXPECT_EQ(report->files_size(), 3);
  EXPECT_EQ(report->frame(), "0001");
  EXPECT_EQ(report->state(), v1::FRAME_STATE_DEGRADED);
  EXPECT_EQ(report->reason(), "one camera is dark");
  EXPECT_EQ(report->images_fingerprint(), "0123");
  EXPECT_EQ(report->weft_version(), "7.0.0");
  EXPECT_EQ(report->options().preset(), "paper");
  EXPECT_EQ(report->inputs().garment(), ReadTemplate(out_ + "/shirt/template")->ContentHash());
  EXPECT_TRUE(report->temporal().refined());
  EXPECT_FALSE(report->temporal().bridged());
  EXPECT_EQ(report->temporal().time_ms(), 0);
  EXPECT_EQ(report->views_size(), 0);
  EXPECT_EQ(report->cloud().centers(), 1);
  EXPECT_EQ(report->cloud().corners(), 1);
  EXPECT_EQ(report->mesh().vertices(), 6);
  EXPECT_EQ(report->mesh().observed(), 2);
  EXPECT_EQ(report->mesh().two_view(), 1);

  const auto cloud = ReadCloud(folder.PathOf(FrameFile::kCloud));
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->points.size(), 2u);
  EXPECT_EQ(cloud->points[0].node, (BoardNode{kShirtRow, 1}));
  EXPECT_EQ(cloud->points[1].node, (BoardNode{kShirtRow + 2, 1, NodeKind::kCorner}));
  ASSERT_EQ(cloud->rays.size(), 1u);
  EXPECT_EQ(cloud->rays[0].node.row, kShirtRow + 1);
  const auto images = ReadObservations(folder.PathOf(FrameFile::kObservations));
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2u);
  ASSERT_EQ((*images)[0].observations.size(), 1u);
  EXPECT_EQ((*images)[0].observations[0].x_px, 3);
  const auto mesh = ReadRegisteredMesh(folder.PathOf(FrameFile::kMesh));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->vertices_mm.size(), 6u);
  EXPECT_EQ(mesh->vertices_mm[0].x(), 6);
  EXPECT_EQ(mesh->state[1], VertexState::kObserved);
  EXPECT_EQ(mesh->sigma_mm[5], 2.75f);
}

TEST_F(SplitJobTest, AFailedFrameHasItsReasonAndNoFiles) {
  ASSERT_TRUE(Split().ok());
  v1::FrameReport report;
  ASSERT_TRUE(ReadJsonFile(out_ + "/skirt/0002/report.json", report).ok());
  EXPECT_EQ(report.state(), v1::FRAME_STATE_FAILED);
  EXPECT_EQ(report.reason(), "dark");
  EXPECT_EQ(report.files_size(), 0);
  EXPECT_FALSE(report.has_cloud());
  EXPECT_FALSE(report.has_mesh());
}

TEST_F(SplitJobTest, ReplacesItsOwnResultAndNoOther) {
  ASSERT_TRUE(Split().ok());
  WriteBytes(out_ + "/skirt/0002/mesh.ply", "of an earlier run");
  ASSERT_TRUE(Split().ok());
  EXPECT_FALSE(std::filesystem::exists(out_ + "/skirt/0002/mesh.ply"));
  job_.set_id("j-2");
  WriteJob();
  EXPECT_EQ(Split().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr(out_ + "/skirt: "), HasSubstr("another job"), HasSubstr("--out")));
  WriteBytes(out_ + "/skirt/job.json", "{broken");
  EXPECT_THAT(WhyNot(), HasSubstr("another job"));
}

TEST_F(SplitJobTest, RefusesWhatCanNotBeSplit) {
  job_.set_state(v1::JOB_STATE_RUNNING);
  WriteJob();
  EXPECT_EQ(Split().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr(result_ + "/job.json"), HasSubstr("has not ended well")));
  job_.set_state(v1::JOB_STATE_DONE);
  job_.mutable_inputs()->set_garment("0000000000000000");
  WriteJob();
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr(joint_.ContentHash()), HasSubstr("0000000000000000")));
  EXPECT_EQ(Split().status().code(), absl::StatusCode::kFailedPrecondition);
  joint_.garments.clear();
  ASSERT_TRUE(WriteTemplate(root_ + "/joint", joint_).ok());
  job_.mutable_inputs()->set_garment(joint_.ContentHash());
  WriteJob();
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("outfit is of one garment"), HasSubstr("weft template join")));
  EXPECT_FALSE(std::filesystem::exists(out_));
  std::filesystem::remove(result_ + "/job.json");
  EXPECT_EQ(Split().status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SplitJobTest, AMeshOfFewerVerticesThanTheTemplateIsNamed) {
  v1::FrameReport report = ReportOf("0001");
  WriteMesh(11, report);
  ASSERT_TRUE(Folder("0001").Commit(report).ok());
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr(result_ + "/0001/mesh.ply"), HasSubstr("has 11 vertices")));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/shirt/job.json"));
}

TEST_F(SplitJobTest, StopsBetweenFramesWithoutAJobFile) {
  std::stop_source stop;
  const absl::Status status = SplitJob(
                                  result_, out_, [&](int, int) { stop.request_stop(); }, stop.get_token())
                                  .status();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/skirt/0001/report.json"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/skirt/0002/report.json"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/skirt/job.json"));
}

}  // namespace
}  // namespace weft

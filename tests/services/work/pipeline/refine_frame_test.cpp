#include "services/work/pipeline/refine_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/stage_keys.h"
#include "tests/alignment/cloth_sheets.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

constexpr int kSide = 14;

// Frames by name alone; refinement never looks at images.
class NamedFrames : public FrameSource {
 public:
  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<Frame> ReadView(size_t, size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<std::string> Fingerprint(size_t) const override {
    return absl::OutOfRangeError("no images");
  }
  const std::vector<std::string>& warnings() const override { return warnings_; }

 private:
  const std::vector<std::string> names_ = {"f0", "f1", "f2", "f3", "f4"};
  const std::vector<std::string> warnings_;
};

RegistrationInputs SheetInputs() {
  RegistrationInputs inputs;
  inputs.garment = testing::SheetTemplate(testing::FlatSheet(kSide, kSide));
  for (int v = 0; v < kSide * kSide; ++v) inputs.garment.node_of_vertex[v] = {v / kSide, v % kSide};
  inputs.model = std::make_unique<AlignmentModel>(inputs.garment);
  inputs.dump = std::make_unique<NamedFrames>();
  return inputs;
}

// A sheet that moves evenly; its middle is hidden, and off by a wave that differs from frame to frame.
RegisteredMesh MeshAt(const RegistrationInputs& inputs, int frame) {
  RegisteredMesh mesh;
  for (const Eigen::Vector3d& p : inputs.garment.rest.vertices_mm) {
    const int v = static_cast<int>(mesh.vertices_mm.size());
    const bool hidden = std::hypot(v / kSide - kSide / 2, v % kSide - kSide / 2) < 4;
    const double wave_mm = hidden ? std::sin(0.4 * v + 2.1 * frame) : 0;
    mesh.vertices_mm.push_back(testing::Rolled(p, 60) + Eigen::Vector3d(4 * frame, -3 * frame, wave_mm));
    mesh.state.push_back(hidden ? VertexState::kInferred : VertexState::kObserved);
    mesh.views.push_back(hidden ? 0 : 5);
    mesh.sigma_mm.push_back(hidden ? 1.5f : 0.05f);
  }
  return mesh;
}

// The results of a job of five frames, as its workers leave them.
class RefineAroundTest : public ::testing::Test {
 protected:
  void Report(int frame, v1::FrameState state, const std::string& preset, const std::string& images) {
    v1::FrameReport report;
    report.set_frame(Name(frame));
    report.set_state(state);
    report.set_images_fingerprint(images);
    report.mutable_options()->set_preset(preset);
    *report.mutable_keys() = KeysOf({}, report.options());
    const auto folder = FrameFolder::Open(folder_.path(), Name(frame), ConfinedFolder::IfMissing::kMake);
    ASSERT_TRUE(folder.ok()) << folder.status();
    const auto write = [&](const std::string& path) {
      return WriteRegisteredMesh(path, MeshAt(inputs_, frame), inputs_.garment.rest.faces);
    };
    if (state != v1::FRAME_STATE_FAILED) {
      for (const FrameFile file : {FrameFile::kUnrefined, FrameFile::kMesh})
        ASSERT_TRUE(folder->Put(file, write, report).ok());
      const auto write_cloud = [&](const std::string& path) { return WriteCloud(path, cloud_); };
      ASSERT_TRUE(folder->Put(FrameFile::kCloud, write_cloud, report).ok());
    }
    ASSERT_TRUE(folder->Commit(report).ok());
  }
  void Register(int frame, const std::string& preset = "best") {
    Report(frame, v1::FRAME_STATE_DONE, preset, "images");
  }
  void Fail(int frame, const std::string& images = "images") {
    std::filesystem::remove_all(folder_ / Name(frame));
    std::filesystem::create_directories(folder_ / Name(frame));
    Report(frame, v1::FRAME_STATE_FAILED, "best", images);
  }
  absl::Status Refine(int at, std::stop_token stop = {}) {
    return RefineAround(inputs_, job_frames_, StepsOf(inputs_, job_frames_), static_cast<size_t>(at), {},
                        folder_.path(), std::move(stop));
  }
  // Deals with frames in this order; those of `failed` fail.
  void Run(const std::vector<int>& order, const std::vector<int>& failed) {
    for (const int frame : order) {
      std::count(failed.begin(), failed.end(), frame) > 0 ? Fail(frame) : Register(frame);
      const absl::Status status = Refine(frame);
      ASSERT_TRUE(status.ok()) << status;
    }
  }

  static std::string Name(int frame) { return "f" + std::to_string(frame); }
  std::string File(int frame, const std::string& name) const { return folder_ / (Name(frame) + "/" + name); }
  v1::TemporalReport Temporal(int frame) const {
    v1::FrameReport report;
    EXPECT_TRUE(ReadJsonFile(File(frame, "report.json"), report).ok());
    return report.temporal();
  }
  bool SameAsAlone(int frame) const {
    return ReadBytes(File(frame, "mesh.ply")) == ReadBytes(File(frame, "unrefined.ply"));
  }
  std::vector<std::string> Meshes() const {
    std::vector<std::string> meshes;
    for (int frame = 0; frame < 5; ++frame) meshes.push_back(ReadBytes(File(frame, "mesh.ply")));
    return meshes;
  }

  const TempFolder folder_;
  const RegistrationInputs inputs_ = SheetInputs();
  const std::vector<size_t> job_frames_ = {0, 1, 2, 3, 4};
  Cloud cloud_;  // of the frames that are registered next
};

TEST_F(RefineAroundTest, RefinesAFrameOnceBothNeighboursAreThere) {
  Run({0, 1}, {});
  EXPECT_TRUE(SameAsAlone(1));
  Run({2}, {});
  EXPECT_FALSE(SameAsAlone(1));
  EXPECT_TRUE(Temporal(1).refined());
  EXPECT_THAT(Temporal(1).neighbors(), ElementsAre("f0", "f2"));
  EXPECT_TRUE(SameAsAlone(0));  // the first of the job
  EXPECT_TRUE(SameAsAlone(2));  // the next is not there yet
}

// Of the vertex in the sheet's middle.
TEST_F(RefineAroundTest, VerticesOnARayOfTheirFrameStayThere) {
  constexpr int kMiddle = kSide / 2 * kSide + kSide / 2;
  const Eigen::Vector3d there_mm = MeshAt(inputs_, 1).vertices_mm[kMiddle];
  const auto way_mm = [&] {
    const auto mesh = ReadRegisteredMesh(File(1, "mesh.ply"));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    const Eigen::Vector3d way = mesh->vertices_mm[kMiddle] - there_mm;
    return std::hypot(way.y(), way.z());
  };
  Run({0, 1, 2}, {});
  EXPECT_GT(way_mm(), 0.1);
  cloud_.rays = {{{kSide / 2, kSide / 2}, there_mm - Eigen::Vector3d(1000, 0, 0), {1, 0, 0}, 1e-5}};
  Run({1, 2}, {});
  EXPECT_LT(way_mm(), 0.01);
}

TEST_F(RefineAroundTest, EndsWithTheSameFilesInAnyOrderAndAtAnyThreadCount) {
  Run({0, 1, 2, 3, 4}, {3});
  const std::vector<std::string> in_order = Meshes();
  EXPECT_THAT(in_order, Each(::testing::Not(::testing::IsEmpty())));
  const tbb::global_control more_than_cores(tbb::global_control::max_allowed_parallelism, 4);
  for (const int threads : {1, 2, 4}) {
    for (int frame = 0; frame < 5; ++frame) std::filesystem::remove_all(folder_ / Name(frame));
    tbb::task_arena(threads).execute([&] { Run({4, 1, 3, 0, 2}, {3}); });
    EXPECT_EQ(Meshes(), in_order) << threads;
  }
}

TEST_F(RefineAroundTest, BridgesFailedFramesBetweenRegisteredOnes) {
  Run({0, 1, 2, 3, 4}, {1, 2, 4});
  for (const int frame : {1, 2}) {
    EXPECT_TRUE(WasBridged(folder_.path(), Name(frame)));
    EXPECT_THAT(Temporal(frame).neighbors(), ElementsAre("f0", "f3"));
    const auto mesh = ReadRegisteredMesh(File(frame, "mesh.ply"));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_THAT(mesh->state, Each(VertexState::kBridged));
  }
  // Nothing lies beyond the last frame.
  EXPECT_FALSE(WasBridged(folder_.path(), Name(4)));
  EXPECT_FALSE(std::filesystem::exists(File(4, "mesh.ply")));
  EXPECT_FALSE(WasBridged(folder_.path(), Name(0)));
  EXPECT_FALSE(WasBridged(folder_.path(), "no such frame"));
}

TEST_F(RefineAroundTest, TakesABridgeBackWhenItsEndFailsInALaterRun) {
  Run({0, 1, 2}, {1});
  ASSERT_TRUE(WasBridged(folder_.path(), Name(1)));
  for (const int frame : {2, 3, 4}) Fail(frame, "other images");
  ASSERT_TRUE(Refine(2).ok());
  EXPECT_FALSE(WasBridged(folder_.path(), Name(1)));
  EXPECT_FALSE(std::filesystem::exists(File(1, "mesh.ply")));
}

TEST_F(RefineAroundTest, NeighboursOfAnotherRunDoNotCount) {
  Register(0);
  Register(2, "paper");
  Run({1}, {});
  EXPECT_TRUE(SameAsAlone(1));
  EXPECT_FALSE(Temporal(1).refined());
  Run({2}, {});
  EXPECT_FALSE(SameAsAlone(1));
}

TEST_F(RefineAroundTest, LeavesRefinedFramesThatNothingChangedAround) {
  Run({0, 1, 2}, {});
  const auto written = std::filesystem::last_write_time(File(1, "report.json"));
  ASSERT_TRUE(Refine(2).ok());
  EXPECT_EQ(std::filesystem::last_write_time(File(1, "report.json")), written);
}

TEST_F(RefineAroundTest, TakesNothingFromADamagedNeighbour) {
  for (const int frame : {0, 1, 2}) Register(frame);
  const std::string whole = ReadBytes(File(2, "unrefined.ply"));
  std::string damaged = whole;
  damaged[damaged.size() / 2] ^= 1;
  WriteBytes(File(2, "unrefined.ply"), damaged);
  ASSERT_TRUE(Refine(1).ok());
  EXPECT_TRUE(SameAsAlone(1));
  WriteBytes(File(2, "unrefined.ply"), whole);
  ASSERT_TRUE(Refine(1).ok());
  EXPECT_FALSE(SameAsAlone(1));
}

TEST_F(RefineAroundTest, ListsTheMeshesThatItWrites) {
  Run({0, 1, 2, 3, 4}, {3});
  for (int frame = 0; frame < 5; ++frame) {
    const auto folder = FrameFolder::Open(folder_.path(), Name(frame), ConfinedFolder::IfMissing::kFail);
    ASSERT_TRUE(folder.ok()) << folder.status();
    const auto report = folder->Report();
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(folder->CheckAll(*report), "") << frame;
  }
}

TEST_F(RefineAroundTest, StopsWhenAskedTo) {
  for (const int frame : {0, 1, 2}) Register(frame);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(Refine(1, stop.get_token())));
  EXPECT_TRUE(SameAsAlone(1));
}

}  // namespace
}  // namespace weft

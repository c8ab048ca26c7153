#include "services/results/export/export_result.h"

#include <gmock/gmock.h>
#include <tiny_gltf.h>

#include <filesystem>
#include <map>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/export/export_source.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFrames = 5, kSide = 6;

// A sheet of kSide x kSide vertices that moves by (frame, 0, frame^2) mm.
RegisteredMesh MeshAt(int frame) {
  RegisteredMesh mesh;
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      mesh.vertices_mm.emplace_back(col + frame, row, 0.25 * col * row + frame * frame);
      const bool observed = (row + frame) % 2 == 0;
      mesh.state.push_back(observed ? VertexState::kObserved : VertexState::kInferred);
      mesh.sigma_mm.push_back(0.5F);
      mesh.views.push_back(observed ? 3 : 0);
    }
  }
  return mesh;
}

std::vector<Face> FacesOfSheet() {
  std::vector<Face> faces;
  for (int row = 0; row + 1 < kSide; ++row) {
    for (int col = 0; col + 1 < kSide; ++col) {
      const int v = kSide * row + col;
      faces.push_back({v, v + 1, v + kSide});
      faces.push_back({v + 1, v + kSide + 1, v + kSide});
    }
  }
  return faces;
}

class ExportResultTest : public ::testing::Test {
 protected:
  ExportResultTest() : folder_(::testing::TempDir() + "/export_result_" + std::to_string(getpid())) {
    v1::Job job;
    job.set_id("job");
    job.set_state(v1::JOB_STATE_DONE);
    WriteJob(job);
    for (int frame = 0; frame < kFrames; ++frame) WriteFrame(frame, FacesOfSheet());
    request_.result = folder_ + "/result";
    request_.out = folder_ + "/out";
    request_.fps = 10;
    request_.unit = LengthUnit::kMillimetre;
    request_.world_up = "y";
  }
  ~ExportResultTest() override { fs::remove_all(folder_); }

  void WriteJob(const v1::Job& job) const {
    fs::create_directories(folder_ + "/result");
    ASSERT_TRUE(WriteJsonFile(folder_ + "/result/job.json", job).ok());
  }
  std::string FrameFolderOf(int frame) const { return absl::StrCat(folder_, "/result/000", frame); }
  void WriteFrame(int frame, const std::vector<Face>& faces) const {
    fs::create_directories(FrameFolderOf(frame));
    MeshTexture texture;
    for (int v = 0; v < kSide * kSide; ++v) texture.of_vertex.emplace_back(0.01F * v, 0.5F);
    ASSERT_TRUE(WriteRegisteredMesh(FrameFolderOf(frame) + "/mesh.ply", MeshAt(frame), faces, texture).ok());
    WriteReport(frame, v1::FRAME_STATE_DONE);
  }
  void WriteReport(int frame, v1::FrameState state) const {
    v1::FrameReport report;
    report.set_state(state);
    report.set_reason(state == v1::FRAME_STATE_FAILED ? "too dark" : "");
    ASSERT_TRUE(WriteJsonFile(FrameFolderOf(frame) + "/report.json", report).ok());
  }
  absl::StatusOr<ExportOutcome> Export(std::stop_token stop = {}) const {
    return ExportResult(request_, nullptr, stop);
  }
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(request_.out))
      if (entry.is_regular_file())
        files[fs::relative(entry.path(), request_.out).string()] = *ReadWholeFile(entry.path().string());
    return files;
  }

  void StopEverywhere(const std::string& name);

  const std::string folder_;
  ExportRequest request_;
};

// The request as a whole, and stopped after one step, then after two, and so on: the same bytes.
void ExportResultTest::StopEverywhere(const std::string& name) {
  request_.out = folder_ + "/whole/" + name;
  ASSERT_TRUE(Export().ok());
  const auto whole = Files();
  request_.out = folder_ + "/parts/" + name;
  for (int run = 0; run < 100; ++run) {
    std::stop_source stop;
    int steps = 0;
    const auto count = [&](ExportStep step, size_t, size_t) {
      if (step == ExportStep::kWrite && ++steps > run) stop.request_stop();
    };
    const auto outcome = ExportResult(request_, count, stop.get_token());
    if (outcome.ok()) break;
    ASSERT_EQ(outcome.status().code(), absl::StatusCode::kCancelled) << outcome.status();
    EXPECT_THAT(outcome.status().message(), HasSubstr("the same command goes on"));
    EXPECT_FALSE(fs::exists(request_.out + "/export.json"));
  }
  EXPECT_TRUE(fs::exists(request_.out + "/export.json")) << name;
  EXPECT_EQ(Files(), whole) << name;
}

TEST_F(ExportResultTest, GoesOnWithTheSameBytesWhereverItIsStopped) {
  for (const FormatTraits& traits : ExportFormats()) {
    request_.format = traits.format;
    request_.unit = traits.fixed_axes ? LengthUnit::kMetre : LengthUnit::kMillimetre;
    StopEverywhere(traits.name);
  }
}

TEST_F(ExportResultTest, CompressedGltfGoesOnToo) {
  request_.format = ExportFormat::kGlb;
  request_.unit = LengthUnit::kMetre;
  request_.meshopt = true;
  StopEverywhere("meshopt");
}

TEST_F(ExportResultTest, VelocitiesAreCentralDifferencesAndOneSidedAtTheEnds) {
  auto source = ExportSource::Open(request_);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_TRUE(source->Survey(nullptr, {}).ok());
  for (const auto& [frame, expected] :
       {std::pair(0, Eigen::Vector3f(10, 0, 10)), std::pair(2, Eigen::Vector3f(10, 0, 40)),
        std::pair(4, Eigen::Vector3f(10, 0, 70))}) {
    const auto mesh = source->Read(static_cast<size_t>(frame), ExportSource::Velocities::kComputed);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    // PLY files are z up: (x, y, z) becomes (x, -z, y).
    const Eigen::Vector3f z_up(expected.x(), -expected.z(), expected.y());
    for (const Eigen::Vector3f& velocity : mesh->velocities) EXPECT_TRUE(velocity.isApprox(z_up, 1e-5F));
  }
}

TEST_F(ExportResultTest, VelocitiesAcrossAGapCountItsTime) {
  WriteReport(2, v1::FRAME_STATE_FAILED);
  auto source = ExportSource::Open(request_);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_TRUE(source->Survey(nullptr, {}).ok());
  const auto mesh = source->Read(1, ExportSource::Velocities::kComputed);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->velocities.front().isApprox(Eigen::Vector3f(10, -30, 0), 1e-5F));
}

TEST_F(ExportResultTest, CoverageIsTheShareOfFramesThatObserveAVertex) {
  auto source = ExportSource::Open(request_);
  ASSERT_TRUE(source.ok() && source->Survey(nullptr, {}).ok());
  EXPECT_FLOAT_EQ(source->topology().coverage.front(), 0.6F);
  EXPECT_FLOAT_EQ(source->topology().coverage.back(), 0.4F);
}

TEST_F(ExportResultTest, LeavesOutGapsAtTheEndsAndMarksOthers) {
  for (const int frame : {0, 2}) WriteReport(frame, v1::FRAME_STATE_FAILED);
  const auto outcome = Export();
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  const auto& frames = outcome->manifest.frames();
  ASSERT_EQ(frames.size(), 4);
  EXPECT_EQ(frames[0].frame(), "0001");
  EXPECT_EQ(frames[1].missing_because(), "too dark");
  EXPECT_EQ(frames[3].index(), 3);
  EXPECT_DOUBLE_EQ(frames[3].time_s(), 0.3);
  EXPECT_FALSE(fs::exists(request_.out + "/0002.ply"));
}

TEST_F(ExportResultTest, RefusesFramesOfAnotherTopology) {
  std::vector<Face> faces = FacesOfSheet();
  std::swap(faces.front(), faces.back());
  WriteFrame(3, faces);
  const auto outcome = Export();
  EXPECT_EQ(outcome.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(outcome.status().message(), HasSubstr("0003/mesh.ply: has other vertices or faces"));
  EXPECT_FALSE(fs::exists(request_.out));
}

TEST_F(ExportResultTest, RefusesResultsWithoutMeshes) {
  for (int frame = 0; frame < kFrames; ++frame) WriteReport(frame, v1::FRAME_STATE_FAILED);
  EXPECT_THAT(Export().status().message(), HasSubstr("none of the frames asked for has a mesh"));
}

TEST_F(ExportResultTest, RefusesJobsThatHaveNotEnded) {
  v1::Job job;
  for (const auto& [state, word] :
       {std::pair(v1::JOB_STATE_QUEUED, "has not begun"), std::pair(v1::JOB_STATE_RUNNING, "has not ended"),
        std::pair(v1::JOB_STATE_CANCELLED, "was cancelled"), std::pair(v1::JOB_STATE_FAILED, "failed")}) {
    job.set_state(state);
    WriteJob(job);
    const auto outcome = Export();
    EXPECT_EQ(outcome.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(outcome.status().message(), HasSubstr(word));
  }
}

constexpr int kFewer = 12;

TEST_F(ExportResultTest, FewerVerticesAreSomeOfAll) {
  request_.max_vertices = kFewer;
  auto source = ExportSource::Open(request_);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_TRUE(source->Survey(nullptr, {}).ok());
  ASSERT_TRUE(source->reduced());
  const std::vector<int>& kept = source->reduced()->vertices;
  const ExportTopology& topology = source->topology();
  EXPECT_LE(kept.size(), static_cast<size_t>(kFewer));
  EXPECT_GE(kept.size(), 4u);
  ASSERT_EQ(topology.vertices, kept.size());
  EXPECT_EQ(topology.texture.of_vertex.size(), kept.size());
  EXPECT_TRUE(topology.is_measured);
  EXPECT_FALSE(topology.bounds.isEmpty());
  ExportSource whole = source->InWorldMm();
  EXPECT_FALSE(whole.reduced());
  ASSERT_EQ(whole.topology().vertices, static_cast<size_t>(kSide * kSide));
  const auto mesh = source->Read(2, ExportSource::Velocities::kComputed);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->positions.size(), kept.size());
  const RegisteredMesh all = MeshAt(2);
  for (size_t i = 0; i < kept.size(); ++i) {
    const auto v = static_cast<size_t>(kept[i]);
    const Eigen::Vector3d& p = all.vertices_mm[v];
    EXPECT_EQ(mesh->positions[i], Eigen::Vector3f(Eigen::Vector3d(p.x(), -p.z(), p.y()).cast<float>()));
    EXPECT_EQ(mesh->state[i], static_cast<uint8_t>(all.state[v]));
    EXPECT_EQ(mesh->views[i], all.views[v]);
    EXPECT_TRUE(mesh->velocities[i].isApprox(Eigen::Vector3f(10, -40, 0), 1e-5F));
    EXPECT_EQ(topology.coverage[i], whole.topology().coverage[v]);
    EXPECT_EQ(topology.usual_state[i], whole.topology().usual_state[v]);
    EXPECT_EQ(topology.mean_sigma_mm[i], 0.5F);
  }
  const auto outcome = Export();
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(outcome->manifest.max_vertices(), kFewer);
  EXPECT_EQ(outcome->manifest.vertices(), static_cast<int>(kept.size()));
}

TEST_F(ExportResultTest, TheShapeToReduceIsThatOfTheFirstFrame) {
  request_.max_vertices = kFewer, request_.frames = "1:";
  RegisteredMesh fewer = MeshAt(0);
  fewer.vertices_mm.resize(4), fewer.state.resize(4), fewer.sigma_mm.resize(4), fewer.views.resize(4);
  ASSERT_TRUE(WriteRegisteredMesh(FrameFolderOf(0) + "/mesh.ply", fewer, {{0, 1, 2}}).ok());
  EXPECT_EQ(Export().status(),
            absl::InvalidArgumentError(FrameFolderOf(0) +
                                       "/mesh.ply: has other vertices than the frames to export, "
                                       "which --max-vertices reduces by its shape"));
}

TEST_F(ExportResultTest, ANormalMapStandsBesideTheCoarserMesh) {
  request_.format = ExportFormat::kGlb, request_.unit = LengthUnit::kMetre;
  request_.frames = "0001", request_.max_vertices = kFewer, request_.normal_map_px = 16;
  request_.world_up = std::string("z");
  const auto outcome = Export();
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(outcome->manifest.normal_map_px(), 16);
  EXPECT_EQ(*outcome->manifest.attributes().rbegin(), "normal") << "it is needed for the map";
  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string errors, warnings;
  ASSERT_TRUE(reader.LoadBinaryFromFile(&model, &errors, &warnings, request_.out + "/garment.glb")) << errors;
  ASSERT_EQ(model.images.size(), 1u);
  EXPECT_EQ(model.images[0].name, "normal");
  EXPECT_EQ(model.images[0].width, 16);
  EXPECT_EQ(model.materials.at(0).normalTexture.index, 0);
  const auto floats = [&](const char* name) {
    const tinygltf::Accessor& accessor =
        model.accessors.at(static_cast<size_t>(model.meshes.at(0).primitives.at(0).attributes.at(name)));
    const tinygltf::BufferView& view = model.bufferViews.at(static_cast<size_t>(accessor.bufferView));
    const auto* first = reinterpret_cast<const float*>(model.buffers.at(0).data.data() + view.byteOffset);
    return std::vector<float>(first, first + view.byteLength / sizeof(float));
  };
  const std::vector<float> tangents = floats("TANGENT"), normals = floats("NORMAL"),
                           vertices = floats("_VERTEX");
  ASSERT_EQ(tangents.size(), 4 * vertices.size());
  ASSERT_EQ(normals.size(), 3 * vertices.size());
  for (size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3f tangent(&tangents[4 * v]), normal(&normals[3 * v]);
    EXPECT_NEAR(tangent.norm(), 1, 1e-5);
    EXPECT_NEAR(tangent.dot(normal), 0, 1e-5) << "both in the axes of the export";
    EXPECT_LT(vertices[v], kSide * kSide);
  }
}

}  // namespace
}  // namespace weft

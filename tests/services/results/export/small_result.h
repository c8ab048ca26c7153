// A result of two triangles and three frames, whose numbers can be written down by hand.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/file/checksum.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/export/sequence_writer.h"
#include "tests/capture/temp_folder.h"

namespace weft {

// A square of 100 mm x 50 mm that moves 10 mm along z from frame to frame. Vertex 0 is inferred throughout,
// vertex 1 is seen by two cameras, the others by three.
class SmallResult {
 public:
  static constexpr int kFrames = 3;

  SmallResult() {
    v1::Job job;
    job.set_id("job");
    job.set_state(v1::JOB_STATE_DONE);
    WriteJob(job);
    for (int frame = 0; frame < kFrames; ++frame) {
      std::filesystem::create_directories(FolderOf(frame));
      EXPECT_TRUE(WriteRegisteredMesh(MeshFile(frame), MeshAt(frame), Faces(), Texture()).ok());
      v1::FrameReport report;
      report.set_state(v1::FRAME_STATE_DONE);
      WriteReport(frame, report);
    }
    request.result = folder / "result";
    request.out = folder / "out";
    request.fps = 10;
    request.up = UpAxis::kY;
    request.world_up = std::string("y");
    request.unit = LengthUnit::kMillimetre;
  }

  static RegisteredMesh MeshAt(int frame) {
    RegisteredMesh mesh;
    const double z = 10 * frame;
    mesh.vertices_mm = {{0, 0, z}, {100, 0, z}, {100, 50, z}, {0, 50, z}};
    mesh.state = {VertexState::kInferred, VertexState::kTwoView, VertexState::kObserved,
                  VertexState::kObserved};
    mesh.sigma_mm = {1.5F, 0.5F, 0.25F, 0.25F};
    mesh.views = {0, 2, 3, 3};
    return mesh;
  }
  static std::vector<Face> Faces() { return {{0, 1, 2}, {0, 2, 3}}; }
  static MeshTexture Texture() {
    MeshTexture texture;
    texture.of_vertex = {{0, 0}, {1, 0}, {1, 0.5F}, {0, 0.5F}};
    return texture;
  }

  std::string FolderOf(int frame) const { return folder / absl::StrFormat("result/%04d", frame); }
  std::string MeshFile(int frame) const { return FolderOf(frame) + "/mesh.ply"; }
  void WriteJob(const v1::Job& job) const {
    std::filesystem::create_directories(folder / "result");
    EXPECT_TRUE(WriteJsonFile(folder / "result/job.json", job).ok());
  }
  void WriteReport(int frame, const v1::FrameReport& report) const {
    EXPECT_TRUE(WriteJsonFile(FolderOf(frame) + "/report.json", report).ok());
  }
  // As a report lists it.
  static std::string ChecksumOf(const std::string& file) {
    const std::string bytes = ReadBytes(file);
    return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
  }

  // Opened and surveyed.
  absl::StatusOr<ExportSource> Source() const {
    absl::StatusOr<ExportSource> source = ExportSource::Open(request);
    if (!source.ok()) return source;
    const absl::Status status = source->Survey(nullptr, {});
    if (!status.ok()) return status;
    return source;
  }

  TempFolder folder;
  ExportRequest request;
};

// All meshes of `source`, with these attributes.
inline ExportPlan PlanOf(ExportSource& source, ExportFormat format,
                         const std::vector<ExportAttribute>& attributes) {
  ExportPlan plan{.source = source, .traits = TraitsOf(format), .attributes = attributes, .samples = {}};
  for (size_t mesh = 0; mesh < source.meshes().size(); ++mesh) {
    const v1::ExportedFrame& frame = source.frames()[source.meshes()[mesh]];
    plan.samples.push_back({mesh, frame.index(), frame.time_s(), frame.frame()});
  }
  return plan;
}

// The bytes of the whole file.
inline std::string Written(SequenceWriter& writer, const ExportPlan& plan, const std::string& file) {
  absl::StatusOr<ExportStream> stream = ExportStream::Open(file, 0);
  EXPECT_TRUE(stream.ok()) << stream.status();
  if (!stream.ok()) return "";
  EXPECT_TRUE(writer.Begin(*stream).ok());
  for (int pass = 0; pass < writer.passes(); ++pass) {
    for (size_t sample = 0; sample < plan.samples.size(); ++sample) {
      const auto velocities = writer.NeedsVelocities(pass) ? ExportSource::Velocities::kComputed
                                                           : ExportSource::Velocities::kLeftOut;
      const absl::StatusOr<ExportMesh> mesh = plan.source.Read(plan.samples[sample].mesh, velocities);
      EXPECT_TRUE(mesh.ok()) << mesh.status();
      if (!mesh.ok()) return "";
      EXPECT_TRUE(writer.Add(pass, sample, *mesh, *stream).ok());
    }
  }
  EXPECT_TRUE(writer.Finish(*stream).ok());
  EXPECT_TRUE(stream->Sync().ok());
  return ReadBytes(file);
}

// A value of the machine's order out of a file.
template <typename Value>
Value ValueAt(const std::string& bytes, size_t offset) {
  Value value{};
  EXPECT_LE(offset + sizeof value, bytes.size());
  if (offset + sizeof value <= bytes.size())
    bytes.copy(reinterpret_cast<char*>(&value), sizeof value, offset);
  return value;
}

}  // namespace weft

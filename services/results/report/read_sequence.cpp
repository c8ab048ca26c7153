#include "services/results/report/read_sequence.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/sequence_view.h"

namespace weft {
namespace {

std::vector<const v1::FrameReport*> FramesWithMesh(const std::vector<v1::FrameReport>& frames) {
  std::vector<const v1::FrameReport*> with_mesh;
  for (const v1::FrameReport& frame : frames)
    if (IsRegistered(frame.state()) || frame.temporal().bridged()) with_mesh.push_back(&frame);
  return with_mesh;
}

SequenceFrame FrameOf(const v1::FrameReport& report, const RegisteredMesh& mesh, const std::vector<int>& kept,
                      bool is_measured, const ScalarRange& sigma_range_mm,
                      const std::vector<VertexValues>& values) {
  SequenceFrame frame{report.frame(), report.temporal().bridged() ? "bridged" : "", {}, {}};
  for (const int v : kept) frame.vertices_mm.push_back(mesh.vertices_mm[v].cast<float>());
  if (is_measured) frame.color_bytes = {2, std::vector<uint8_t>(kept.size(), PaletteIndex(kNoNumber, {}))};
  for (size_t i = 0; i < kept.size() && is_measured && !mesh.state.empty(); ++i) {
    frame.color_bytes[0][i] = static_cast<uint8_t>(mesh.state[kept[i]]);
    frame.color_bytes[1][i] = PaletteIndex(mesh.sigma_mm[kept[i]], sigma_range_mm);
  }
  for (const VertexValues& more : values) {
    const std::vector<double> of_frame = more.of_frame(report.frame(), mesh.vertices_mm);
    std::vector<uint8_t>& bytes = frame.color_bytes.emplace_back();
    for (const int v : kept)
      bytes.push_back(
          PaletteIndex(of_frame.size() == mesh.vertices_mm.size() ? of_frame[v] : kNoNumber, more.range));
  }
  return frame;
}

// Sorts the faces by garment, which makes parts of them.
void SortByGarment(const v1::MeshReport& report, DecimatedMesh& mesh,
                   google::protobuf::RepeatedPtrField<v1::PageSequence::Part>& parts) {
  std::vector<int> end;  // of each garment's vertices in the whole mesh
  for (const v1::GarmentReport& garment : report.garments()) {
    end.push_back((end.empty() ? 0 : end.back()) + garment.vertices());
    parts.Add()->set_name(garment.id());
  }
  const auto garment_of = [&](const Face& face) {
    return static_cast<int>(std::ranges::upper_bound(end, mesh.vertices[face[0]]) - end.begin());
  };
  std::ranges::stable_sort(mesh.faces,
                           [&](const Face& a, const Face& b) { return garment_of(a) < garment_of(b); });
  for (const Face& face : mesh.faces)
    if (const int garment = garment_of(face); garment < parts.size())
      parts[garment].set_faces(parts[garment].faces() + 1);
}

// The sequence as it is before its first frame, and which vertices of that frame's mesh it keeps.
absl::StatusOr<std::vector<int>> BeginAt(const MeshOfFrame& first, const v1::MeshReport& report,
                                         size_t frames, const std::vector<VertexValues>& values,
                                         const ScalarRange& sigma_range_mm, v1::PageSequence& sequence) {
  WEFT_ASSIGN_OR_RETURN(DecimatedMesh mesh,
                        DecimateMesh(first.mesh, SequenceVertices(frames, 2 + values.size())));
  WEFT_ASSIGN_OR_RETURN(const Viewpoint front,
                        ViewpointOf(first.mesh.vertices_mm, MeshSide::kFront, -Eigen::Vector3d::UnitY()));
  google::protobuf::RepeatedPtrField<v1::PageSequence::Part> parts;
  SortByGarment(report, mesh, parts);
  sequence = BeginSequence(mesh, front);
  *sequence.mutable_parts() = std::move(parts);
  if (!first.registered.state.empty()) {
    *sequence.add_colorings() = ColoringByState();
    *sequence.add_colorings() = ColoringByValue("sigma", "sigma", "mm", sigma_range_mm);
  }
  for (const VertexValues& more : values) {
    *sequence.add_colorings() = ColoringByValue(more.name, more.label, more.unit, more.range);
    sequence.mutable_colorings()->rbegin()->set_first_shown(more.is_first_shown);
  }
  return std::move(mesh.vertices);
}

}  // namespace

absl::StatusOr<MeshOfFrame> ReadMeshOfFrame(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(Ply ply, ReadPly(path));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, MeshFromPly(ply, path));
  RegisteredMesh registered;
  registered.vertices_mm = mesh.vertices_mm;
  if (ply.Find("vertex")->Find("state") != nullptr) {
    WEFT_ASSIGN_OR_RETURN(registered, RegisteredMeshFromPly(ply, path));
  }
  return MeshOfFrame{std::move(mesh), std::move(registered)};
}

v1::PageSequence ReadSequence(const std::string& out_folder, const std::vector<v1::FrameReport>& frames,
                              const ScalarRange& sigma_range_mm, const std::vector<VertexValues>& values,
                              std::vector<std::string>& notes) {
  const std::vector<const v1::FrameReport*> all = FramesWithMesh(frames);
  v1::PageSequence sequence;
  std::vector<int> kept;
  size_t vertices = 0;
  bool is_measured = false;
  for (const size_t i : SequenceFrames(all.size())) {
    const std::string path = FramePaths(out_folder, all[i]->frame()).Of(FrameFile::kMesh);
    const absl::StatusOr<MeshOfFrame> read = ReadMeshOfFrame(path);
    absl::Status status = read.status();
    if (status.ok() && kept.empty()) {
      absl::StatusOr<std::vector<int>> chosen =
          BeginAt(*read, all[i]->mesh(), all.size(), values, sigma_range_mm, sequence);
      status = chosen.status();
      if (chosen.ok()) kept = *std::move(chosen);
      vertices = read->mesh.vertices_mm.size();
      is_measured = !read->registered.state.empty();
    }
    if (status.ok() && read->mesh.vertices_mm.size() != vertices)
      status = absl::InvalidArgumentError(absl::StrCat(path, ": has ", read->mesh.vertices_mm.size(),
                                                       " vertices, the frames before it ", vertices));
    if (status.ok()) {
      AddFrame(FrameOf(*all[i], read->registered, kept, is_measured, sigma_range_mm, values), sequence);
    } else {
      notes.push_back(
          absl::StrCat("Frame ", all[i]->frame(), " is missing in three dimensions: ", status.message()));
    }
  }
  return sequence;
}

}  // namespace weft

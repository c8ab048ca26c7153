#include "services/results/evaluation/frame_pieces.h"

#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/listed_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/ply.h"

namespace weft {
namespace {

constexpr FrameFile kPieces[] = {FrameFile::kObservations, FrameFile::kCloud, FrameFile::kMesh};

}  // namespace

absl::StatusOr<ResultMesh> ReadResultMesh(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(path));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, MeshFromPly(ply, path));
  ResultMesh out{std::move(mesh), {}, {}};
  const PlyProperty* sigma = ply.Find("vertex")->Find("sigma_mm");
  if (sigma && !sigma->is_list) out.sigma_mm.assign(sigma->values.begin(), sigma->values.end());
  const PlyProperty* state = ply.Find("vertex")->Find("state");
  if (!state || state->is_list) return out;
  for (const double s : state->values) {
    if (!(s >= 0 && s <= static_cast<double>(VertexState::kDriven)))
      return absl::InvalidArgumentError(absl::StrCat(path, ": a vertex cannot have state ", s));
    out.state.push_back(static_cast<VertexState>(s));
  }
  return out;
}

std::vector<bool> ResultMesh::Measured() const {
  std::vector<bool> out;
  out.reserve(state.size());
  for (const VertexState s : state) out.push_back(s == VertexState::kObserved || s == VertexState::kTwoView);
  return out;
}

absl::StatusOr<std::optional<std::vector<CameraObservations>>> ReadCameraObservations(
    const std::string& frame_folder) {
  const std::string path = FramePaths(frame_folder).Of(FrameFile::kObservations);
  if (!PathExists(path)) return std::nullopt;
  WEFT_ASSIGN_OR_RETURN(std::vector<ImageObservations> images, ReadObservations(path));
  std::vector<CameraObservations> views;
  for (ImageObservations& image : images)
    views.push_back({std::move(image.image), std::move(image.observations)});
  return views;
}

absl::StatusOr<FramePieces> ReadFramePieces(const std::string& frame_folder, const v1::FrameReport& report) {
  FramePieces out;
  std::map<FrameFile, std::string> paths;  // of files that are there
  for (const FrameFile file : kPieces) {
    const std::string path = FramePaths(frame_folder).Of(file);
    if (!PathExists(path)) {
      out.missing.emplace_back(FileName(file));
      continue;
    }
    paths[file] = path;
    if (FindListed(report, FileName(file)) == nullptr) continue;
    WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
    WEFT_RETURN_IF_ERROR(CheckListed(report, FileName(file), bytes, path));
  }
  WEFT_ASSIGN_OR_RETURN(out.pieces.observations, ReadCameraObservations(frame_folder));
  if (const auto cloud = paths.find(FrameFile::kCloud); cloud != paths.end()) {
    WEFT_ASSIGN_OR_RETURN(out.pieces.cloud, ReadCloud(cloud->second));
  }
  if (const auto mesh = paths.find(FrameFile::kMesh); mesh != paths.end()) {
    WEFT_ASSIGN_OR_RETURN(out.mesh, ReadResultMesh(mesh->second));
  }
  return out;
}

FramePieces NoFramePieces() {
  FramePieces none;
  for (const FrameFile file : kPieces) none.missing.emplace_back(FileName(file));
  return none;
}

}  // namespace weft

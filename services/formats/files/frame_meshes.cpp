#include "services/formats/files/frame_meshes.h"

#include <algorithm>
#include <map>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"
#include "services/formats/files/frame_paths.h"

namespace weft {
namespace {

constexpr size_t kLongestName = 32;

bool MayStandInName(char c) {
  return absl::ascii_islower(static_cast<unsigned char>(c)) ||
         absl::ascii_isdigit(static_cast<unsigned char>(c)) || c == '-' || c == '_';
}

absl::Status CheckListed(const v1::FrameReport& report) {
  std::set<std::string> names;
  for (const v1::FrameMesh& mesh : report.meshes()) {
    WEFT_RETURN_IF_ERROR(CheckMeshName(mesh.name()));
    if (!names.insert(mesh.name()).second)
      return absl::InvalidArgumentError(
          absl::StrCat("frame ", report.frame(), ": two meshes have the name ", mesh.name()));
    if (mesh.file() != MeshFileName(mesh.name()))
      return absl::InvalidArgumentError(absl::StrCat("frame ", report.frame(), ": the mesh ", mesh.name(),
                                                     " is said to be in another file than ",
                                                     MeshFileName(mesh.name())));
  }
  return absl::OkStatus();
}

// Of frames that follow each other. Reports of earlier versions tell no topology.
absl::Status CheckTopologies(const std::map<std::string, v1::FrameMesh>& of_frame, const std::string& name,
                             std::span<const v1::FrameReport> reports) {
  const v1::FrameMesh* before = nullptr;
  std::string frame_before;
  for (const v1::FrameReport& report : reports) {
    const auto found = of_frame.find(report.frame());
    if (found == of_frame.end() || found->second.topology_hash().empty()) continue;
    if (before != nullptr && before->topology_hash() != found->second.topology_hash())
      return absl::InvalidArgumentError(absl::StrCat(
          "frame ", report.frame(), ": its mesh ", name, " has other vertices or faces than that of frame ",
          frame_before, " (topology ", found->second.topology_hash(), ", before ", before->topology_hash(),
          "); frames of one template are taken together, choose them with --frames"));
    before = &found->second, frame_before = report.frame();
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckMeshName(const std::string& name) {
  if (name.empty() || name.size() > kLongestName ||
      !absl::ascii_islower(static_cast<unsigned char>(name[0])) || !std::ranges::all_of(name, MayStandInName))
    return absl::InvalidArgumentError(absl::StrCat("\"", name, "\" is no name of a mesh; give 1 to ",
                                                   kLongestName,
                                                   " of a to z, 0 to 9, - and _, a letter first"));
  const std::string file = absl::StrCat(name, ".ply");
  if (std::ranges::any_of(kDataFiles, [&](FrameFile other) { return file == FileName(other); }))
    return absl::InvalidArgumentError(
        absl::StrCat("a mesh cannot be called ", name, ": ", file, " is another file of a frame"));
  return absl::OkStatus();
}

std::string MeshFileName(const std::string& name) {
  return name == kGarmentMesh ? FileName(FrameFile::kMesh) : absl::StrCat(name, ".ply");
}

std::string TopologyHash(size_t vertices, const std::vector<Face>& faces) {
  ContentHash hash;
  hash.Add("topology").AddInteger(vertices).AddInteger(faces.size());
  for (const Face& face : faces)
    for (const int v : face) hash.AddInteger(static_cast<uint64_t>(v));
  return hash.Hex();
}

absl::StatusOr<std::vector<v1::FrameMesh>> MeshesOf(const v1::FrameReport& report) {
  WEFT_RETURN_IF_ERROR(CheckListed(report));
  std::vector<v1::FrameMesh> meshes(report.meshes().begin(), report.meshes().end());
  const std::string file = FileName(FrameFile::kMesh);
  const auto is_garment = [&file](const auto& listed) { return listed.file() == file; };
  if (std::ranges::any_of(meshes, is_garment)) return meshes;
  if (std::ranges::none_of(report.files(), [&](const v1::ResultFile& f) { return f.name() == file; }))
    return meshes;
  v1::FrameMesh earlier;
  earlier.set_name(kGarmentMesh);
  earlier.set_file(file);
  earlier.set_vertices(report.mesh().vertices());
  meshes.insert(meshes.begin(), std::move(earlier));
  return meshes;
}

absl::StatusOr<std::string> ChooseMesh(std::span<const v1::FrameReport> reports, const std::string& name) {
  std::map<std::string, std::map<std::string, v1::FrameMesh>> by_name;  // then by frame
  for (const v1::FrameReport& report : reports) {
    WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameMesh> meshes, MeshesOf(report));
    for (const v1::FrameMesh& mesh : meshes) by_name[mesh.name()][report.frame()] = mesh;
  }
  std::vector<std::string> names;
  for (const auto& [known, of_frame] : by_name) names.push_back(known);
  std::string chosen = name;
  if (name.empty())
    chosen = names.size() == 1 && !by_name.contains(kGarmentMesh) ? names.front() : kGarmentMesh;
  const auto found = by_name.find(chosen);
  if (found == by_name.end()) {
    if (names.empty() && (name.empty() || name == kGarmentMesh)) return chosen;
    const std::string there =
        names.empty() ? "none has any" : absl::StrCat("there are ", absl::StrJoin(names, ", "));
    if (!name.empty())
      return absl::NotFoundError(absl::StrCat("no frame has a mesh \"", name, "\"; ", there));
    return absl::InvalidArgumentError(
        absl::StrCat("the frames have several meshes: ", absl::StrJoin(names, ", "), "; name one"));
  }
  WEFT_RETURN_IF_ERROR(CheckTopologies(found->second, chosen, reports));
  return chosen;
}

}  // namespace weft

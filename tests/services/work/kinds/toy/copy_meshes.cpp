#include "copy_meshes.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/mesh_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

v1::WorkKindInfo Describe() {
  v1::WorkKindInfo info;
  info.set_name("copy meshes");
  info.set_title("Copy meshes");
  info.set_verb("Copy");
  info.set_about("Copies the meshes of a result, one after another.");
  info.set_start(v1::WORK_START_JOB);
  info.set_out(v1::WORK_OUT_NAMED);
  info.set_done_word("copied");
  v1::WorkInputInfo& result = *info.add_inputs();
  result.set_name("result");
  result.set_label("Folder of meshes, or a job (job:ID)");
  result.set_is_required(true);
  result.set_is_positional(true);
  const auto add_option = [&info](const char* name, const char* label, v1::OptionType type) -> auto& {
    v1::WorkOptionInfo& option = *info.add_options();
    option.set_name(name);
    option.set_label(label);
    option.set_type(type);
    return option;
  };
  v1::WorkOptionInfo& every = add_option("every", "One mesh in so many", v1::OPTION_TYPE_INTEGER);
  every.set_preset("1");
  every.set_least(1), every.set_most(1000);
  add_option("mirror", "A second mesh, mirrored", v1::OPTION_TYPE_FLAG);
  v1::WorkOptionInfo& pause = add_option("pause-ms", "Rest after each mesh, in ms", v1::OPTION_TYPE_INTEGER);
  pause.set_least(0), pause.set_most(100000);
  pause.set_is_rare(true);
  return info;
}

class MeshesOfFolder : public Units {
 public:
  MeshesOfFolder(std::string folder, std::vector<std::string> names, std::chrono::milliseconds pause,
                 bool mirrors)
      : folder_(std::move(folder)), names_(std::move(names)), pause_(pause), mirrors_(mirrors) {}

  std::vector<std::string> Names() const override { return names_; }
  std::vector<v1::NamedValue> Hashes() const override { return {}; }
  absl::StatusOr<std::string> Fingerprint(size_t unit) const override {
    WEFT_ASSIGN_OR_RETURN(const TriangleMesh mesh, ReadMesh(MeshOf(unit)));
    ContentHash hash;
    for (const Eigen::Vector3d& vertex : mesh.vertices_mm)
      for (int axis = 0; axis < 3; ++axis) hash.Add(absl::StrCat(vertex[axis]));
    return hash.Hex();
  }
  absl::Status Compute(size_t unit, const UnitPlace& place) override {
    int copied = 0;
    if (!place.state.empty() && !absl::SimpleAtoi(place.state, &copied))
      return absl::DataLossError("the state is no number");
    const absl::StatusOr<TriangleMesh> mesh = ReadMesh(MeshOf(unit));
    if (!mesh.ok()) {
      place.report.set_state(v1::FRAME_STATE_FAILED);
      place.report.set_reason(std::string(mesh.status().message()));
      return absl::OkStatus();
    }
    place.advance(0.5);
    for (auto left = pause_; left.count() > 0; left -= std::chrono::milliseconds(10)) {
      if (place.stop.stop_requested()) return absl::CancelledError("stopped");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    place.state = absl::StrCat(copied + 1);
    WEFT_RETURN_IF_ERROR(Put(kGarmentMesh, *mesh, place));
    return mirrors_ ? Put("mirror", Mirrored(*mesh), place) : absl::OkStatus();
  }

 private:
  static absl::Status Put(const std::string& name, const TriangleMesh& mesh, const UnitPlace& place) {
    return place.folder.PutMesh(
        name, mesh.vertices_mm.size(), mesh.faces,
        [&mesh](const std::string& path) { return WriteMesh(path, mesh); }, place.report);
  }
  static TriangleMesh Mirrored(TriangleMesh mesh) {
    for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex.x() = -vertex.x();
    for (Face& face : mesh.faces) std::swap(face[1], face[2]);
    return mesh;
  }
  std::string MeshOf(size_t unit) const { return FramePaths(folder_, names_[unit]).Of(FrameFile::kMesh); }

  const std::string folder_;
  const std::vector<std::string> names_;
  const std::chrono::milliseconds pause_;
  const bool mirrors_;
};

class CopyMeshes : public UnitKind {
 public:
  explicit CopyMeshes(int version) : UnitKind(Describe(), Order::kInSequence, {{"copy", version}}) {}

 protected:
  absl::StatusOr<std::unique_ptr<Units>> Open(const WorkArguments& arguments) const override {
    const std::string folder = arguments.Input("result");
    std::vector<std::string> names;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
      if (fs::exists(FramePaths(entry.path()).Of(FrameFile::kMesh), error))
        names.push_back(entry.path().filename());
    }
    if (names.empty()) return absl::NotFoundError(absl::StrCat(folder, ": holds no <frame>/mesh.ply"));
    std::sort(names.begin(), names.end());
    const auto every = static_cast<size_t>(arguments.Number("every"));
    std::vector<std::string> used;
    for (size_t i = 0; i < names.size(); i += every) used.push_back(names[i]);
    return std::make_unique<MeshesOfFolder>(
        folder, std::move(used), std::chrono::milliseconds(static_cast<int>(arguments.Number("pause-ms"))),
        arguments.Has("mirror"));
  }
};

}  // namespace

std::unique_ptr<UnitKind> MakeCopyMeshes(int version) { return std::make_unique<CopyMeshes>(version); }

}  // namespace weft

#include "services/results/export/garment_texture.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

absl::StatusOr<std::vector<Eigen::Vector3d>> ReadVertices(ExportSource& source, size_t mesh_number) {
  WEFT_ASSIGN_OR_RETURN(const ExportMesh read, source.Read(mesh_number, ExportSource::Velocities::kLeftOut));
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3f& position : read.positions) vertices.push_back(position.cast<double>());
  return vertices;
}

absl::StatusOr<std::string> OpaquePng(int size_px, const std::vector<uint8_t>& rgb) {
  WEFT_ASSIGN_OR_RETURN(const auto bytes, EncodePng({size_px, size_px, 3, 8, rgb}, PngEffort::kSmall));
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace

uint64_t MaxPngBytes(int size_px) {
  constexpr uint64_t kRgb = 3, kFilter = 1, kHead = 4096;
  const auto side = static_cast<uint64_t>(size_px);
  const uint64_t plain = side * (kRgb * side + kFilter);
  // What deflate cannot pack grows by five bytes in 16 kB, and chunks have heads.
  return plain + plain / 512 + kHead;
}

absl::Status AddFrameToAtlas(const OverlayPlan& plan, ExportSource& source, size_t mesh_number,
                             TextureAtlas& atlas, std::vector<std::string>& warnings) {
  WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> vertices_mm, ReadVertices(source, mesh_number));
  WEFT_ASSIGN_OR_RETURN(const auto mesh,
                        VisibleMesh::Build(std::move(vertices_mm), source.topology().faces, 1));
  const std::string& name = source.frames()[source.meshes()[mesh_number]].frame();
  for (const size_t c : plan.cameras) {
    const CameraModel& camera = plan.rig.cameras[c];
    const absl::StatusOr<Frame> picture = plan.dump->ReadView(plan.index_of_frame.at(name), c);
    absl::Status status = picture.status();
    if (status.ok()) status = atlas.Add(*picture, mesh, camera);
    if (!status.ok())
      warnings.push_back(absl::StrCat("Frame ", name, ", camera ", camera.id, ": ", status.message()));
  }
  return absl::OkStatus();
}

std::vector<size_t> MeshesForTexture(const ExportSource& source, int count) {
  const size_t meshes = source.meshes().size(), wanted = std::min(static_cast<size_t>(count), meshes);
  std::vector<size_t> chosen;
  for (size_t i = 0; i < wanted; ++i) chosen.push_back(i * meshes / wanted);
  return chosen;
}

absl::StatusOr<std::string> MakeSequenceTexture(const ExportRequest& request, ExportSource source,
                                                const ExportProgress& progress, const std::stop_token& stop,
                                                std::vector<std::string>& warnings) {
  WEFT_ASSIGN_OR_RETURN(const OverlayPlan plan, PlanOverlays(request.recording, source));
  WEFT_ASSIGN_OR_RETURN(TextureAtlas atlas, TextureAtlas::Make(request.texture_px, source.topology().faces,
                                                               source.topology().texture));
  const std::vector<size_t> meshes = MeshesForTexture(source, request.texture_frames);
  for (size_t i = 0; i < meshes.size(); ++i) {
    if (stop.stop_requested()) return absl::CancelledError("stopped while the texture was made");
    WEFT_RETURN_IF_ERROR(AddFrameToAtlas(plan, source, meshes[i], atlas, warnings));
    if (progress) progress(ExportStep::kTexture, i + 1, meshes.size());
  }
  const AtlasPicture picture = atlas.Take();
  if (picture.covered < 1)
    warnings.push_back(absl::StrFormat(
        "Cameras see %.1f %% of the texture; the rest has colours from around it.", 100 * picture.covered));
  return OpaquePng(picture.size_px, FilledRgb(picture));
}

absl::StatusOr<NormalMap> MakeNormalMap(int size_px, const ExportSource& source) {
  const ExportSource whole = source.InWorldMm();
  return NormalMap::Make(size_px, whole.topology().faces, whole.topology().texture, *source.reduced());
}

absl::StatusOr<std::string> NormalMapOfFrame(const NormalMap& map, int size_px, ExportSource& whole,
                                             size_t mesh_number) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<Eigen::Vector3d> vertices_mm, ReadVertices(whole, mesh_number));
  return OpaquePng(size_px, map.Bake(vertices_mm));
}

absl::StatusOr<std::vector<Eigen::Vector4f>> TangentsOfFrame(const NormalMap& map, ExportSource& whole,
                                                             size_t mesh_number) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<Eigen::Vector3d> vertices_mm, ReadVertices(whole, mesh_number));
  return map.Tangents(vertices_mm);
}

}  // namespace weft

#include "services/results/export/export_textures.h"

#include <filesystem>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "services/formats/files/atomic_file.h"
#include "services/results/export/export_folder.h"
#include "services/results/export/garment_texture.h"
#include "services/results/export/overlay_plan.h"
#include "services/results/export/texture_atlas.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

v1::Export TextureManifest(const TextureRequest& request, const ExportSource& source) {
  v1::Export manifest = source.Manifest();
  manifest.set_format("png");
  manifest.set_overlay(request.texture_px > 0 ? "texture" : "normal map");
  manifest.set_texture_px(request.texture_px);
  manifest.set_normal_map_px(request.normal_map_px);
  manifest.set_max_vertices(request.max_vertices);
  for (v1::ExportedFrame& frame : *manifest.mutable_frames()) {
    if (!frame.missing_because().empty()) continue;
    if (request.texture_px > 0) frame.set_file(absl::StrCat(frame.frame(), ".png"));
    if (request.normal_map_px > 0) frame.set_normal_map(absl::StrCat(frame.frame(), ".normal.png"));
  }
  return manifest;
}

// What stays from frame to frame.
struct TextureTools {
  ExportSource whole;  // in the rig's world and mm
  std::optional<OverlayPlan> plan;
  std::optional<TextureAtlas> atlas;
  std::optional<NormalMap> normal_map;
};

absl::StatusOr<TextureTools> MakeTools(const TextureRequest& request, const ExportSource& source) {
  TextureTools tools{source.InWorldMm(), std::nullopt, std::nullopt, std::nullopt};
  if (request.texture_px > 0) {
    WEFT_ASSIGN_OR_RETURN(tools.plan, PlanOverlays(request.recording, tools.whole));
    const ExportTopology& topology = tools.whole.topology();
    WEFT_ASSIGN_OR_RETURN(tools.atlas,
                          TextureAtlas::Make(request.texture_px, topology.faces, topology.texture));
  }
  if (request.normal_map_px > 0) {
    WEFT_ASSIGN_OR_RETURN(tools.normal_map, MakeNormalMap(request.normal_map_px, source));
  }
  return tools;
}

absl::StatusOr<std::string> TextureOfFrame(TextureTools& tools, size_t mesh_number,
                                           std::vector<std::string>& warnings) {
  WEFT_RETURN_IF_ERROR(AddFrameToAtlas(*tools.plan, tools.whole, mesh_number, *tools.atlas, warnings));
  const AtlasPicture picture = tools.atlas->Take();
  WEFT_ASSIGN_OR_RETURN(const auto bytes, EncodePng({picture.size_px, picture.size_px, 4, 8, picture.rgba}));
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Files that are there are kept: they got their names when they were complete.
absl::Status WriteFrame(const TextureRequest& request, const v1::ExportedFrame& frame, size_t mesh_number,
                        const ExportFolder& folder, TextureTools& tools, std::vector<std::string>& warnings) {
  if (!frame.file().empty() && !fs::exists(folder.Of(frame.file()))) {
    WEFT_ASSIGN_OR_RETURN(const std::string png, TextureOfFrame(tools, mesh_number, warnings));
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(folder.Of(frame.file()), png));
  }
  if (frame.normal_map().empty() || fs::exists(folder.Of(frame.normal_map()))) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const std::string png,
                        NormalMapOfFrame(*tools.normal_map, request.normal_map_px, tools.whole, mesh_number));
  return WriteFileAtomically(folder.Of(frame.normal_map()), png);
}

uint64_t MaxBytes(const TextureRequest& request, size_t frames) {
  constexpr uint64_t kRgba = 4;
  uint64_t bytes = 0;
  if (request.texture_px > 0)
    bytes += kRgba * static_cast<uint64_t>(request.texture_px) * static_cast<uint64_t>(request.texture_px);
  if (request.normal_map_px > 0) bytes += MaxPngBytes(request.normal_map_px);
  return frames * bytes;
}

}  // namespace

absl::Status TextureRequest::Validate() const {
  if (max_vertices != 0 && normal_map_px == 0) {
    return absl::InvalidArgumentError(
        "--max-vertices: textures are those of the whole mesh, and serve coarser ones; leave it out, or ask "
        "for a --normal-map");
  }
  return CheckNormalMap(normal_map_px, max_vertices);
}

absl::StatusOr<ExportOutcome> ExportTextures(const TextureRequest& request, const ExportProgress& progress,
                                             const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  ExportRequest world = InTheWorld(request);
  world.max_vertices = request.max_vertices;
  WEFT_ASSIGN_OR_RETURN(ExportSource source, ExportSource::Open(world));
  WEFT_RETURN_IF_ERROR(source.Survey(progress, stop));
  WEFT_ASSIGN_OR_RETURN(TextureTools tools, MakeTools(request, source));
  ExportOutcome outcome{TextureManifest(request, source)};
  const ExportFolder folder(request.out);
  const size_t frames = source.meshes().size();
  WEFT_ASSIGN_OR_RETURN(const ExportFolder::Holds holds,
                        folder.BeginOrGoOn(outcome.manifest, MaxBytes(request, frames)));
  outcome.was_complete = holds == ExportFolder::Holds::kAll;
  if (outcome.was_complete) return outcome;
  for (size_t i = 0; i < frames; ++i) {
    if (stop.stop_requested()) return StoppedAfter(i, frames);
    WEFT_RETURN_IF_ERROR(WriteFrame(request, outcome.manifest.frames(static_cast<int>(source.meshes()[i])), i,
                                    folder, tools, outcome.warnings));
    if (progress) progress(ExportStep::kWrite, i + 1, frames);
  }
  WEFT_RETURN_IF_ERROR(folder.Finish(outcome.manifest));
  return outcome;
}

}  // namespace weft

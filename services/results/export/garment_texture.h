// Pictures of the garment's surface as files: its texture, from one frame or from several, and normal maps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/results/export/export_request.h"
#include "services/results/export/export_source.h"
#include "services/results/export/normal_map.h"
#include "services/results/export/overlay_plan.h"
#include "services/results/export/texture_atlas.h"

namespace weft {

// Of an opaque PNG of so many texels along its sides, at most.
uint64_t MaxPngBytes(int size_px);

// Adds what all cameras of `plan` see of a mesh; `mesh_number` counts in source.meshes(), and `source` is in
// the rig's world and mm. Pictures that the dump lacks are left out, with a line in `warnings`. Errors of
// ExportSource::Read.
absl::Status AddFrameToAtlas(const OverlayPlan& plan, ExportSource& source, size_t mesh_number,
                             TextureAtlas& atlas, std::vector<std::string>& warnings);

// Those whose pictures the texture of a sequence is made from, in source.meshes(): the first one and others,
// evenly spaced.
std::vector<size_t> MeshesForTexture(const ExportSource& source, int count);

// A PNG without transparency, the mean of these frames by the weights of TextureAtlas. Texels that no camera
// sees in any of them are filled from around, with a line in `warnings` that tells their share. `source` as
// above, surveyed. Errors of PlanOverlays and TextureAtlas::Make. Cancelled: a stop was requested.
absl::StatusOr<std::string> MakeSequenceTexture(const ExportRequest& request, ExportSource source,
                                                const ExportProgress& progress, const std::stop_token& stop,
                                                std::vector<std::string>& warnings);

// For all frames of `source`, surveyed, with a coarser mesh. Errors of NormalMap::Make.
absl::StatusOr<NormalMap> MakeNormalMap(int size_px, const ExportSource& source);
// A PNG. `whole` is source.InWorldMm() of the source of the map. Errors of ExportSource::Read.
absl::StatusOr<std::string> NormalMapOfFrame(const NormalMap& map, int size_px, ExportSource& whole,
                                             size_t mesh_number);
// As NormalMap::Tangents; the same.
absl::StatusOr<std::vector<Eigen::Vector4f>> TangentsOfFrame(const NormalMap& map, ExportSource& whole,
                                                             size_t mesh_number);

}  // namespace weft

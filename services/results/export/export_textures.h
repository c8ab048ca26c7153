// `weft export --texture, --normal-map`: pictures of the garment's surface, frame by frame.
#pragma once

#include <stop_token>

#include "absl/status/statusor.h"
#include "services/results/export/export_request.h"
#include "services/results/export/export_result.h"

namespace weft {

struct TextureRequest : ExportScope {
  int texture_px = 0;     // 0: none
  int normal_map_px = 0;  // 0: none
  int max_vertices = 0;   // of the mesh that the normal map is for, as in ExportRequest

  // InvalidArgument names the option and the remedy.
  absl::Status Validate() const;
};

// Writes <out>/<frame>.png, <out>/<frame>.normal.png, and export.json last; it stops and goes on as
// ExportResult does. Pictures that the dump lacks are left out, with a line in the warnings. Errors of
// ExportResult; of PlanOverlays, where a texture is asked for.
absl::StatusOr<ExportOutcome> ExportTextures(const TextureRequest& request, const ExportProgress& progress,
                                             const std::stop_token& stop);

}  // namespace weft

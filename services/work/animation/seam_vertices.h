// Which vertices lie near seams, as the atlas has them.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/atlas/atlas.h"

namespace weft {

// [vertices], whether the atlas shows a vertex within so many texels of a place where another panel is sewn
// on. Seams between cloth that hangs together on the board are none. Errors of Atlas::Build.
absl::StatusOr<std::vector<bool>> VerticesNearSeams(const Template& garment, const AtlasOptions& options,
                                                    int texels);

}  // namespace weft

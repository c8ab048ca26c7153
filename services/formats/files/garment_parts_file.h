// What a template's folder tells beyond mesh and cells.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/garment_parts.h"
#include "alignment/template.h"

namespace weft {

// WriteTemplate with parts: in template.json, and the mesh with its texture (alignment/mesh_texture.h).
absl::Status WriteTemplateWithParts(const std::string& folder, const Template& garment,
                                    const GarmentParts& parts, const std::string& provenance);

// The parts that template.json lists, with the texture coordinates of the mesh; empty for a template without.
// Errors as ReadTemplate, and InvalidArgument for parts that do not fit the mesh.
absl::StatusOr<GarmentParts> ReadGarmentParts(const std::string& path);

}  // namespace weft

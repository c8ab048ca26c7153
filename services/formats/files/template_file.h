// A template's folder: template.json, mesh.ply, cells.txt and, where vertices are corners, corners.txt.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"

namespace weft {

// Reads a template's folder, or its template.json. InvalidArgument names file and field: unknown fields, a
// map that does not fit the mesh (also by CheckTemplateMap), a hash that does not fit the files.
absl::StatusOr<Template> ReadTemplate(const std::string& path);

// For a job on this board: errors also of CheckTemplateFitsBoard and CheckTemplateOnBoard. Adds to `notes`
// what of the mesh's size an operator should know.
absl::StatusOr<Template> ReadTemplateFor(const Board& board, const std::string& path,
                                         std::vector<std::string>* notes);

// Writes the folder (made where it is missing); template.json comes last.
absl::Status WriteTemplate(const std::string& folder, const Template& garment,
                           const std::string& provenance = "");

// InvalidArgument with both hashes when the garment was not sewn from this board.
absl::Status CheckTemplateFitsBoard(const Template& garment, const Board& board);

}  // namespace weft

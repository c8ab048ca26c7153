#include "services/formats/synthetic/studio_files.h"

#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_file.h"
#include "pattern/board/panel_mask.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/rig_file.h"

namespace weft {

absl::Status WriteStudio(const SyntheticTake& take, const std::string& folder) {
  const std::string provenance = absl::StrCat("made by weft simulate, ", take.options().name);
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  absl::Status status =
      WriteRig((std::filesystem::path(folder) / "rig.json").string(), take.rig(), provenance);
  if (status.ok()) status = WriteBoard(folder, take.board(), provenance);
  GarmentParts parts;
  parts.board_rows = take.board().rows, parts.board_cols = take.board().cols;
  if (status.ok()) {
    status = WriteTemplateWithParts((std::filesystem::path(folder) / "template").string(), take.garment(),
                                    parts, provenance);
  }
  if (!take.board().parts.empty()) return status;  // each garment's template is built by itself
  // For `weft template build --panels`.
  std::vector<uint8_t> in_garment(take.board().cells.size(), 0);
  for (const VertexNode& cell : take.garment().node_of_vertex)
    if (cell.IsCell()) in_garment[static_cast<size_t>(cell.row) * take.board().cols + cell.col] = 255;
  if (status.ok())
    status = WriteImageFile((std::filesystem::path(folder) / "panels.png").string(),
                            PanelsToMask(in_garment, take.board().rows, take.board().cols));
  return status;
}

}  // namespace weft

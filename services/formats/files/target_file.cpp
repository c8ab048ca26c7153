#include "services/formats/files/target_file.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/json_file.h"
#include "weft/v1/calibration.pb.h"

namespace weft {

absl::StatusOr<CalibrationTarget> ReadTarget(const std::string& path) {
  v1::CalibrationTarget proto;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path, proto, kInputJson));
  CalibrationTarget target;
  target.id = proto.id();
  for (const v1::TagBoard& board : proto.boards()) {
    target.boards.push_back({board.id(),
                             board.family(),
                             board.rows(),
                             board.cols(),
                             board.tag_mm(),
                             board.gap_mm(),
                             {board.tag_ids().begin(), board.tag_ids().end()}});
  }
  for (const v1::ScaleBar& bar : proto.scale_bars()) {
    target.scale_bars.push_back({bar.id(), bar.family(), bar.first_tag(), bar.second_tag(), bar.length_mm()});
  }
  if (absl::Status status = target.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", status.message()));
  }
  return target;
}

absl::Status WriteTarget(const std::string& path, const CalibrationTarget& target) {
  WEFT_RETURN_IF_ERROR(target.Validate());
  v1::CalibrationTarget proto;
  proto.set_id(target.id);
  for (const TagBoard& board : target.boards) {
    v1::TagBoard& to = *proto.add_boards();
    to.set_id(board.id);
    to.set_family(board.family);
    to.set_rows(board.rows);
    to.set_cols(board.cols);
    to.set_tag_mm(board.tag_mm);
    to.set_gap_mm(board.gap_mm);
    for (const int tag : board.tag_ids) to.add_tag_ids(tag);
  }
  for (const ScaleBar& bar : target.scale_bars) {
    v1::ScaleBar& to = *proto.add_scale_bars();
    to.set_id(bar.id);
    to.set_family(bar.family);
    to.set_first_tag(bar.first_tag);
    to.set_second_tag(bar.second_tag);
    to.set_length_mm(bar.length_mm);
  }
  return WriteJsonFile(path, proto, JsonZeros::kOmitted);
}

}  // namespace weft

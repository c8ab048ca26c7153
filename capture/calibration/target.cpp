#include "capture/calibration/target.h"

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Numbers of the AprilTag library's generated families.
const TagFamilyInfo kFamilies[] = {{"tag36h11", 587, 10, 8}, {"tagStandard41h12", 2115, 9, 5}};

Eigen::Vector2d UnitPlace(const TagBoard& board, const Eigen::Vector2d& flat_mm) {
  return {2 * flat_mm.x() / board.width_mm(), 2 * flat_mm.y() / board.height_mm()};
}

// What can be printed and seen; anything else is in another unit.
constexpr double kSmallestTag_mm = 2, kLargestTag_mm = 5000;

using UsedTags = std::set<std::pair<std::string, int>>;

absl::Status CheckTag(const std::string& who, const std::string& family, int tag, UsedTags& used) {
  const std::optional<TagFamilyInfo> info = FindTagFamily(family);
  if (!info) {
    return absl::InvalidArgumentError(
        absl::StrCat(who, ": family is \"", family, "\"; known are tag36h11 and tagStandard41h12"));
  }
  if (tag < 0 || tag >= info->codes) {
    return absl::InvalidArgumentError(
        absl::StrCat(who, ": tag id ", tag, " is not in ", family, " (0 to ", info->codes - 1, ")"));
  }
  if (!used.insert({family, tag}).second) {
    return absl::InvalidArgumentError(absl::StrCat(
        who, ": tag id ", tag, " is used twice; boards and bars of one target need ids of their own"));
  }
  return absl::OkStatus();
}

absl::Status CheckBoard(const TagBoard& board, UsedTags& used) {
  const std::string who = absl::StrCat("board ", board.id.empty() ? "(no id)" : board.id);
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(who, ": ", what));
  };
  if (board.id.empty()) return bad("id is empty; every board needs one");
  if (board.rows < 1 || board.rows > 100)
    return bad(absl::StrCat("rows is ", board.rows, ", expected 1 to 100"));
  if (board.cols < 1 || board.cols > 100)
    return bad(absl::StrCat("cols is ", board.cols, ", expected 1 to 100"));
  if (!(board.tag_mm > 0)) return bad("tag_mm must be a positive length");
  if (board.tag_mm < kSmallestTag_mm)
    return bad(absl::StrCat("tag_mm is ", board.tag_mm,
                            "; lengths are in mm, and no camera reads tags of less "
                            "than ",
                            kSmallestTag_mm, " mm: a tag of ", board.tag_mm, " m has ", 1000 * board.tag_mm));
  if (board.tag_mm > kLargestTag_mm)
    return bad(absl::StrCat("tag_mm is ", board.tag_mm, "; lengths are in mm, and tags of more than ",
                            kLargestTag_mm, " mm are none to print: a tag of ", board.tag_mm, " um has ",
                            board.tag_mm / 1000));
  if (static_cast<int>(board.tag_ids.size()) != board.rows * board.cols) {
    return bad(absl::StrCat("tag_ids has ", board.tag_ids.size(),
                            " ids, expected rows * cols = ", board.rows * board.cols));
  }
  for (const int tag : board.tag_ids) {
    WEFT_RETURN_IF_ERROR(CheckTag(who, board.family, tag, used));
  }
  const TagFamilyInfo family = *FindTagFamily(board.family);
  const double least_gap_mm =
      board.tag_mm * (family.width_modules - family.border_modules) / 2 / family.border_modules;
  if (!(board.gap_mm >= least_gap_mm - 1e-9)) {
    return bad(absl::StrCat("gap_mm is ", board.gap_mm, "; ", board.family, " needs ", least_gap_mm,
                            " mm around tags of ", board.tag_mm, " mm"));
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<TagFamilyInfo> FindTagFamily(const std::string& name) {
  for (const TagFamilyInfo& family : kFamilies) {
    if (family.name == name) return family;
  }
  return std::nullopt;
}

absl::Status CalibrationTarget::Validate() const {
  if (boards.empty()) {
    return absl::InvalidArgumentError("target: boards is empty; make one with `weft rig target`");
  }
  UsedTags used;
  std::set<std::string> names;
  for (const TagBoard& board : boards) {
    WEFT_RETURN_IF_ERROR(CheckBoard(board, used));
    if (!names.insert(board.id).second) {
      return absl::InvalidArgumentError(absl::StrCat("target: board id ", board.id, " occurs twice"));
    }
  }
  for (const ScaleBar& bar : scale_bars) {
    const std::string who = absl::StrCat("scale bar ", bar.id);
    if (!(bar.length_mm > 0))
      return absl::InvalidArgumentError(who + ": length_mm must be a positive length");
    for (const int tag : {bar.first_tag, bar.second_tag}) {
      WEFT_RETURN_IF_ERROR(CheckTag(who, bar.family, tag, used));
    }
  }
  return absl::OkStatus();
}

Eigen::Vector3d FlatCorner(const TagBoard& board, int corner) {
  const int tag = corner / 4, k = corner % 4;
  const double pitch_mm = board.tag_mm + board.gap_mm;
  const double left = (tag % board.cols) * pitch_mm - board.width_mm() / 2;
  const double top = (tag / board.cols) * pitch_mm - board.height_mm() / 2;
  return {left + (k == 1 || k == 2 ? board.tag_mm : 0), top + (k >= 2 ? board.tag_mm : 0), 0};
}

Eigen::Vector3d WarpedPoint(const TagBoard& board, const BoardWarp& warp, const Eigen::Vector2d& flat_mm) {
  const Eigen::Vector2d at = UnitPlace(board, flat_mm);
  return {flat_mm.x() * (1 + warp.stretch / 2), flat_mm.y() * (1 - warp.stretch / 2),
          warp.bend_xx_mm * (at.x() * at.x() - 1.0 / 3) + warp.bend_xy_mm * at.x() * at.y() +
              warp.bend_yy_mm * (at.y() * at.y() - 1.0 / 3)};
}

Eigen::Matrix<double, 3, kWarpUnknowns> WarpDerivative(const TagBoard& board,
                                                       const Eigen::Vector2d& flat_mm) {
  const Eigen::Vector2d at = UnitPlace(board, flat_mm);
  Eigen::Matrix<double, 3, kWarpUnknowns> out = Eigen::Matrix<double, 3, kWarpUnknowns>::Zero();
  out.row(2) << at.x() * at.x() - 1.0 / 3, at.x() * at.y(), at.y() * at.y() - 1.0 / 3, 0;
  out(0, 3) = flat_mm.x() / 2;
  out(1, 3) = -flat_mm.y() / 2;
  return out;
}

}  // namespace weft

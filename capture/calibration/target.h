// What is moved through the volume to calibrate a rig: boards of AprilTags, and scale bars.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace weft {

// A family by its library name, "tag36h11" or "tagStandard41h12".
struct TagFamilyInfo {
  std::string name;
  int codes = 0;           // ids are 0 to codes - 1
  int width_modules = 0;   // of the whole drawing, its quiet zone included
  int border_modules = 0;  // of the square between whose corners the tag's size is measured
};
// Empty for a name that is no supported family.
std::optional<TagFamilyInfo> FindTagFamily(const std::string& name);

// A grid of tags of one family on a stiff board. Board coordinates: origin in the middle, x along the columns
// to the right, y down the rows, z into the board, mm. `tag_mm` is the side of a tag's border square,
// `gap_mm` the space between those of neighbours.
struct TagBoard {
  std::string id;
  std::string family = "tag36h11";
  int rows = 0;
  int cols = 0;
  double tag_mm = 0;
  double gap_mm = 0;
  std::vector<int> tag_ids;  // [rows * cols], row by row

  bool operator==(const TagBoard&) const = default;
  double width_mm() const { return cols * tag_mm + (cols - 1) * gap_mm; }
  double height_mm() const { return rows * tag_mm + (rows - 1) * gap_mm; }
};

// Two tags on a bar whose centres are a known length apart.
struct ScaleBar {
  std::string id;
  std::string family = "tag36h11";
  int first_tag = 0;
  int second_tag = 0;
  double length_mm = 0;

  bool operator==(const ScaleBar&) const = default;
};

struct CalibrationTarget {
  std::string id;
  std::vector<TagBoard> boards;
  std::vector<ScaleBar> scale_bars;

  bool operator==(const CalibrationTarget&) const = default;
  // At least one board; families known; sizes positive; the gap wide enough for the family's quiet zone; ids
  // in the family's range and each used once. InvalidArgument names board, field and remedy.
  absl::Status Validate() const;
};

// Deviation of a printed board from its drawing. z = bend_xx (u^2 - 1/3) + bend_xy u v + bend_yy (v^2 -
// 1/3) with u and v from -1 to 1 across the board. x is longer by half of `stretch` and y shorter by as
// much.
struct BoardWarp {
  double bend_xx_mm = 0;
  double bend_xy_mm = 0;
  double bend_yy_mm = 0;
  double stretch = 0;
};
inline constexpr int kWarpUnknowns = 4;

// Corner 4 * tag + k of the board, k = 0 top left, 1 top right, 2 bottom right, 3 bottom left of the tag as
// it is printed.
Eigen::Vector3d FlatCorner(const TagBoard& board, int corner);
Eigen::Vector3d WarpedPoint(const TagBoard& board, const BoardWarp& warp, const Eigen::Vector2d& flat_mm);
// d WarpedPoint / d (bend_xx, bend_xy, bend_yy, stretch), [3, 4].
Eigen::Matrix<double, 3, kWarpUnknowns> WarpDerivative(const TagBoard& board, const Eigen::Vector2d& flat_mm);

}  // namespace weft

// Boards as the cameras of a rig see them: what calibration starts from.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace weft {

struct BoardCorner {
  int index = 0;  // of the board, as FlatCorner counts
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d bow_px = Eigen::Vector2d::Zero();  // taken off pixel_px by CorrectSideBows
};

// One board in one image.
struct BoardView {
  int camera = 0;
  int frame = 0;
  int board = 0;
  double blur_px = 0;           // standard deviation of its edges; 0 where not measured
  bool straight_sides = false;  // corners are those of SharpenSquare
  std::vector<BoardCorner> corners;
};

// The centres of a scale bar's tags in one image.
struct BarEndView {
  int camera = 0;
  int frame = 0;
  int bar = 0;
  int end = 0;  // 0 first_tag, 1 second_tag
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
};

struct CalibrationCamera {
  std::string id;
  int width_px = 0;
  int height_px = 0;
};

// Everything that was found in a dump.
struct CalibrationViews {
  std::vector<CalibrationCamera> cameras;
  std::vector<std::string> frames;  // names
  std::vector<BoardView> boards;
  std::vector<BarEndView> bar_ends;
};

}  // namespace weft

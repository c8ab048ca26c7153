// The outlines of lifted panels as runs of points in space.
#pragma once

#include <vector>

#include "alignment/template_build/lift.h"
#include "alignment/template_build/panel_sheet.h"

namespace weft {

// A vertex on an outline (or around a hole) of a panel.
struct BorderPoint {
  int vertex = -1;
  int loop = -1;
  int next = -1, previous = -1;  // points, along the loop: the panel lies to the left seen from outside
  Eigen::Vector3d along = Eigen::Vector3d::Zero();    // unit, in the reference frame, smoothed
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  // unit, in the cloth's surface, away from the panel
};

// All borders of a sheet. Points of a loop are consecutive, in its order.
class PanelBorders {
 public:
  // lifts[0] is the reference; all its panels must have a place.
  PanelBorders(const PanelSheet& sheet, const std::vector<LiftedPanels>& lifts);

  const std::vector<BorderPoint>& points() const { return points_; }
  int size() const { return static_cast<int>(points_.size()); }
  int panel(int point) const { return panel_[point]; }
  const Eigen::Vector3d& at(int point) const { return position_mm_[0][point]; }
  // Distance on the board, [mm].
  double FlatMm(int a, int b) const { return (flat_mm_[a] - flat_mm_[b]).norm(); }
  // Mean distance in space over the clouds that show the cloth at both; over all clouds where none does.
  double SpaceMm(int a, int b) const;
  // Points from a on along the loop to b; both on one loop.
  int StepsAhead(int a, int b) const;

 private:
  std::vector<BorderPoint> points_;
  std::vector<int> panel_, loop_size_;
  std::vector<Eigen::Vector3d> flat_mm_;
  std::vector<std::vector<Eigen::Vector3d>> position_mm_;  // [clouds][points]
  std::vector<std::vector<char>> shown_;                   // [clouds][points]
};

}  // namespace weft

// From the outlines of panels to a sewn mesh with a vertex on every board cell.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/garment.h"

namespace weft {

// A piece of a panel's outline between two named corners. Edges of the same seam are sewn together, two of
// them; an edge whose seam occurs once is a border. Corners of the same name become one vertex.
struct PanelEdge {
  std::string seam;
  std::string from, to;
  std::vector<Eigen::Vector2d> path_mm;  // from the first corner to the second, both included
};

// As seen from outside: x right, y down. The edges close a simple outline.
struct Panel {
  std::string name;
  std::vector<PanelEdge> outline;
  bool turned = false;  // lies on the board turned by a quarter
};

// Where a vertex lies: panel and place in it; for seam vertices the first panel that has them.
struct PanelPlace {
  int panel = -1;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
};

struct SewnPanels {
  Garment garment;                                            // its rest vertices are still all zero
  std::vector<PanelPlace> place_of_vertex;                    // [vertices]
  std::vector<int> panel_of_face;                             // [faces]
  std::vector<std::array<Eigen::Vector2d, 3>> place_of_face;  // [faces], its corners in its panel, [mm]
  std::map<std::string, std::vector<int>> of_seam;  // vertices of each seam and border, from corner to corner
};

// Lays the panels side by side on a board, a cell apart, and sews them. Every cell at least about half a
// cell inside a panel's outline has a vertex at its centre. Seams and borders have vertices without cell,
// about a cell apart. InvalidArgument: a panel too small for the cell, or sewn edges that do not join the
// same corners.
absl::StatusOr<SewnPanels> SewPanels(const std::vector<Panel>& panels, double cell_mm);

// Positions of the vertices of `fine` on `coarse` at `coarse_mm`, both sewn of the same panels. Seams map
// to seams, all other vertices to the same position in the panel.
std::vector<Eigen::Vector3d> PositionsOn(const SewnPanels& coarse,
                                         const std::vector<Eigen::Vector3d>& coarse_mm,
                                         const SewnPanels& fine);

double LengthMm(const std::vector<Eigen::Vector2d>& path_mm);

// A cubic Bezier curve as a path of 65 points.
std::vector<Eigen::Vector2d> BezierPath(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                        const Eigen::Vector2d& c, const Eigen::Vector2d& d);

}  // namespace weft

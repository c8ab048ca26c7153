// Vertices at the corners between cells, for twice the resolution.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/template.h"
#include "alignment/template_build/panel_sheet.h"
#include "alignment/template_build/rest_shape.h"

namespace weft {

// A corner with all four cells around it in one panel. Corners at a panel's border have no vertex: nothing of
// the print is beyond them, and seams and openings stay as they are.
struct CornerVertex {
  VertexNode node;
  std::array<int, 4> around;  // vertices of cells (r-1, c-1), (r-1, c), (r, c-1), (r, c) for corner (r, c)
};

// A sheet with its inner corners cut in: four triangles around each, in place of the two between its cells.
struct CutSheet {
  std::vector<CornerVertex> corners;  // by row and column within each panel, the panels in order
  std::vector<Face> faces;            // corner i is vertex first_corner + i
};
CutSheet CutAtCorners(const PanelSheet& sheet, int first_corner);

// Where the corners are when the cells' vertices are at `position_mm`: on the smooth surface through the
// cells around, by cubic interpolation in both directions of the board. The middle of the four would lie
// beside it wherever the cloth is bent.
std::vector<Eigen::Vector3d> CornerPlaces(const PanelSheet& sheet, const std::vector<CornerVertex>& corners,
                                          const std::vector<Eigen::Vector3d>& position_mm);

// Both for a sewn mesh, of which the sheet's vertices and faces are the first: corners come behind all other
// vertices, and nothing else changes, for they lie within panels.
void AddCornerVertices(const PanelSheet& sheet, RestShapeProblem* problem,
                       std::vector<Eigen::Vector3d>* rest_mm, std::vector<VertexNode>* nodes,
                       std::vector<Eigen::Vector2d>* texture_mm);

}  // namespace weft

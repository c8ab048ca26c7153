// A printed garment of any kind: mesh at rest, cell of each vertex, print.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/template.h"
#include "simulation/printed_mesh.h"

namespace weft {

enum class GarmentKind {
  kSheet,
  kTube,
  kSkirt,
  kTShirt,
  kPleatedSkirt,
  kGatheredSkirt,
  kCurlingSheet,
  kShirtAndSkirt
};

// "sheet", "tube", "skirt", "tshirt", "pleated-skirt", "gathered-skirt", "curling-sheet", "shirt-and-skirt".
std::string_view NameOf(GarmentKind kind);

// One of several garments that are worn together: its vertices, faces and rows of the board are contiguous.
struct WornGarment {
  std::string name;
  int first_vertex = 0, vertices = 0;
  int first_face = 0, faces = 0;
  int first_row = 0, rows = 0, cols = 0;  // its board on the joint one
};

// Panels cut from one board and sewn. A vertex is the centre of a board cell, or lies without a cell on a
// seam or hem. Seam vertices belong to the faces on both sides, so the mesh is closed there.
struct Garment {
  int board_rows = 0;  // the least board that holds the panels
  int board_cols = 0;
  double cell_mm = 0;
  TriangleMesh rest;                       // in a natural pose
  std::vector<VertexNode> cell_of_vertex;  // [vertices]
  ClothPrint print;  // [faces], also the flat shape: a face corner lies at cell_mm times its board point
  std::vector<WornGarment> worn;  // of several garments, the innermost first; empty: one garment
};

}  // namespace weft

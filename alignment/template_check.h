// Whether a template's mesh lies on its board as its map says: each vertex is the cell that it is said to be,
// faces show the printed side, and edges are as long as on the print. The one check of import, build, join,
// check and jobs.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/print_scale.h"
#include "alignment/printed_side.h"
#include "alignment/template.h"
#include "pattern/board/board.h"

namespace weft {

// Vertices that an edge joins are neighbours on the board, and all faces show the printed side. Needs mesh
// and map alone. InvalidArgument:
// - names vertices that are apart, and how the map fits where that is plain (reversed, shifted by a line).
// Panels
//   that are sewn without vertices of their own along the seam pass: their vertices have neighbours on the
//   board, too;
// - says how many faces show the inside, or what of ShowPrintedSide is wrong.
// Garments of a joint template are judged each by itself.
absl::Status CheckTemplateMap(const Template& garment);

// The first part of it.
absl::Status CheckVertexOrder(const Template& garment);

// Sizes against the print, of each garment.
struct TemplateSize {
  std::vector<PrintScale> scales;
  std::vector<std::string> off;        // what an operator should know, in sentences
  std::vector<std::string> unchecked;  // what could not be told
};
// InvalidArgument as CheckPrintScale, unless `any_scale` says that another size is meant. `cell_mm` is that
// of every garment, 0 where it is unknown.
absl::StatusOr<TemplateSize> CheckTemplateSize(const Template& garment, double cell_mm, bool any_scale);
// With the size of the board's cells. InvalidArgument also for cells outside of the board's panels, where it
// has any: of no cloth, or of another part of the board.
absl::StatusOr<TemplateSize> CheckTemplateOnBoard(const Template& garment, const Board& board,
                                                  bool any_scale);

// All of it, for a template that comes from elsewhere: turns its faces to the printed side. Errors as above.
struct TemplateOnBoard {
  TurnedFaces turned;
  TemplateSize size;
};
absl::StatusOr<TemplateOnBoard> PutOnBoard(const Board& board, FaceSideSaid said, bool any_scale,
                                           Template* garment);

}  // namespace weft

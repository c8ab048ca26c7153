// Which side of a template's faces is printed.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/face_sides.h"
#include "alignment/mapped_mesh.h"

namespace weft {

// Faces that a mesh may have turned so that all show the printed side, and how many were.
struct TurnedFaces {
  int faces = 0;
  bool inside_out = false;  // all of a garment, or most
};

// Whether the caller knows that faces show the inside of the garment, where the mesh does not tell: a sheet
// may as well be mirrored.
enum class FaceSideSaid { kNothing, kInside };

// On the print columns run to the right and rows down, seen from outside, and faces run counter-clockwise. So
// each face between cells tells which side it shows. Turns those that show the inside. InvalidArgument:
// - faces of one surface contradict each other on the board, however it is turned: the map is of other
// vertices;
// - the mesh is mirrored, or its map: all faces can show the print, or the outside of the garment, but not
// both;
// - all faces of a sheet show the inside, and nothing was said: it may be mirrored as well;
// - a surface with one side.
absl::StatusOr<TurnedFaces> ShowPrintedSide(const std::vector<VertexNode>& nodes, FaceSideSaid said,
                                            TriangleMesh* mesh);

// For faces that are not to be turned: all show the printed side. Whether any runs against the print, and
// which side they show together, the caller knows already. InvalidArgument as above, or says how many show
// the inside.
absl::Status CheckPrintedSide(std::span<const Face> faces, const Mapped& mapped, bool any_against,
                              ShownSide shown);

}  // namespace weft

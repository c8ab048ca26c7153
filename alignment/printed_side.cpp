#include "alignment/printed_side.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Of the faces of a component: those that run as on the print, or against it, once all are turned like the
// first.
struct Senses {
  int64_t right = 0, wrong = 0;
  int64_t turned = 0, faces = 0;
  int wrong_face = -1, right_face = -1;  // the first of each
};

std::vector<Senses> CountSenses(std::span<const Face> faces, const FaceSides& sides, const Mapped& mapped) {
  std::vector<Senses> senses(static_cast<size_t>(sides.components));
  for (size_t f = 0; f < faces.size(); ++f) {
    Senses& all = senses[static_cast<size_t>(sides.component[f])];
    ++all.faces;
    all.turned += sides.turned[f];
    const int sense = OnBoard(faces[f], mapped).sense * (sides.turned[f] ? -1 : 1);
    if (sense > 0 && all.right++ == 0) all.right_face = static_cast<int>(f);
    if (sense < 0 && all.wrong++ == 0) all.wrong_face = static_cast<int>(f);
  }
  return senses;
}

absl::Status Contradiction(std::span<const Face> faces, const Senses& senses,
                           const std::vector<VertexNode>& nodes) {
  const bool few_wrong = senses.wrong < senses.right;
  const Face& face = faces[static_cast<size_t>(few_wrong ? senses.wrong_face : senses.right_face)];
  return absl::InvalidArgumentError(absl::StrCat(
      VertexText(face[0], nodes), ", ", VertexText(face[1], nodes), " and ", VertexText(face[2], nodes),
      ": their face runs the other way round on the board than those beside it, as ",
      std::min(senses.right, senses.wrong), " of ", senses.right + senses.wrong,
      " do. Some vertices have the cells of others.", kOrderRemedy));
}

constexpr char kMirrored[] =
    "seen from outside the print would read backwards: the mesh is mirrored (an axis changed its sign, or "
    "two were "
    "exchanged), or the map is (rows count from the top and columns from the left, seen from the printed "
    "side, and a "
    "line is `row col`). Give mesh and map as they were sewn and printed";
constexpr char kInsideSheet[] =
    "all faces run against the print. Either they show the inside of the cloth: then import it with "
    "--turn-faces. Or "
    "the map is mirrored: rows count from the top and columns from the left, seen from the printed side, and "
    "a line "
    "is `row col`";

// As they would be when all show the printed side.
absl::StatusOr<TurnedFaces> TurnToPrint(const Mapped& mapped, FaceSideSaid said, std::span<Face> faces) {
  const FaceSides sides = FindFaceSides(faces);
  const std::vector<Senses> senses = CountSenses(faces, sides, mapped);
  TurnedFaces turned;
  for (const Senses& all : senses)
    if (all.right > 0 && all.wrong > 0 && sides.one_sided < 0) return Contradiction(faces, all, mapped.nodes);
  if (sides.one_sided >= 0)
    return absl::InvalidArgumentError(
        absl::StrCat("face ", sides.one_sided,
                     ": the surface around it has one side only, so no side of it can be the printed one"));
  for (size_t f = 0; f < faces.size(); ++f) {
    const Senses& all = senses[static_cast<size_t>(sides.component[f])];
    // Nothing of the print in this surface: as most of its faces run.
    const bool like_first = all.right + all.wrong > 0 ? all.wrong == 0 : 2 * all.turned <= all.faces;
    if ((sides.turned[f] != 0) == like_first) {
      std::swap(faces[f][1], faces[f][2]);
      ++turned.faces;
    }
  }
  for (const Senses& all : senses)
    if (all.right + all.wrong > 0) {
      const int64_t changed = all.wrong == 0 ? all.turned : all.faces - all.turned;
      turned.inside_out = turned.inside_out || 2 * changed > all.faces;
    }
  const ShownSide shown = VolumeWithin(mapped.vertices_mm, faces).Side();
  if (shown == ShownSide::kInside) return absl::InvalidArgumentError(kMirrored);
  if (turned.inside_out && shown == ShownSide::kUnknown && said == FaceSideSaid::kNothing)
    return absl::InvalidArgumentError(kInsideSheet);
  return turned;
}

}  // namespace

absl::StatusOr<TurnedFaces> ShowPrintedSide(const std::vector<VertexNode>& nodes, FaceSideSaid said,
                                            TriangleMesh* mesh) {
  return TurnToPrint(MappedOf(mesh->vertices_mm, mesh->faces, nodes), said, mesh->faces);
}

absl::Status CheckPrintedSide(std::span<const Face> faces, const Mapped& mapped, bool any_against,
                              ShownSide shown) {
  if (!any_against)
    return shown == ShownSide::kInside ? absl::InvalidArgumentError(kMirrored) : absl::OkStatus();
  std::vector<Face> copy(faces.begin(), faces.end());
  WEFT_ASSIGN_OR_RETURN(const TurnedFaces turned, TurnToPrint(mapped, FaceSideSaid::kInside, copy));
  return absl::InvalidArgumentError(absl::StrCat(turned.faces, " of ", faces.size(),
                                                 " faces show the inside of the cloth, not the printed side; "
                                                 "import the template again, which turns them"));
}

}  // namespace weft

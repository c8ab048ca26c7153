// A garment as Halimi et al. 2022 (section 6) drive it from two fixed cameras: a deformation graph with a
// prior, and a net that turns distances in pixels into offsets. What our own driver is compared with.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/paper/deformation_graph.h"
#include "animation/paper/graph_prior.h"

namespace weft {

struct PixelAvatar {
  std::string template_hash;  // Template::ContentHash
  std::string board_hash;
  int vertices = 0;
  double fps = 30;  // of the takes that were learnt from
  int training_frames = 0, held_out_frames = 0;
  uint64_t seed = 1;
  GraphOptions graph;
  GraphPrior prior;
  // What the graph leaves of the meshes that it was fitted to, mean distance of the vertices.
  double left_mm = 0;
  AvatarNet net;  // its gain is not measured here

  // InvalidArgument names what is wrong.
  absl::Status Validate() const;
  // FailedPrecondition, with both hashes, for a template or board that it was not made for.
  absl::Status CheckFits(const Template& garment) const;
};

// Its numbers as tables of space.bin: "graph", "unit", and of each layer "weight<k>" and "bias<k>".
std::vector<AvatarTable> TablesOf(const PixelAvatar& avatar);
// InvalidArgument names a table that is missing or of another size.
absl::Status TakeTables(const std::vector<AvatarTable>& tables, PixelAvatar* avatar);
// The layers that such tables hold, as far as they follow each other; Validate says whether they make sense.
std::vector<PriorLayer> LayersOf(const std::vector<AvatarTable>& tables);

}  // namespace weft

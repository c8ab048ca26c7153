// The observations of a frame set, 16 neighbouring nodes at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "triangulation/ray_kernel.h"
#include "triangulation/triangulate.h"

namespace weft {

// Nodes of one kind in one row of the board, those of 16 columns. Used again from group to group.
struct RayGroup {
  // Row of the i-th ray of a node; its rays are ordered by camera, then by place in the view.
  int RowOfRay(int lane, int i) const {
    return rays[lane] == count ? i : rows_of_rays[i * kNodeLanes + lane];
  }

  void AddRow(int camera, bool repeated);
  void CountRays();
  void ListRows();

  BoardNode first_node;
  std::vector<RayRow> rows;  // ordered by camera; the first `count` of them
  int count = 0;
  bool repeats = false;           // some row is of the same camera as the one before
  int rays[kNodeLanes] = {};      // of each node
  int cameras[kNodeLanes] = {};   // distinct, of each node
  std::vector<int> rows_of_rays;  // [ray][lane], where a row lacks some node
};

// Views whose observations are in the order of the groups, in parts of the board that may be read side by
// side. Keeps references to its arguments.
class RayGroups {
 public:
  // InvalidArgument: cameras that the rig lacks. The observations are not evaluated.
  static absl::StatusOr<RayGroups> Build(const Rig& rig, const std::vector<ViewObservations>& views,
                                         const TriangulationOptions& options);

  size_t parts() const { return first_group_.size() - 1; }
  const std::vector<RayCamera>& cameras() const { return cameras_; }

 private:
  friend class RayGroupReader;
  RayGroups() = default;

  std::vector<RayCamera> cameras_;
  std::vector<const ViewObservations*> views_;  // in the order of their cameras
  std::vector<uint32_t> first_group_;           // of each part, and one behind the last
  std::vector<const Observation*> begins_;      // [part][view], those of one part behind the last
};

// Reads the groups of one part, in the order of kind, row, column; each observation once.
class RayGroupReader {
 public:
  RayGroupReader(const RayGroups& groups, size_t part);

  // The next group that was seen; false at the end.
  bool Next(RayGroup* out);
  // Of the part, by one view: about as many as it has nodes.
  size_t most_observations() const { return most_observations_; }
  // Whether so far all observations were valid and in order; where not, the groups are worth nothing.
  bool in_order() const { return in_order_; }

 private:
  struct Cursor {
    const Observation *at, *end;
    int camera;
  };
  void Add(size_t cursor, RayGroup* out);
  void LookAhead(size_t cursor, uint32_t least);

  const std::vector<RayCamera>& cameras_;
  uint32_t end_group_;
  std::vector<Cursor> cursors_;
  std::vector<uint32_t> next_;  // group that each cursor is at
  size_t most_observations_ = 0;
  bool in_order_ = true;
};

// Copies of the views with their observations in the order of the groups. InvalidArgument names camera and
// node of an observation that is not finite, off the range of boards (0 to 4096) or without sigma_px.
absl::StatusOr<std::vector<ViewObservations>> InOrderOfGroups(const Rig& rig,
                                                              const std::vector<ViewObservations>& views);

}  // namespace weft

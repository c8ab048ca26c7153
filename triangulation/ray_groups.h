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
  int RowOfRay(int lane, int i) const;

  void AddRow(int camera, bool repeated);
  void CountRays();

  BoardNode first_node;
  std::vector<RayRow> rows;  // ordered by camera; the first `count` of them
  int count = 0;
  bool repeats = false;          // some row is of the same camera as the one before
  int rays[kNodeLanes] = {};     // of each node
  int cameras[kNodeLanes] = {};  // distinct, of each node
};

// Which observations belong to which group. Keeps references to its arguments.
class RayGroups {
 public:
  // InvalidArgument names camera and node of an observation that is not finite, off the range of boards (0 to
  // 4096) or without sigma_px, and cameras that the rig lacks. Parallel in the calling thread's TBB arena.
  static absl::StatusOr<RayGroups> Build(const Rig& rig, const std::vector<ViewObservations>& views,
                                         const TriangulationOptions& options);

  // Of groups, in the order of kind, row, column; each with at least one observation.
  size_t size() const { return start_.size() - 1; }
  const std::vector<RayCamera>& cameras() const { return cameras_; }

  // May be called by several threads; fastest in the order of the groups.
  void Fill(size_t group, RayGroup* out) const;

 private:
  // Observations of one view behind each other that belong to one group.
  struct Run {
    uint32_t group;  // kind, row and column of its first node as one number
    uint32_t view, first, count;
  };

  explicit RayGroups(const std::vector<ViewObservations>& views) : views_(&views) {}
  static const Observation* FindRuns(const ViewObservations& view, uint32_t number, std::vector<Run>* runs);
  void Sort(const std::vector<std::vector<Run>>& runs);
  void Prefetch(const Run& run) const;
  void Add(const Run& run, RayGroup* out) const;

  const std::vector<ViewObservations>* views_;
  std::vector<RayCamera> cameras_;
  std::vector<Run> runs_;        // ordered by group, then camera
  std::vector<uint32_t> start_;  // of each group in runs_, and their end
};

}  // namespace weft

// The rays of a frame set, node by node, in blocks that fit into a processor's cache.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "triangulation/ray_kernel.h"
#include "triangulation/triangulate.h"

namespace weft {

// The rays of one node: `count` of them, ordered by camera, then by place in the view.
struct NodeRays {
  BoardNode node;
  int first = 0;  // a multiple of 16 in RayBlock::rays
  int count = 0;
};

// The nodes of one block, ordered by kind, row, column, and their rays. Used again from block to block.
struct RayBlock {
  std::vector<NodeRays> nodes;
  std::vector<RayRecord> rays;  // of each node up to a multiple of 16, the spare ones with finite numbers
  RayColumns columns;           // scratch
};

// Which observations belong to which block. Keeps references to its arguments.
class RayBlocks {
 public:
  // InvalidArgument names camera and node of an observation that is not finite, off the range of boards (0 to
  // 4096) or without sigma_px, and cameras that the rig lacks. Parallel in the calling thread's TBB arena.
  static absl::StatusOr<RayBlocks> Build(const Rig& rig, const std::vector<ViewObservations>& views,
                                         const TriangulationOptions& options);

  size_t size() const { return blocks_; }
  const std::vector<RayCamera>& cameras() const { return cameras_; }

  // Observations whose pixel has no ray (the lens model has no inverse there) are left out; nodes stay, if
  // need be with no ray. May be called by several threads.
  void Fill(size_t block, RayBlock* out) const;

 private:
  // Observations of one view by block.
  struct ViewIndex {
    std::vector<uint32_t> slots;  // of the observations: kind, row and column as one number
    std::vector<uint32_t> start;  // [blocks + 1] in `order`
    std::vector<uint32_t> order;  // empty where the observations are in the order of their blocks
  };

  RayBlocks(const Rig& rig, const std::vector<ViewObservations>& views) : rig_(&rig), views_(&views) {}
  void IndexView(size_t view);
  void Prefetch(size_t view, size_t block) const;
  void AddRays(size_t view, size_t block, const std::vector<int32_t>& node_of_slot, RayBlock* out) const;

  const Rig* rig_;
  const std::vector<ViewObservations>* views_;
  std::vector<RayCamera> cameras_;
  std::vector<size_t> by_camera_;  // views in the order of their cameras
  std::vector<ViewIndex> index_;   // [views]
  uint32_t rows_ = 0, cols_ = 0;
  int block_bits_ = 0;  // slots per block, as a power of two
  size_t blocks_ = 0;
};

}  // namespace weft

// A driver in a TBB arena of its own, so that its times are those of so many threads.
#pragma once

#include <tbb/task_arena.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "capture/rig/rig.h"
#include "triangulation/triangulate.h"

namespace weft {

// Not for use by two threads at once.
class TimedDriver {
 public:
  // `arena` must outlive the driver. Errors of SparseViewDriver.
  static absl::StatusOr<TimedDriver> Create(const Template& garment, const SparseViewAvatar& avatar,
                                            tbb::task_arena& arena);

  // Adds the time that it took.
  absl::StatusOr<DrivenFrame> Drive(int64_t time_ns, const std::vector<ViewObservations>& seen,
                                    const Rig& rig, std::vector<double>& ms);
  void Reset() { driver_.Reset(); }

 private:
  TimedDriver(SparseViewDriver driver, tbb::task_arena& arena) : driver_(std::move(driver)), arena_(&arena) {}

  SparseViewDriver driver_;
  tbb::task_arena* arena_;
};

}  // namespace weft

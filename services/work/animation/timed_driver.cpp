#include "services/work/animation/timed_driver.h"

#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"

namespace weft {

absl::StatusOr<TimedDriver> TimedDriver::Create(const Template& garment, const SparseViewAvatar& avatar,
                                                tbb::task_arena& arena) {
  WEFT_ASSIGN_OR_RETURN(SparseViewDriver driver, SparseViewDriver::Create(garment, avatar));
  return TimedDriver(std::move(driver), arena);
}

absl::StatusOr<DrivenFrame> TimedDriver::Drive(int64_t time_ns, const std::vector<ViewObservations>& seen,
                                               const Rig& rig, std::vector<double>& ms) {
  const std::vector<DrivingView> views = DrivingViewsOf(seen, rig);
  absl::StatusOr<DrivenFrame> driven;
  const Stopwatch watch;
  arena_->execute([&] { driven = driver_.Drive(time_ns, views); });
  ms.push_back(watch.Ms());
  return driven;
}

}  // namespace weft

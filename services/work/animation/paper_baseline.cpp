#include "services/work/animation/paper_baseline.h"

#include <tbb/task_arena.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/pixel_avatar_file.h"

namespace weft {

absl::StatusOr<std::optional<PixelAvatar>> ReadBaseline(const std::string& path, const Template& garment,
                                                        const std::string& garment_path) {
  if (path.empty()) return std::nullopt;
  WEFT_ASSIGN_OR_RETURN(PixelAvatarFile read, ReadPixelAvatar(path));
  WEFT_RETURN_IF_ERROR(CheckAvatarFits(read.about, path, garment, garment_path));
  return std::move(read.avatar);
}

absl::Status PaperBaseline::Begin(int cameras) {
  driver_.reset();
  if (avatar_ == nullptr || cameras != kPixelCameras) return absl::OkStatus();
  absl::StatusOr<PixelDriver> driver = PixelDriver::Create(garment_, *avatar_);
  if (driver.ok()) driver_ = *std::move(driver);
  return driver.status();
}

absl::Status PaperBaseline::Add(const Frame& frame, const std::string& split, const char* suffix,
                                tbb::task_arena& driving, ScoreTable& scores) {
  if (!driver_) return absl::OkStatus();
  const std::vector<DrivingView> views = DrivingViewsOf(frame.seen, frame.rig);
  absl::StatusOr<PixelDrivenFrame> driven;
  const Stopwatch watch;
  driving.execute([&] { driven = driver_->Drive(views); });
  const double ms = watch.Ms();
  if (!driven.ok()) return driven.status();
  absl::Status status;
  const auto add = [&](const char* method, const std::vector<Eigen::Vector3d>& vertices_mm) -> ScoreTally& {
    ScoreTally& tally = scores.At(split, kPixelCameras, absl::StrCat(method, suffix));
    tally.lost_frames += driven->lost ? 1 : 0;
    if (!driven->lost)
      status.Update(
          tally.score.Add({vertices_mm, {}}, frame.truth.vertices_mm, frame.directions, frame.follows));
    return tally;
  };
  if (*suffix == 0) add("paper carrier", driven->carrier_mm);
  add("paper", driven->position_mm).ms.push_back(ms);
  return status;
}

}  // namespace weft

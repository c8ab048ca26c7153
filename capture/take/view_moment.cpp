#include "capture/take/view_moment.h"

#include <cmath>

namespace weft {
namespace {

constexpr double kAtTheMoment = 0.002;
constexpr double kNearer = 0.6;   // the image of the frame itself is the nearer one, nearly
constexpr double kLongest_s = 1;  // cloth is elsewhere by then

double TimeInSeconds(int64_t time_ns) { return static_cast<double>(time_ns) / 1e9; }

}  // namespace

std::optional<ViewMoment> MomentOfView(const FrameSource& dump, size_t index, size_t camera) {
  const std::optional<int64_t> frame_ns = dump.FrameTime_ns(index), view_ns = dump.ViewTime_ns(index, camera);
  if (!frame_ns || !view_ns || *view_ns == *frame_ns) return std::nullopt;
  const bool is_late = *view_ns > *frame_ns;
  if (is_late ? index == 0 : index + 1 >= dump.frame_names().size()) return std::nullopt;
  const size_t other = is_late ? index - 1 : index + 1;
  const std::optional<int64_t> other_ns = dump.ViewTime_ns(other, camera);
  if (!other_ns) return std::nullopt;
  const ViewMoment moment{TimeInSeconds(*view_ns - *frame_ns), TimeInSeconds(*other_ns - *frame_ns), other};
  const double apart_s = std::abs(moment.own_s - moment.other_s);
  const bool between = moment.own_s * moment.other_s < 0;
  const bool is_far = std::abs(moment.own_s) > kNearer * apart_s || apart_s > kLongest_s;
  if (!between || is_far || std::abs(moment.own_s) < kAtTheMoment * apart_s) return std::nullopt;
  return moment;
}

}  // namespace weft

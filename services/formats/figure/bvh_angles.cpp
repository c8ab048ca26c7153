#include "services/formats/figure/bvh_angles.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"

namespace weft {
namespace {

bool IsRotation(BvhChannel channel) {
  return channel >= BvhChannel::kXRotation && channel <= BvhChannel::kZRotation;
}

// How far the farthest joint is from the root, along the bones.
double Reach(const std::vector<ForeignMotion::Joint>& joints) {
  std::vector<double> along(joints.size(), 0);
  double reach = 0;
  for (size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].parent < 0) continue;
    along[j] = along[static_cast<size_t>(joints[j].parent)] + joints[j].offset.norm();
    reach = std::max(reach, along[j]);
  }
  return reach;
}

// What the numbers of all rows say.
class Channels {
 public:
  Channels(const BvhHierarchy& hierarchy, const std::vector<double>& values)
      : hierarchy_(hierarchy), values_(values), rows_(values.size() / hierarchy.numbers) {
    size_t at = 0;
    for (size_t j = 0; j < hierarchy.channels.size(); ++j) {
      double farthest = 0;
      bool turns = false;
      for (const BvhChannel channel : hierarchy.channels[j]) {
        const double most = MostOf(at);
        if (IsRotation(channel)) {
          most_ = std::max(most_, most);
          farthest = std::max(farthest, most);
          turns = true;
        } else if (channel <= BvhChannel::kZPosition && hierarchy.joints[j].parent <= 0) {
          way_ = std::max(way_, RangeOf(at));
        }
        ++at;
      }
      // The root turns as the person does, once around and more.
      if (turns && hierarchy.joints[j].parent >= 0) farthest_.push_back(farthest);
    }
  }

  double most() const { return most_; }  // of all angles
  double way() const { return way_; }    // of the root, or of what hangs on it, along an axis
  // Of the joints below the root, how far each turns at most, in the median.
  double usual() const { return farthest_.empty() ? 0 : Median(farthest_); }

 private:
  double MostOf(size_t channel) const {
    double most = 0;
    for (size_t row = 0; row < rows_; ++row)
      most = std::max(most, std::abs(values_[row * hierarchy_.numbers + channel]));
    return most;
  }
  double RangeOf(size_t channel) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (size_t row = 0; row < rows_; ++row) {
      low = std::min(low, values_[row * hierarchy_.numbers + channel]);
      high = std::max(high, values_[row * hierarchy_.numbers + channel]);
    }
    return high - low;
  }

  const BvhHierarchy& hierarchy_;
  const std::vector<double>& values_;
  size_t rows_;
  double most_ = 0, way_ = 0;
  std::vector<double> farthest_;
};

}  // namespace

AngleJudgement JudgeBvhAngles(const BvhHierarchy& hierarchy, const std::vector<double>& values) {
  // Joints that turn by less than 6 degrees in radians hardly move in either unit. Half of a person's joints
  // turn by less than a right angle.
  constexpr double kLeast = 0.1, kUsual = std::numbers::pi / 2, kMost = 2 * std::numbers::pi + 1e-3;
  constexpr double kGoes = 0.25;  // of the reach: a step
  constexpr size_t kFewestRotations = 9;
  size_t rotations = 0;
  for (const std::vector<BvhChannel>& channels : hierarchy.channels)
    rotations += static_cast<size_t>(std::ranges::count_if(channels, IsRotation));
  const Channels seen(hierarchy, values);
  if (rotations < kFewestRotations || seen.most() > kMost || seen.most() < kLeast || seen.usual() > kUsual)
    return {};
  const std::string below = absl::StrFormat("no angle is above %.3g", seen.most());
  if (seen.way() > kGoes * Reach(hierarchy.joints))
    return {true, absl::StrCat(below,
                               " and the person goes somewhere, so angles were taken as radians; "
                               "--angles degrees takes them as degrees")};
  return {false, absl::StrCat(below,
                              "; they were taken as degrees, with which the person hardly moves. If they "
                              "are radians, give --angles radians")};
}

}  // namespace weft

#include "capture/take/view_moment.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

constexpr int64_t kPeriod_ns = 40'000'000;

// Frames every 40 ms; the one camera looks `late_ns` after each.
class LateCamera : public FrameSource {
 public:
  explicit LateCamera(int64_t late_ns) : late_ns_(late_ns) {}

  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::UnimplementedError(""); }
  absl::StatusOr<Frame> ReadView(size_t, size_t) const override { return absl::UnimplementedError(""); }
  absl::StatusOr<std::string> Fingerprint(size_t) const override { return ""; }
  const std::vector<std::string>& warnings() const override { return warnings_; }
  std::optional<int64_t> ViewTime_ns(size_t index, size_t) const override {
    if (index == missing_) return std::nullopt;
    return static_cast<int64_t>(index) * kPeriod_ns + late_ns_;
  }
  std::optional<int64_t> FrameTime_ns(size_t index) const override {
    return static_cast<int64_t>(index) * kPeriod_ns;
  }
  size_t missing_ = 9;

 private:
  const int64_t late_ns_;
  const std::vector<std::string> names_ = {"0000", "0001", "0002"};
  const std::vector<std::string> warnings_;
};

TEST(MomentOfView, NamesTheFrameOnTheOtherSide) {
  const auto late = MomentOfView(LateCamera(10'000'000), 1, 0);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->other, 0u);
  EXPECT_DOUBLE_EQ(late->own_s, 0.01);
  EXPECT_DOUBLE_EQ(late->other_s, -0.03);
  const auto early = MomentOfView(LateCamera(-15'000'000), 1, 0);
  ASSERT_TRUE(early);
  EXPECT_EQ(early->other, 2u);
  EXPECT_DOUBLE_EQ(early->own_s, -0.015);
  EXPECT_DOUBLE_EQ(early->other_s, 0.025);
}

TEST(MomentOfView, IsNothingWhereNothingIsToBeMoved) {
  EXPECT_FALSE(MomentOfView(LateCamera(0), 1, 0));
  EXPECT_FALSE(MomentOfView(LateCamera(50'000), 1, 0));       // a thousandth of the period
  EXPECT_FALSE(MomentOfView(LateCamera(30'000'000), 1, 0));   // another frame is nearer
  EXPECT_FALSE(MomentOfView(LateCamera(10'000'000), 0, 0));   // there is none before
  EXPECT_FALSE(MomentOfView(LateCamera(-10'000'000), 2, 0));  // nor after
  LateCamera gap(10'000'000);
  gap.missing_ = 0;
  EXPECT_FALSE(MomentOfView(gap, 1, 0));
}

}  // namespace
}  // namespace weft

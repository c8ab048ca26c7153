#include "capture/take/frame_set_reading.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace weft {
namespace {

class HalfASource final : public FrameSource {
 public:
  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::InternalError("not asked"); }
  absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const override {
    if (camera == 1) return absl::DataLossError("torn");
    Frame frame;
    frame.width_px = static_cast<int>(10 * index + camera);
    return frame;
  }
  absl::StatusOr<std::string> Fingerprint(size_t) const override { return std::string(16, '0'); }
  const std::vector<std::string>& warnings() const override { return names_; }

 private:
  const std::vector<std::string> names_ = {"0000", "0007"};
};

Rig RigOfThree() {
  Rig rig;
  rig.cameras.resize(3);
  for (size_t i = 0; i < 3; ++i) rig.cameras[i].id = "c" + std::to_string(i);
  return rig;
}

TEST(ReadFrameSet, HasViewsInTheRigsOrderAndSaysWhichAreMissing) {
  const auto set = ReadFrameSet(HalfASource(), RigOfThree(), 1);
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->name, "0007");
  ASSERT_EQ(set->frames.size(), 2u);
  EXPECT_EQ(set->frames[0].width_px, 10);
  EXPECT_EQ(set->frames[1].width_px, 12);
  ASSERT_EQ(set->missing.size(), 1u);
  EXPECT_EQ(set->missing[0].camera_id, "c1");
  EXPECT_EQ(set->missing[0].reason, "torn");
}

TEST(ReadFrameSet, EndsWithTheLastFrame) {
  const absl::Status status = ReadFrameSet(HalfASource(), RigOfThree(), 2).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(status.message(), "frame 2 of 2");
}

}  // namespace
}  // namespace weft

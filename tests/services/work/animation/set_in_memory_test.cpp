#include "services/work/animation/set_in_memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "capture/image/image_size.h"
#include "tests/animation/drive_room.h"
#include "tests/capture/pattern_frames.h"

namespace weft {
namespace {

using testing::ElementsAre;

constexpr int kSetWidthPx = 64, kSetHeightPx = 48;

class SetInMemoryTest : public testing::Test {
 protected:
  SetInMemoryTest() {
    for (const char* id : {"left", "right"}) {
      CameraModel camera = CameraAt(id, 0, Eigen::Vector3d::Zero());
      camera.width_px = kSetWidthPx, camera.height_px = kSetHeightPx;
      rig_.cameras.push_back(camera);
    }
  }
  SetInMemory Of(RawFrameSet set) const { return SetInMemory(std::move(set), rig_); }

  Rig rig_;
  PatternFrames frames_{{"left", "right"}, kSetWidthPx, kSetHeightPx};
};

TEST_F(SetInMemoryTest, HasOneFrameOfTheRigsCameras) {
  const SetInMemory set = Of(frames_.Set(7));
  EXPECT_THAT(set.frame_names(), ElementsAre("0007"));
  EXPECT_TRUE(set.warnings().empty());
  const auto view = set.ReadView(0, 1);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_EQ(view->origin, "camera right, frame 0007");
  EXPECT_EQ(view->width_px, kSetWidthPx);
  const auto whole = set.Read(0);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(whole->frames.size(), 2u);
  EXPECT_EQ(set.ReadView(1, 0).status(), absl::OutOfRangeError("no such frame or camera"));
  EXPECT_EQ(set.ReadView(0, 2).status(), absl::OutOfRangeError("no such frame or camera"));
  EXPECT_EQ(set.Fingerprint(1).status(), absl::OutOfRangeError("no such frame"));
}

TEST_F(SetInMemoryTest, PicturesThatAreNotThereHaveTheirReason) {
  RawFrameSet raw = frames_.Set(7);
  raw.frames.erase(raw.frames.begin());
  EXPECT_EQ(Of(raw).ReadView(0, 0).status(), absl::NotFoundError("no stream in the take"));
  raw.missing.push_back({"right", "of another"});
  raw.missing.push_back({"left", "3 packets lost"});
  EXPECT_EQ(Of(raw).ReadView(0, 0).status(), absl::NotFoundError("3 packets lost"));
  EXPECT_TRUE(Of(raw).ReadView(0, 1).ok());
  rig_.cameras[1].height_px = 32;
  const auto wrong = Of(raw).ReadView(0, 1);
  const auto sizes = WrongSizeOf(wrong.status());
  ASSERT_TRUE(sizes) << wrong.status();
  EXPECT_EQ(sizes->found.height_px, kSetHeightPx);
  EXPECT_EQ(sizes->expected.height_px, 32);
  EXPECT_TRUE(wrong.status().message().find("camera right, frame 0007") != std::string::npos)
      << wrong.status();
}

TEST_F(SetInMemoryTest, ItsFingerprintIsOfNumberCamerasAndPictures) {
  const std::string whole = *Of(frames_.Set(7)).Fingerprint(0);
  EXPECT_EQ(*Of(frames_.Set(7)).Fingerprint(0), whole);
  RawFrameSet other = frames_.Set(7);
  other.number = 8;
  EXPECT_NE(*Of(other).Fingerprint(0), whole);
  other = frames_.Set(7);
  other.frames.pop_back();
  const std::string one = *Of(other).Fingerprint(0);
  EXPECT_NE(one, whole);
  // What a take stores counts where that is told.
  const auto stored = [&](std::vector<StoredPicture> pictures) {
    return *SetInMemory(frames_.Set(7), rig_, std::move(pictures)).Fingerprint(0);
  };
  EXPECT_EQ(stored({{1, 2}, {3, 4}}), stored({{1, 2}, {3, 4}}));
  EXPECT_NE(stored({{1, 2}, {3, 4}}), whole);
  for (const auto& pictures :
       {std::vector<StoredPicture>{{9, 2}, {3, 4}}, {{1, 9}, {3, 4}}, {{1, 2}, {9, 4}}, {{1, 2}, {3, 9}}})
    EXPECT_NE(stored(pictures), stored({{1, 2}, {3, 4}}));
  Rig others = rig_;
  others.cameras[0].id = "middle";
  EXPECT_NE(*SetInMemory(frames_.Set(7), others, {{{1, 2}, {3, 4}}}).Fingerprint(0),
            stored({{1, 2}, {3, 4}}));
}

TEST_F(SetInMemoryTest, NamesCamerasThatTheRigLacks) {
  EXPECT_TRUE(Of(frames_.Set(7)).unknown_cameras().empty());
  PatternFrames more({"top", "left", "bottom"}, kSetWidthPx, kSetHeightPx);
  RawFrameSet raw = more.Set(7);
  raw.missing.push_back({"above", "lost"});
  raw.missing.push_back({"right", "lost"});
  EXPECT_THAT(Of(raw).unknown_cameras(), ElementsAre("above", "bottom", "top"));
}

}  // namespace
}  // namespace weft

// Takes of a waving tube without pictures, and an avatar that learnt it: made once for all tests of a
// program.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "alignment/template.h"
#include "services/work/animation/train_avatar.h"
#include "tests/animation/waving_tube.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/moving_take.h"

namespace weft {

class WavingTakes {
 public:
  static constexpr int kFrames = 30;

  static WavingTakes& Get() {
    static WavingTakes takes;
    return takes;
  }
  // The tube by the motion of this seed.
  std::string Write(const std::string& path, int frames, int seed) const {
    return WriteMovingTake(path, garment, frames, [seed](int k) { return WavingTube::At(k, seed); });
  }
  // What learns the avatar below.
  AvatarRequest Request(const std::string& out) const {
    AvatarRequest request;
    request.sources = {walk, turn};
    request.held_out = {held};
    request.training = {.components = 6, .calibration_frames = 6};
    request.out = out;
    return request;
  }
  const std::string& Avatar() {
    if (avatar_.empty()) {
      avatar_ = folder_ / "tube.avatar";
      const auto trained = TrainAvatar(Request(avatar_), {}, {});
      EXPECT_TRUE(trained.ok()) << trained.status();
    }
    return avatar_;
  }

 private:
  TempFolder folder_;

 public:
  const Template garment = WavingTube::Garment();
  const std::string walk = Write(folder_ / "walk", kFrames, 0), turn = Write(folder_ / "turn", kFrames, 1),
                    held = Write(folder_ / "held", kFrames, 3);

 private:
  std::string avatar_;
};

}  // namespace weft

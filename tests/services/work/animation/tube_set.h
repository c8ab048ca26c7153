// A data set of takes of the waving tube: what is learnt from, validated and tested, and a repeated take.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "services/formats/figure/body_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/animation/cloth_take.h"
#include "tests/services/work/animation/waving_takes.h"
#include "weft/v1/dataset.pb.h"

namespace weft {

// In this order; the last take is not complete. The wearer is taller than usual by a quarter.
inline std::string WriteTubeSet(const std::string& path) {
  v1::Dataset set;
  BodyShape body;
  body.stature = 1.25;
  BodyToProto({"", body}, *set.mutable_body());
  struct Take {
    const char *split, *motion;
    int seed, frames;
  };
  for (const Take& take :
       {Take{"train", "walk", 1, 30}, Take{"validate", "walk", 3, 12}, Take{"train", "twist", 2, 30},
        Take{"test-known", "walk", 4, 30}, Take{"test-unseen", "reach", 5, 4}, Take{"chaos", "walk", 4, 30},
        Take{"train", "twist", 9, 0}}) {
    v1::DatasetTake& to = *set.add_takes();
    to.set_name(std::string(take.split) + "-" + take.motion + "-" + std::to_string(take.seed));
    to.set_split(take.split), to.set_motion(take.motion);
    to.set_motion_seed(static_cast<uint64_t>(take.seed));
    to.set_frames(take.frames);
    if (take.frames == 0) continue;
    to.set_frames_hash("0123456789abcdef");
    // What is repeated ends a little elsewhere.
    WavingTakes::Get().Write(path + "/takes/" + to.name(), take.frames,
                             to.split() == "chaos" ? 14 : take.seed);
  }
  EXPECT_TRUE(WriteJsonFile(path + "/dataset.json", set).ok());
  return path;
}

}  // namespace weft

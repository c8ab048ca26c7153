// A net that answers the same everywhere: 3 mm along x of the cloth at rest, -1 mm along z.
#pragma once

#include <fstream>
#include <iterator>
#include <vector>

#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/driving_features.h"

namespace weft {

inline constexpr float kShiftAnswer[kDrivingAnswers] = {1.5f, 0, -0.5f, -1};

inline AvatarNet ShiftNet() {
  AvatarNet out;
  std::ifstream file(WEFT_TEST_DATA "/shift.onnx", std::ios::binary);
  out.onnx.assign(std::istreambuf_iterator<char>(file), {});
  out.sample = {kDrivingFeatures, 8, 8, std::vector<float>(kDrivingFeatures * 64, 0.5f)};
  out.sample_answer = {kDrivingAnswers, 8, 8, {}};
  for (const float a : kShiftAnswer) out.sample_answer.values.insert(out.sample_answer.values.end(), 64, a);
  return out;
}

}  // namespace weft

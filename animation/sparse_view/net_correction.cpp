#include "animation/sparse_view/net_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kSampleTolerance = 1e-4;  // of the largest answer
// As the trainer bounds the last answer.
constexpr float kMostLog = 3;

absl::Status CheckSample(const AvatarNet& about, int answers, Net& net) {
  WEFT_ASSIGN_OR_RETURN(const Tensor answer, net.Run(about.sample));
  const Tensor& expected = about.sample_answer;
  if (answer.channels != answers || answer.values.size() != expected.values.size())
    return absl::InvalidArgumentError(
        absl::StrCat("the avatar's net answers with ", answer.channels, " channels, expected ", answers));
  double largest = 1e-3, off = 0;
  for (size_t i = 0; i < expected.values.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(expected.values[i])));
    off = std::max(off, std::abs(static_cast<double>(answer.values[i]) - expected.values[i]));
  }
  if (off <= kSampleTolerance * largest) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "the avatar's net does not answer as it did when it was trained (off by ", off / largest,
      " of its largest answer); its files are of two avatars, or this machine's OpenCV computes wrongly"));
}

}  // namespace

absl::StatusOr<Net> LoadNet(const AvatarNet& net, int answers) {
  WEFT_ASSIGN_OR_RETURN(Net out, Net::FromOnnx(net.onnx, "the avatar's net"));
  WEFT_RETURN_IF_ERROR(CheckSample(net, answers, out));
  return out;
}

absl::Status CheckNet(const AvatarNet& net, int answers) { return LoadNet(net, answers).status(); }

absl::StatusOr<AtlasImage> AskNet(Net& net, AtlasImage image, int answers) {
  const int height = image.height, width = image.width;
  WEFT_ASSIGN_OR_RETURN(Tensor answer, net.Run({image.channels, height, width, std::move(image.values)}));
  if (answer.channels != answers || answer.height != height || answer.width != width)
    return absl::InvalidArgumentError("the avatar's net answers with an image of another size");
  return AtlasImage{answers, height, width, std::move(answer.values)};
}

absl::StatusOr<NetCorrection> NetCorrection::Create(const Template& garment, const AlignmentModel& model,
                                                    const SparseViewAvatar& avatar) {
  WEFT_ASSIGN_OR_RETURN(Atlas atlas, Atlas::Build(garment, ChartsOnBoard(garment), avatar.net.atlas));
  WEFT_ASSIGN_OR_RETURN(Net net, LoadNet(avatar.net, kDrivingAnswers));
  return NetCorrection(model, avatar, std::move(atlas), std::move(net));
}

absl::StatusOr<CorrectedMesh> NetCorrection::Correct(const RayDrivenFrame& frame,
                                                     const std::vector<VertexRay>& rays) {
  const std::vector<Eigen::Matrix3f> axes = features_.axes().RotationsOf(frame.position_mm);
  WEFT_ASSIGN_OR_RETURN(
      const AtlasImage answer,
      AskNet(net_, atlas_.Gather(features_.Of(frame, rays, axes), kDrivingFeatures), kDrivingAnswers));
  const std::vector<float> values = atlas_.Scatter(answer);
  CorrectedMesh out;
  for (size_t v = 0; v < axes.size(); ++v) {
    const float* of = &values[v * kDrivingAnswers];
    const Eigen::Vector3f offset = kAnswerUnitMm * (axes[v] * Eigen::Vector3f(of[0], of[1], of[2]));
    out.position_mm.push_back(frame.position_mm[v] + offset.cast<double>());
    out.deviation_mm.push_back(static_cast<float>(kAnswerUnitMm) *
                               std::exp(kMostLog * std::tanh(of[3] / kMostLog)));
  }
  return out;
}

}  // namespace weft

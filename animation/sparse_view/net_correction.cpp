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

bool IsImage(const std::vector<NamedShape>& shapes, const char* name, int channels) {
  // Sides are checked by each run.
  return shapes.size() == 1 && shapes.front().name == name && shapes.front().shape.channels == channels;
}

absl::Status CheckNames(const Net& net, const AvatarNetChannels& channels) {
  if (IsImage(net.inputs(), kNetInput, channels.features) &&
      IsImage(net.outputs(), kNetOutput, channels.answers))
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "the avatar's net makes ", Describe(net.outputs()), " of ", Describe(net.inputs()), ", expected ",
      Describe({{kNetOutput, {channels.answers}}}), " of ", Describe({{kNetInput, {channels.features}}})));
}

absl::Status CheckSample(const AvatarNet& about, Net& net) {
  WEFT_ASSIGN_OR_RETURN(const NamedTensors answers, net.Run({{kNetInput, about.sample}}));
  const Tensor &answer = answers.at(kNetOutput), &expected = about.sample_answer;
  if (answer.shape() != expected.shape())
    return absl::InvalidArgumentError(absl::StrCat("the avatar's net answers its sample with ",
                                                   Describe(answer.shape()), " numbers, expected ",
                                                   Describe(expected.shape())));
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

absl::StatusOr<Net> LoadNet(const AvatarNet& net, const AvatarNetChannels& channels) {
  WEFT_ASSIGN_OR_RETURN(Net out, Net::FromOnnx(net.onnx, "the avatar's net"));
  WEFT_RETURN_IF_ERROR(CheckNames(out, channels));
  WEFT_RETURN_IF_ERROR(CheckSample(net, out));
  return out;
}

absl::Status CheckNet(const AvatarNet& net, const AvatarNetChannels& channels) {
  return LoadNet(net, channels).status();
}

absl::StatusOr<AtlasImage> AskNet(Net& net, AtlasImage image) {
  NamedTensors inputs;
  inputs[kNetInput] = {image.channels, image.height, image.width, std::move(image.values)};
  WEFT_ASSIGN_OR_RETURN(NamedTensors outputs, net.Run(inputs));
  Tensor& answer = outputs.at(kNetOutput);
  if (answer.height != image.height || answer.width != image.width)
    return absl::InvalidArgumentError("the avatar's net answers with an image of another size");
  return AtlasImage{answer.channels, answer.height, answer.width, std::move(answer.values)};
}

absl::StatusOr<NetCorrection> NetCorrection::Create(const Template& garment, const AlignmentModel& model,
                                                    const SparseViewAvatar& avatar) {
  WEFT_ASSIGN_OR_RETURN(Atlas atlas, Atlas::Build(garment, ChartsOnBoard(garment), avatar.net.atlas));
  WEFT_ASSIGN_OR_RETURN(Net net, LoadNet(avatar.net, {}));
  return NetCorrection(model, avatar, std::move(atlas), std::move(net));
}

absl::StatusOr<CorrectedMesh> NetCorrection::Correct(const RayDrivenFrame& frame,
                                                     const std::vector<VertexRay>& rays) {
  const std::vector<Eigen::Matrix3f> axes = features_.axes().RotationsOf(frame.position_mm);
  WEFT_ASSIGN_OR_RETURN(const AtlasImage answer,
                        AskNet(net_, atlas_.Gather(features_.Of(frame, rays, axes), kDrivingFeatures)));
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

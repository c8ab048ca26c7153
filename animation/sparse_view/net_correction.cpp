#include "animation/sparse_view/net_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr double kSampleTolerance = 1e-4;  // of the largest answer
// As the trainer bounds the last answer.
constexpr float kMostLog = 3;

absl::Status CheckSample(const AvatarNet& about, int answers, Net& net) {
  const absl::StatusOr<Tensor> answer = net.Run(about.sample);
  if (!answer.ok()) return answer.status();
  const Tensor& expected = about.sample_answer;
  if (answer->channels != answers || answer->values.size() != expected.values.size())
    return absl::InvalidArgumentError(
        absl::StrCat("the avatar's net answers with ", answer->channels, " channels, expected ", answers));
  double largest = 1e-3, off = 0;
  for (size_t i = 0; i < expected.values.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(expected.values[i])));
    off = std::max(off, std::abs(static_cast<double>(answer->values[i]) - expected.values[i]));
  }
  if (off <= kSampleTolerance * largest) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "the avatar's net does not answer as it did when it was trained (off by ", off / largest,
      " of its largest answer); its files are of two avatars, or this machine's OpenCV computes wrongly"));
}

}  // namespace

absl::StatusOr<Net> LoadNet(const AvatarNet& net, int answers) {
  absl::StatusOr<Net> out = Net::FromOnnx(net.onnx, "the avatar's net");
  if (!out.ok()) return out.status();
  if (absl::Status status = CheckSample(net, answers, *out); !status.ok()) return status;
  return out;
}

absl::Status CheckNet(const AvatarNet& net, int answers) { return LoadNet(net, answers).status(); }

absl::StatusOr<AtlasImage> AskNet(Net& net, AtlasImage image, int answers) {
  const int height = image.height, width = image.width;
  absl::StatusOr<Tensor> answer = net.Run({image.channels, height, width, std::move(image.values)});
  if (!answer.ok()) return answer.status();
  if (answer->channels != answers || answer->height != height || answer->width != width)
    return absl::InvalidArgumentError("the avatar's net answers with an image of another size");
  return AtlasImage{answers, height, width, std::move(answer->values)};
}

absl::StatusOr<NetCorrection> NetCorrection::Create(const Template& garment, const AlignmentModel& model,
                                                    const SparseViewAvatar& avatar) {
  absl::StatusOr<Atlas> atlas = Atlas::Build(garment, avatar.net.atlas);
  if (!atlas.ok()) return atlas.status();
  absl::StatusOr<Net> net = LoadNet(avatar.net, kDrivingAnswers);
  if (!net.ok()) return net.status();
  return NetCorrection(model, avatar, *std::move(atlas), *std::move(net));
}

absl::StatusOr<CorrectedMesh> NetCorrection::Correct(const RayDrivenFrame& frame,
                                                     const std::vector<VertexRay>& rays) {
  const std::vector<Eigen::Matrix3f> axes = features_.axes().RotationsOf(frame.position_mm);
  const absl::StatusOr<AtlasImage> answer =
      AskNet(net_, atlas_.Gather(features_.Of(frame, rays, axes), kDrivingFeatures), kDrivingAnswers);
  if (!answer.ok()) return answer.status();
  const std::vector<float> values = atlas_.Scatter(*answer);
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

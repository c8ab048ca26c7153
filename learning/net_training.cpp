#include "learning/net_training.h"

#include <torch/torch.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "learning/offset_net.h"

namespace weft::learning {
namespace {

constexpr double kAnswerUnitMm = 2;  // of animation/sparse_view/driving_features.h
constexpr int kOffsets = 3;
// Of animation/paper/pixel_driver.h, and the weights of its paper's code, over what keeps the loss near 1.
constexpr double kTangentUnitMm = 10, kVertexWeight = 0.5, kNormalWeight = 50, kLossUnit = 10;
constexpr Descent kNetDescent{.warm_up_steps = 300, .weight_decay = 1e-3, .largest_gradient = 1};
// Frames that are further off in the mean were not tracked; a net that learnt from them would doubt all
// others.
constexpr double kWorstMm = 15;
constexpr double kLeastOff = 0.1;
// What lies beyond is no measurement.
constexpr double kMostFeature = 5, kMostOffset = 10, kMostLog = 3;
// Held-out samples that are looked at each time, of each kind.
constexpr int kLooks = 40;

class Batches {
 public:
  explicit Batches(const SampleFile& file) : file_(file), texels_(torch::tensor(file.texels())) {
    panel_ = torch::from_blob(const_cast<float*>(file.is_panel().data()),
                              {static_cast<int64_t>(file.texels().size())})
                 .clone();
    panel_count_ = panel_.sum().item<double>();
    if (panel_count_ < 1) throw std::runtime_error("the samples show no panel");
  }

  // [batch][features][height][width].
  torch::Tensor Features(const std::vector<int>& samples) const {
    torch::Tensor out = torch::zeros(
        {static_cast<int64_t>(samples.size()), file_.features(), int64_t{file_.height()} * file_.width()});
    for (size_t k = 0; k < samples.size(); ++k)
      out[static_cast<int64_t>(k)].index_copy_(1, texels_,
                                               Halves(file_.FeaturesOf(samples[k]), file_.features()));
    return out.clamp_(-kMostFeature, kMostFeature)
        .view({-1, file_.features(), file_.height(), file_.width()});
  }
  // [batch][answers][texels].
  torch::Tensor Answers(const std::vector<int>& samples) const {
    std::vector<torch::Tensor> out;
    for (const int s : samples) out.push_back(Halves(file_.AnswersOf(s), file_.answers()));
    return torch::stack(out);
  }
  // Of images, the texels that samples list.
  torch::Tensor Listed(const torch::Tensor& image) const { return image.flatten(2).index_select(2, texels_); }
  // Answers in their places, [batch][answers][height][width].
  torch::Tensor AsImage(const torch::Tensor& listed) const {
    torch::Tensor out =
        torch::zeros({listed.size(0), listed.size(1), int64_t{file_.height()} * file_.width()});
    return out.index_copy_(2, texels_, listed)
        .view({listed.size(0), listed.size(1), file_.height(), file_.width()});
  }
  // Whether a texel and its four neighbours are of panels, [height - 2][width - 2].
  torch::Tensor Inside() const {
    const torch::Tensor whole = AsImage(panel_.view({1, 1, -1}))[0][0];
    const int64_t height = file_.height(), width = file_.width();
    const auto part = [&](int64_t row, int64_t column) {
      return whole.slice(0, row, row + height - 2).slice(1, column, column + width - 2);
    };
    return part(1, 1) * part(0, 1) * part(2, 1) * part(1, 0) * part(1, 2);
  }
  torch::Tensor MeanOverPanels(const torch::Tensor& per_texel) const {
    return (per_texel * panel_).sum() / (panel_count_ * static_cast<double>(per_texel.size(0)));
  }
  // Mean length of offsets, [batch][answers][texels].
  double MeanMm(const torch::Tensor& offsets) const {
    return kAnswerUnitMm * MeanOverPanels(offsets.norm(2, 1)).item<double>();
  }

 private:
  torch::Tensor Halves(const void* at, int channels) const {
    return torch::from_blob(const_cast<void*>(at), {channels, static_cast<int64_t>(file_.texels().size())},
                            torch::kHalf)
        .to(torch::kFloat);
  }
  const SampleFile& file_;
  torch::Tensor texels_, panel_;
  double panel_count_ = 0;
};

// Squared distances of the vertices and of the normals. `answer`: the net's whole image; `told`: all features
// of the samples.
torch::Tensor LossOfSquares(const Batches& batches, const torch::Tensor& answer, const torch::Tensor& told,
                            const torch::Tensor& truth) {
  const torch::Tensor whole_truth = batches.AsImage(truth);
  const torch::Tensor tangents = kTangentUnitMm * told.slice(1, told.size(1) - kTangents);
  const auto normals = [&](const torch::Tensor& offsets_mm) {
    using torch::indexing::None;
    using torch::indexing::Slice;
    const torch::Tensor along = 0.5 * (offsets_mm.index({Slice(), Slice(), Slice(1, -1), Slice(2, None)}) -
                                       offsets_mm.index({Slice(), Slice(), Slice(1, -1), Slice(None, -2)}));
    const torch::Tensor down = 0.5 * (offsets_mm.index({Slice(), Slice(), Slice(2, None), Slice(1, -1)}) -
                                      offsets_mm.index({Slice(), Slice(), Slice(None, -2), Slice(1, -1)}));
    const torch::Tensor inner = tangents.index({Slice(), Slice(), Slice(1, -1), Slice(1, -1)});
    const torch::Tensor cross = torch::cross(inner.slice(1, 0, 3) + along, inner.slice(1, 3, 6) + down, 1);
    return cross / (cross.norm(2, 1, true) + 1e-3);
  };
  const torch::Tensor bent =
      (normals(kAnswerUnitMm * answer) - normals(kAnswerUnitMm * whole_truth)).square().sum(1);
  const torch::Tensor inside = batches.Inside();
  const torch::Tensor of_normals = (bent * inside).sum() / (inside.sum().clamp_min(1) * bent.size(0));
  const torch::Tensor of_vertices = batches.MeanOverPanels(
      (kAnswerUnitMm * (batches.Listed(answer) - truth.clamp(-kMostOffset, kMostOffset))).square().sum(1));
  return (kVertexWeight * of_vertices + kNormalWeight * of_normals) / kLossUnit;
}

// Huber's loss of the offsets, and Laplace's likelihood of what they leave, whose deviation is the same
// for all axes; its log is the last answer, bounded smoothly. The likelihood does not move the offsets: where
// they are right already they would count for all.
torch::Tensor LossOfDeviation(const Batches& batches, const torch::Tensor& listed,
                              const torch::Tensor& truth) {
  const torch::Tensor off = listed.slice(1, 0, kOffsets) - truth.clamp(-kMostOffset, kMostOffset);
  const torch::Tensor size = off.abs();
  const torch::Tensor huber = torch::where(size < 1, 0.5 * size * size, size - 0.5).sum(1);
  const torch::Tensor log_deviation = kMostLog * torch::tanh(listed.select(1, kOffsets) / kMostLog);
  const torch::Tensor left = size.sum(1).detach() + kLeastOff;
  return batches.MeanOverPanels(huber + left * torch::exp(-log_deviation) + kOffsets * log_deviation);
}

std::vector<HeldOutScore> ScoreHeldOut(OffsetNet& net, const SampleFile& file, const Batches& batches) {
  const torch::NoGradGuard no_grad;
  net->eval();
  std::map<int, std::vector<int>> by_cameras;
  for (int s = 0; s < file.size(); ++s)
    if (file.split(s) == Split::kValidate) by_cameras[file.cameras(s)].push_back(s);
  std::vector<HeldOutScore> out;
  for (const auto& [cameras, samples] : by_cameras) {
    const int looks = std::min(kLooks, static_cast<int>(samples.size()));
    HeldOutScore score{cameras, looks};
    for (int k = 0; k < looks; ++k) {
      const std::vector<int> sample = {
          samples[static_cast<size_t>(k) * samples.size() / static_cast<size_t>(looks)]};
      const torch::Tensor answer =
          batches.Listed(net->forward(batches.Features(sample).slice(1, 0, net->shape().features)))
              .slice(1, 0, kOffsets);
      const torch::Tensor truth = batches.Answers(sample);
      score.before_mm += batches.MeanMm(truth) / looks;
      score.after_mm += batches.MeanMm(truth - answer) / looks;
    }
    out.push_back(score);
  }
  net->train();
  return out;
}

std::string SampleOf(OffsetNet& net, uint64_t seed) {
  const torch::NoGradGuard no_grad;
  torch::manual_seed(seed);
  net->eval();
  const int64_t side = int64_t{2} << net->shape().widths.size();
  const torch::Tensor image = torch::randn({1, net->shape().features, side, side});
  std::string out = "weftnet1";
  for (const torch::Tensor& tensor : {image, net->forward(image).contiguous()}) {
    for (int d = 1; d < 4; ++d) {
      const auto size = static_cast<uint32_t>(tensor.size(d));
      out.append(reinterpret_cast<const char*>(&size), sizeof(size));
    }
    out.append(reinterpret_cast<const char*>(tensor.data_ptr<float>()),
               sizeof(float) * static_cast<size_t>(tensor.numel()));
  }
  return out;
}

OffsetNet NewNet(const SampleFile& file, const NetTraining& training) {
  const bool has_deviation = training.loss == NetLoss::kOffsetsAndDeviation;
  return OffsetNet(NetShape{file.features() - (has_deviation ? 0 : kTangents),
                            file.answers() + (has_deviation ? 1 : 0), has_deviation, training.widths});
}

std::vector<int> LearntSamples(const SampleFile& file, const Batches& batches) {
  std::vector<int> out;
  for (int s = 0; s < file.size(); ++s)
    if (file.split(s) == Split::kTrain && batches.MeanMm(batches.Answers({s})) < kWorstMm) out.push_back(s);
  if (out.empty()) throw std::runtime_error("the file has no samples to learn from");
  return out;
}

// Of samples that were learnt from, the ones of a step: the same however often the training was stopped.
std::vector<int> SamplesOfStep(const std::vector<int>& learnt, const TrainingOptions& training,
                               int64_t step) {
  std::vector<int> out;
  for (int k = 0; k < training.batch; ++k) {
    // SplitMix64 (Steele et al. 2014).
    uint64_t x = training.seed * 0x9e3779b97f4a7c15u + static_cast<uint64_t>(step) * 0x10001u +
                 static_cast<uint64_t>(k);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    out.push_back(learnt[(x ^ (x >> 31)) % learnt.size()]);
  }
  return out;
}

class NetLearner : public Learner {
 public:
  NetLearner(const SampleFile& file, const NetTraining& training)
      : file_(file),
        training_(training),
        batches_(file),
        learnt_(LearntSamples(file, batches_)),
        net_(NewNet(file, training)) {}

  torch::nn::Module& model() override { return *net_; }
  Descent descent() const override { return kNetDescent; }

  torch::Tensor Loss(int64_t step) override {
    const std::vector<int> samples = SamplesOfStep(learnt_, training_.options, step);
    const torch::Tensor features = batches_.Features(samples), truth = batches_.Answers(samples);
    const torch::Tensor answer = net_->forward(features.slice(1, 0, net_->shape().features));
    return training_.loss == NetLoss::kOffsetsAndDeviation
               ? LossOfDeviation(batches_, batches_.Listed(answer), truth)
               : LossOfSquares(batches_, answer, features, truth);
  }

  std::vector<HeldOutScore> Score() override { return ScoreHeldOut(net_, file_, batches_); }

  std::map<std::string, std::string> Export() override {
    net_->eval();
    std::string onnx = NetToOnnx(net_);
    return {{kNetFile, std::move(onnx)}, {kNetSampleFile, SampleOf(net_, training_.options.seed)}};
  }

 private:
  const SampleFile& file_;
  const NetTraining training_;
  const Batches batches_;
  const std::vector<int> learnt_;
  OffsetNet net_;
};

}  // namespace

std::unique_ptr<Learner> MakeNetLearner(const SampleFile& file, const NetTraining& training) {
  if (file.answers() != kOffsets) throw std::runtime_error("the samples' answers are no offsets");
  if (training.loss == NetLoss::kVerticesAndNormals && file.features() <= kTangents)
    throw std::runtime_error("the samples have no tangents");
  return std::make_unique<NetLearner>(file, training);
}

}  // namespace weft::learning

#include "learning/prior_training.h"

#include <torch/torch.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "learning/table_file.h"

namespace weft::learning {
namespace {

constexpr double kPriorLeak = 0.2;  // of animation/paper/graph_prior.h
constexpr Descent kPriorDescent{.warm_up_steps = 0, .weight_decay = 0, .largest_gradient = 10};
constexpr int64_t kPoseNumbers = 6;

torch::Tensor TensorOf(const std::map<std::string, NumberTable>& tables, const std::string& name,
                       int64_t columns = -1) {
  const auto found = tables.find(name);
  if (found == tables.end()) throw std::runtime_error("the table \"" + name + "\" is missing");
  const NumberTable& table = found->second;
  if (columns >= 0 && static_cast<int64_t>(table.columns) != columns)
    throw std::runtime_error("the table \"" + name + "\" does not fit the others");
  return torch::from_blob(const_cast<float*>(table.values.data()),
                          {static_cast<int64_t>(table.rows), static_cast<int64_t>(table.columns)})
      .clone();
}

// The graph as PlaceNodes and SkinnedMesh of animation/paper/deformation_graph.h have it, for batches of
// poses.
class PosedGraph {
 public:
  explicit PosedGraph(const std::map<std::string, NumberTable>& tables)
      : unit_(TensorOf(tables, "unit")), node_(TensorOf(tables, "node_mm", 3)) {
    const int64_t nodes = node_.size(0);
    const torch::Tensor parent = TensorOf(tables, "parent", nodes).to(torch::kLong).view({-1}),
                        rest = TensorOf(tables, "rest_mm", 3), skin_node = TensorOf(tables, "skin_node"),
                        skin_weight = TensorOf(tables, "skin_weight", skin_node.size(1));
    if (unit_.size(1) != kPoseNumbers * (nodes - 1) || skin_node.size(0) != rest.size(0) ||
        skin_weight.size(0) != rest.size(0))
      throw std::runtime_error("tables of the graph do not fit each other");
    if (skin_node.min().item<float>() < 0 || skin_node.max().item<float>() >= static_cast<float>(nodes))
      throw std::runtime_error("the table \"skin_node\" names a node that is not there");
    weight_ = torch::zeros({rest.size(0), nodes});
    weight_.scatter_add_(1, skin_node.to(torch::kLong), skin_weight);
    corner_ = torch::cat({rest, torch::ones({rest.size(0), 1})}, 1);
    // Nodes by their depth: those of a level are placed together.
    std::vector<int64_t> depth(static_cast<size_t>(nodes), 0);
    for (int64_t i = 1; i < nodes; ++i) {
      const int64_t of = parent[i].item<int64_t>();
      if (of < 0 || of >= i) throw std::runtime_error("the table \"parent\" is no tree");
      const auto level =
          static_cast<size_t>(depth[static_cast<size_t>(i)] = depth[static_cast<size_t>(of)] + 1);
      if (levels_.size() < level) levels_.resize(level), parents_.resize(level);
      levels_[level - 1].push_back(i);
      parents_[level - 1].push_back(of);
    }
    std::vector<int64_t> place(static_cast<size_t>(nodes), 0);
    int64_t next = 1;
    for (size_t level = 0; level < levels_.size(); ++level) {
      for (int64_t& of : parents_[level]) of = place[static_cast<size_t>(of)];
      for (const int64_t i : levels_[level]) place[static_cast<size_t>(i)] = next++;
    }
    place_ = torch::tensor(place);
  }

  int64_t numbers() const { return unit_.size(1); }
  int64_t vertices() const { return corner_.size(0); }

  // [batch][numbers] to [batch][chosen vertices][3].
  torch::Tensor Meshes(const torch::Tensor& pose, const torch::Tensor& chosen) const {
    const int64_t batch = pose.size(0), nodes = node_.size(0);
    const torch::Tensor parts = (pose * unit_).view({batch, nodes - 1, kPoseNumbers});
    const torch::Tensor turn = Rotations(parts.slice(2, 0, 3)), here = node_.slice(0, 1).unsqueeze(2);
    const torch::Tensor shift = here + parts.slice(2, 3).unsqueeze(3) - torch::matmul(turn, here);
    torch::Tensor turns = torch::eye(3).expand({batch, 1, 3, 3}), shifts = torch::zeros({batch, 1, 3, 1});
    for (size_t level = 0; level < levels_.size(); ++level) {
      const torch::Tensor own = torch::tensor(levels_[level]) - 1, of = torch::tensor(parents_[level]);
      const torch::Tensor outer = turns.index_select(1, of);
      turns = torch::cat({turns, torch::matmul(outer, turn.index_select(1, own))}, 1);
      shifts = torch::cat(
          {shifts, torch::matmul(outer, shift.index_select(1, own)) + shifts.index_select(1, of)}, 1);
    }
    const torch::Tensor motions =
        torch::cat({turns, shifts}, 3).index_select(1, place_);  // [batch][nodes][3][4]
    const torch::Tensor weight = weight_.index_select(0, chosen), corner = corner_.index_select(0, chosen);
    const torch::Tensor blended =
        torch::mm(weight, motions.permute({1, 0, 2, 3}).reshape({nodes, batch * 12})).view({-1, batch, 3, 4});
    return (blended * corner.view({-1, 1, 1, 4})).sum(3).permute({1, 0, 2});
  }

 private:
  // Of rotation vectors (Rodrigues), [..][3] to [..][3][3].
  static torch::Tensor Rotations(const torch::Tensor& vector) {
    const torch::Tensor square = vector.square().sum(2, true).unsqueeze(3) + 1e-12, angle = square.sqrt();
    const torch::Tensor zero = torch::zeros_like(vector.select(2, 0));
    const torch::Tensor x = vector.select(2, 0), y = vector.select(2, 1), z = vector.select(2, 2);
    const torch::Tensor cross =
        torch::stack({zero, -z, y, z, zero, -x, -y, x, zero}, 2).view({vector.size(0), vector.size(1), 3, 3});
    return torch::eye(3) + torch::sin(angle) / angle * cross +
           (1 - torch::cos(angle)) / square * torch::matmul(cross, cross);
  }

  torch::Tensor unit_, node_, weight_, corner_, place_;
  std::vector<std::vector<int64_t>> levels_, parents_;
};

// Fully connected layers with leaky ReLUs between them.
class LayersImpl : public torch::nn::Module {
 public:
  explicit LayersImpl(const std::vector<int64_t>& widths) {
    for (size_t k = 0; k + 1 < widths.size(); ++k)
      layers_.push_back(
          register_module("layer" + std::to_string(k), torch::nn::Linear(widths[k], widths[k + 1])));
  }
  torch::Tensor forward(torch::Tensor x) {
    for (size_t k = 0; k < layers_.size(); ++k) {
      x = layers_[k]->forward(x);
      if (k + 1 < layers_.size()) x = torch::leaky_relu(x, kPriorLeak);
    }
    return x;
  }
  std::vector<torch::nn::Linear>& layers() { return layers_; }

 private:
  std::vector<torch::nn::Linear> layers_;
};
TORCH_MODULE(Layers);

std::vector<int64_t> Joined(int64_t from, std::vector<int64_t> widths, int64_t to) {
  widths.insert(widths.begin(), from);
  widths.push_back(to);
  return widths;
}

std::string TablesOfDecoder(Layers& decoder) {
  std::map<std::string, NumberTable> out;
  const auto add = [&](const std::string& name, const torch::Tensor& values, int64_t rows) {
    const torch::Tensor plain = values.detach().contiguous();
    out[name] = {static_cast<size_t>(rows),
                 static_cast<size_t>(plain.numel() / rows),
                 {plain.data_ptr<float>(), plain.data_ptr<float>() + plain.numel()}};
  };
  for (size_t k = 0; k < decoder->layers().size(); ++k) {
    add("weight" + std::to_string(k), decoder->layers()[k]->weight, decoder->layers()[k]->weight.size(0));
    add("bias" + std::to_string(k), decoder->layers()[k]->bias, 1);
  }
  return EncodeTables(out);
}

// Encoder and decoder as one model, so that a checkpoint has both.
class AutoencoderImpl : public torch::nn::Module {
 public:
  AutoencoderImpl(int64_t numbers, const PriorTraining& training, const torch::Tensor& mean)
      : encoder(register_module("encoder",
                                Layers(Joined(numbers, {training.widths.rbegin(), training.widths.rend()},
                                              2 * training.latents)))),
        decoder(register_module("decoder", Layers(Joined(training.latents, training.widths, numbers)))) {
    const torch::NoGradGuard no_grad;  // an untrained decoder makes the mean pose
    decoder->layers().back()->weight.mul_(0.1);
    decoder->layers().back()->bias.copy_(mean.view({-1}));
  }

  Layers encoder, decoder;
};
TORCH_MODULE(Autoencoder);

class PriorLearner : public Learner {
 public:
  PriorLearner(const std::map<std::string, NumberTable>& tables, const PriorTraining& training)
      : training_(training),
        graph_(tables),
        poses_(TensorOf(tables, "pose", graph_.numbers())),
        mean_(poses_.mean(0, true)),
        all_(torch::arange(graph_.vertices())),
        net_(graph_.numbers(), training, mean_) {
    if (tables.contains("held_out_pose") && tables.at("held_out_pose").rows > 0)
      held_out_ = TensorOf(tables, "held_out_pose", graph_.numbers());
  }

  torch::nn::Module& model() override { return *net_; }
  Descent descent() const override { return kPriorDescent; }

  torch::Tensor Loss(int64_t /*step*/) override {
    const torch::Tensor batch =
        poses_.index_select(0, torch::randint(poses_.size(0), {training_.options.batch}, torch::kLong));
    const torch::Tensor chosen = torch::randperm(graph_.vertices(), torch::kLong)
                                     .slice(0, 0, std::min(training_.vertices, graph_.vertices()));
    const torch::Tensor code = net_->encoder->forward(batch - mean_);
    const torch::Tensor middle = code.slice(1, 0, training_.latents),
                        log_variance = code.slice(1, training_.latents).clamp(-12, 4);
    const torch::Tensor z = middle + torch::exp(0.5 * log_variance) * torch::randn_like(middle);
    torch::Tensor truth;
    {
      const torch::NoGradGuard no_grad;
      truth = graph_.Meshes(batch, chosen);
    }
    const torch::Tensor off =
        (graph_.Meshes(net_->decoder->forward(z), chosen) - truth).square().sum(2).mean();
    const torch::Tensor divergence =
        0.5 * (middle.square() + log_variance.exp() - 1 - log_variance).sum(1).mean();
    return off + training_.divergence * divergence;
  }

  std::vector<HeldOutScore> Score() override {
    if (!held_out_.defined()) return {};
    const torch::NoGradGuard no_grad;
    const torch::Tensor truth = graph_.Meshes(held_out_, all_);
    const torch::Tensor z = net_->encoder->forward(held_out_ - mean_).slice(1, 0, training_.latents);
    const auto off = [&](const torch::Tensor& code) {
      return (graph_.Meshes(net_->decoder->forward(code), all_) - truth).norm(2, 2).mean().item<double>();
    };
    return {{0, static_cast<int>(held_out_.size(0)), off(torch::zeros({1, training_.latents})), off(z)}};
  }

  std::map<std::string, std::string> Export() override {
    return {{kPriorFile, TablesOfDecoder(net_->decoder)}};
  }

 private:
  const PriorTraining training_;
  const PosedGraph graph_;
  const torch::Tensor poses_, mean_, all_;
  Autoencoder net_;
  torch::Tensor held_out_;
};

}  // namespace

std::unique_ptr<Learner> MakePriorLearner(const std::string& path, const PriorTraining& training) {
  const std::map<std::string, NumberTable> tables = ReadTables(path);
  if (const auto found = tables.find("pose"); found != tables.end() && found->second.rows < 2)
    throw std::runtime_error(path + ": has no poses to learn from");
  return std::make_unique<PriorLearner>(tables, training);
}

}  // namespace weft::learning

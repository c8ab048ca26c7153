#include "animation/paper/graph_prior.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

bool AllFinite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}

}  // namespace

GraphPose GraphPrior::Decode(const Eigen::VectorXd& z, Eigen::MatrixXd* ways) const {
  Eigen::VectorXf values = z.cast<float>();
  Eigen::MatrixXf slopes = Eigen::MatrixXf::Identity(z.size(), z.size());
  for (size_t k = 0; k < layers.size(); ++k) {
    const PriorLayer& layer = layers[k];
    const Eigen::Map<const RowMajor> weight(layer.weight.data(), layer.to, layer.from);
    values = weight * values + Eigen::Map<const Eigen::VectorXf>(layer.bias.data(), layer.to);
    if (ways != nullptr) slopes = weight * slopes;
    if (k + 1 == layers.size()) break;
    for (int i = 0; i < layer.to; ++i) {
      if (values[i] >= 0) continue;
      values[i] *= kPriorLeak;
      if (ways != nullptr) slopes.row(i) *= kPriorLeak;
    }
  }
  const Eigen::Map<const Eigen::VectorXf> units(unit.data(), static_cast<Eigen::Index>(unit.size()));
  const Eigen::VectorXd numbers = units.cwiseProduct(values).cast<double>();
  if (ways != nullptr) {
    ways->setZero(numbers.size() + 6, z.size());
    ways->bottomRows(numbers.size()) = (units.asDiagonal() * slopes).cast<double>();
  }
  GraphPose out = GraphPose::Zero(6, numbers.size() / 6 + 1);
  out.rightCols(numbers.size() / 6) = Eigen::Map<const GraphPose>(numbers.data(), 6, numbers.size() / 6);
  return out;
}

absl::Status GraphPrior::Validate(int nodes) const {
  const auto bad = [](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat("prior of the graph: ", what));
  };
  const size_t numbers = 6 * static_cast<size_t>(nodes - 1);
  if (unit.size() != numbers)
    return bad(absl::StrCat("is of ", unit.size(), " numbers, the graph has ", numbers));
  if (layers.empty() || layers.front().from < 1) return bad("has no layers");
  int from = layers.front().from;
  for (const PriorLayer& layer : layers) {
    if (layer.from != from || layer.to < 1) return bad("a layer does not follow the one before");
    if (layer.bias.size() != static_cast<size_t>(layer.to) ||
        layer.weight.size() != static_cast<size_t>(layer.to) * static_cast<size_t>(layer.from))
      return bad("a layer has another number of weights than its size says");
    if (!AllFinite(layer.weight) || !AllFinite(layer.bias)) return bad("a weight is not finite");
    from = layer.to;
  }
  if (static_cast<size_t>(from) != numbers)
    return bad(absl::StrCat("makes ", from, " numbers, the graph has ", numbers));
  if (!AllFinite(unit)) return bad("a unit is not finite");
  return absl::OkStatus();
}

Eigen::VectorXd NumbersOf(const GraphPose& pose) {
  return Eigen::Map<const Eigen::VectorXd>(pose.data() + 6, pose.size() - 6);
}

std::vector<float> PoseUnits(const DeformationGraph& graph, double move_mm) {
  const Eigen::Index numbers = 6 * graph.nodes();
  const GraphPose still = GraphPose::Zero(6, graph.nodes());
  const auto motions = PlaceNodes(graph, Eigen::Isometry3d::Identity(), still);
  const NodeVelocities velocities =
      VelocitiesOf(graph, still, motions, Eigen::MatrixXd::Identity(numbers, numbers));
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(numbers);
  for (int v = 0; v < graph.vertices(); ++v)
    squares += VelocityOf(graph, v, motions, velocities).colwise().squaredNorm().transpose();
  std::vector<float> out;
  for (Eigen::Index i = 6; i < numbers; ++i)
    out.push_back(static_cast<float>(move_mm / std::sqrt(std::max(1e-6, squares[i] / graph.vertices()))));
  return out;
}

absl::StatusOr<GraphPrior> LearnLinearPrior(const std::vector<Eigen::VectorXd>& poses,
                                            std::vector<float> unit, int components) {
  if (poses.size() < 2)
    return absl::InvalidArgumentError("prior of the graph: at least two poses are needed");
  const Eigen::Index numbers = poses.front().size();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(numbers);
  const Eigen::VectorXd units = Eigen::Map<const Eigen::VectorXf>(unit.data(), numbers).cast<double>();
  const auto count = static_cast<double>(poses.size());
  for (const Eigen::VectorXd& pose : poses) mean += pose.cwiseQuotient(units) / count;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(numbers, numbers);
  for (const Eigen::VectorXd& pose : poses)
    covariance.selfadjointView<Eigen::Lower>().rankUpdate(pose.cwiseQuotient(units) - mean, 1 / count);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const auto kept = static_cast<int>(std::min(
      {static_cast<Eigen::Index>(components), numbers, static_cast<Eigen::Index>(poses.size() - 1)}));
  GraphPrior out;
  out.unit = std::move(unit);
  PriorLayer layer{kept, static_cast<int>(numbers), {}, {}};
  layer.weight.resize(static_cast<size_t>(numbers * kept));
  Eigen::Map<RowMajor> weight(layer.weight.data(), numbers, kept);
  for (int k = 0; k < kept; ++k) {
    const Eigen::Index from = numbers - 1 - k;
    weight.col(k) = (std::sqrt(std::max(0.0, solver.eigenvalues()[from])) * solver.eigenvectors().col(from))
                        .cast<float>();
  }
  const Eigen::VectorXf middle = mean.cast<float>();
  layer.bias.assign(middle.data(), middle.data() + numbers);
  out.layers.push_back(std::move(layer));
  return out;
}

}  // namespace weft

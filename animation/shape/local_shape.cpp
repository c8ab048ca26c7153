#include "animation/shape/local_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "animation/shape/edge_vectors.h"

namespace weft {
namespace {

// A region reaches so many times further than the point that is furthest from all middles.
constexpr double kOverlap = 1.6;
// Of the largest eigenvalue: distances along cloth do not make a covariance by themselves.
constexpr double kLeastEigenvalue = 0.02;

Eigen::MatrixXd InverseOf(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const double least = kLeastEigenvalue * solver.eigenvalues().maxCoeff();
  const Eigen::VectorXd inverse = solver.eigenvalues().cwiseMax(least).cwiseInverse();
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace

absl::Status LocalShapeOptions::Validate() const {
  if (regions < 0 || regions > 200)
    return absl::InvalidArgumentError("local shape: regions must be 0 to 200");
  if (components < 1) return absl::InvalidArgumentError("local shape: components must be at least 1");
  if (!(spread > 0) || !(reach_mm > 0))
    return absl::InvalidArgumentError("local shape: spread and reach_mm must be positive");
  if (steps < 1) return absl::InvalidArgumentError("local shape: steps must be at least 1");
  return absl::OkStatus();
}

ShapeRegions DivideShape(const TriangleMesh& rest, const MeshGraph& graph, const LocalShapeOptions& options) {
  ShapeRegions out;
  out.of_vertex.resize(graph.vertices);
  if (options.regions == 0) return out;
  const FarPoints middles = ChooseFarPoints(options.regions, rest, graph);
  const std::vector<std::vector<double>>& ways = middles.ways_mm;
  out.count = static_cast<int>(middles.vertices.size());
  const double radius = std::max(1e-6, kOverlap * middles.furthest_mm);
  for (int v = 0; v < graph.vertices; ++v) {
    double sum = 0;
    for (int r = 0; r < out.count; ++r) {
      if (!(ways[r][v] < radius)) continue;
      const double weight = std::pow(1 - ways[r][v] / radius, 2);
      out.of_vertex[v].emplace_back(r, weight);
      sum += weight;
    }
    for (auto& [region, weight] : out.of_vertex[v]) weight /= sum;
  }
  Eigen::MatrixXd covariance(out.count, out.count);
  for (int r = 0; r < out.count; ++r)
    for (int s = 0; s < out.count; ++s)
      covariance(r, s) =
          options.spread * options.spread * std::exp(-ways[r][middles.vertices[s]] / options.reach_mm);
  out.information = InverseOf(0.5 * (covariance + covariance.transpose()));
  return out;
}

LocalShape::LocalShape(const ShapeSpace& space, ShapeRegions regions, const LocalShapeOptions& options)
    : space_(space), regions_(std::move(regions)), options_(options) {
  options_.components = std::min(options_.components, space.components());
  const size_t size = 3 * static_cast<size_t>(space.vertices), components = space.sigma_mm.size();
  ways_.resize(size * components);
  for (size_t k = 0; k < components; ++k)
    for (size_t i = 0; i < size; ++i)
      ways_[(i / 3 * components + k) * 3 + i % 3] = space.sigma_mm[k] * space.basis[k * size + i];
}

void LocalShape::CoefficientsAt(int vertex, const ShapeState& state, Eigen::VectorXd* z) const {
  *z = state.z;
  if (state.local.size() > 0)
    for (const auto& [region, weight] : regions_.of_vertex[vertex])
      z->head(options_.components) += weight * state.local.row(region).transpose();
}

Eigen::Vector3d LocalShape::PointAt(int vertex, const Eigen::VectorXd& z) const {
  Eigen::Vector3d out =
      Eigen::Map<const Eigen::Vector3f>(&space_.mean_mm[3 * static_cast<size_t>(vertex)]).cast<double>();
  const auto ways = WaysOf(vertex);
  for (Eigen::Index k = 0; k < z.size(); ++k) out += z[k] * ways.col(k).cast<double>();
  return out;
}

Eigen::Vector3d LocalShape::PointOf(int vertex, const ShapeState& state) const {
  Eigen::VectorXd z;
  CoefficientsAt(vertex, state, &z);
  return PointAt(vertex, z);
}

std::vector<Eigen::Vector3d> LocalShape::PointsOf(const std::vector<VertexRay>& rays,
                                                  const ShapeState& state) const {
  std::vector<Eigen::Vector3d> out;
  out.reserve(rays.size());
  Eigen::VectorXd z;
  for (const VertexRay& ray : rays) {
    CoefficientsAt(ray.vertex, state, &z);
    out.push_back(PointAt(ray.vertex, z));
  }
  return out;
}

std::vector<Eigen::Vector3d> LocalShape::MeshOf(const ShapeState& state) const {
  std::vector<Eigen::Vector3d> out(space_.vertices);
  Eigen::VectorXd z;
  for (int v = 0; v < space_.vertices; ++v) {
    CoefficientsAt(v, state, &z);
    out[v] = state.root * PointAt(v, z);
  }
  return out;
}

void LocalShape::AddRegions(const std::vector<VertexRay>& rays, const Eigen::MatrixXd& common,
                            const Eigen::VectorXd& residual, Eigen::MatrixXd* normal,
                            Eigen::VectorXd* right) const {
  const Eigen::Index wide = options_.components, head = common.rows();
  std::vector<std::vector<std::pair<Eigen::Index, double>>> of_region(regions_.count);
  Eigen::MatrixXd own_square(wide, wide);
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    const auto own = common.block(6, at, wide, 2);
    own_square.noalias() = own.lazyProduct(own.transpose());
    const auto& regions = regions_.of_vertex[rays[i].vertex];
    for (size_t r = 0; r < regions.size(); ++r) {
      of_region[regions[r].first].emplace_back(at, regions[r].second);
      for (size_t s = 0; s <= r; ++s)
        normal->block(head + regions[r].first * wide, head + regions[s].first * wide, wide, wide) +=
            regions[r].second * regions[s].second * own_square;
    }
  }
  for (int r = 0; r < regions_.count; ++r) {
    const auto count = static_cast<Eigen::Index>(of_region[r].size());
    Eigen::MatrixXd all(head, 2 * count), own(wide, 2 * count);
    Eigen::VectorXd pull(2 * count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto& [at, share] = of_region[r][k];
      all.middleCols(2 * k, 2) = common.middleCols(at, 2);
      own.middleCols(2 * k, 2) = share * common.block(6, at, wide, 2);
      pull.segment<2>(2 * k) = residual.segment<2>(at);
    }
    normal->block(head + r * wide, 0, wide, head).noalias() += own * all.transpose();
    right->segment(head + r * wide, wide).noalias() += own * pull;
  }
}

double LocalShape::Step(const std::vector<VertexRay>& rays, const std::vector<double>& weight,
                        const ShapePrior& prior, int components, bool with_regions, ShapeState* state) const {
  const std::vector<Eigen::Vector3d> points = PointsOf(rays, *state);
  const int parts = with_regions ? regions_.count : 0, wide = options_.components, head = 6 + components;
  const int unknowns = head + parts * wide;
  if (parts > 0 && state->local.size() == 0) state->local = Eigen::MatrixXd::Zero(parts, wide);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  const Eigen::Matrix3d rotation = state->root.linear();
  // Two columns a ray: what the unknowns that all rays share do to its distance. Products of many columns at
  // once take a fraction of the time.
  Eigen::MatrixXd common(head, 2 * rays.size());
  Eigen::VectorXd residual(2 * rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    const VertexRay& ray = rays[i];
    const Eigen::Vector3d turned = rotation * points[i];
    const Eigen::Vector3d way = ray.OffsetTo(turned + state->root.translation());
    const Eigen::Vector3d first = ray.direction.unitOrthogonal();
    const Eigen::Vector3d across[2] = {first, ray.direction.cross(first)};
    const auto ways = WaysOf(ray.vertex);
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector3d a = std::sqrt(weight[i]) * across[side], in_space = rotation.transpose() * a;
      const auto at = static_cast<Eigen::Index>(2 * i) + side;
      residual[at] = a.dot(way);
      common.col(at).head<3>() = turned.cross(a);
      common.col(at).segment<3>(3) = a;
      for (int k = 0; k < components; ++k) common(6 + k, at) = ways.col(k).cast<double>().dot(in_space);
    }
  }
  normal.topLeftCorner(head, head).selfadjointView<Eigen::Lower>().rankUpdate(common);
  right.head(head).noalias() = common * residual;
  if (parts > 0) AddRegions(rays, common, residual, &normal, &right);
  for (int k = 0; k < components; ++k) {
    normal(6 + k, 6 + k) += 1 + prior.information[k];
    right[6 + k] += -state->z[k] + prior.information[k] * (prior.expected[k] - state->z[k]);
  }
  normal.diagonal().head<6>().array() += 1e-9;
  for (int r = 0; r < parts; ++r) {
    for (int s = 0; s <= r; ++s)
      normal.block(head + r * wide, head + s * wide, wide, wide).diagonal().array() +=
          regions_.information(r, s);
    right.segment(head + r * wide, wide) -= (regions_.information.row(r) * state->local).transpose();
  }
  const Eigen::VectorXd change = normal.selfadjointView<Eigen::Lower>().llt().solve(right);
  if (!change.allFinite()) return -1;
  const double angle = change.head<3>().norm();
  Eigen::Matrix3d turned = rotation;
  if (angle > 0) turned = Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix() * rotation;
  state->root.linear() = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
  state->root.translation() += change.segment<3>(3);
  state->z.head(components) += change.segment(6, components);
  for (int r = 0; r < parts; ++r) state->local.row(r) += change.segment(head + r * wide, wide).transpose();
  return std::max(change.tail(unknowns - 6).cwiseAbs().maxCoeff(), 1e3 * angle * 0.01);
}

}  // namespace weft

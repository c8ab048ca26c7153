#include "animation/sparse_view/driving_features.h"

#include <algorithm>

#include "alignment/vertex_normals.h"

namespace weft {
namespace {

constexpr float kCarrierUnitMm = 20, kPlaceUnitMm = 500, kStretchUnit = 0.05f, kLeftUnitMm = 10;
constexpr float kWorstMisfit = 4;

}  // namespace

DrivingFeatures::DrivingFeatures(const AlignmentModel& model, const SparseViewAvatar& avatar)
    : model_(model), avatar_(avatar), axes_(model.rest(), model.graph()) {
  rest_middle_mm_.setZero();
  for (const Eigen::Vector3d& p : model.rest().vertices_mm) rest_middle_mm_ += p;
  rest_middle_mm_ /= static_cast<double>(model.graph().vertices);
}

std::vector<float> DrivingFeatures::StretchOf(const std::vector<Eigen::Vector3d>& position_mm) const {
  const MeshGraph& graph = model_.graph();
  std::vector<float> out(graph.vertices, 0);
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    const auto [a, b] = graph.edges[e];
    const auto length = static_cast<float>((position_mm[a] - position_mm[b]).norm());
    const float stretch = std::clamp(length / std::max(avatar_.edge_mm[e], 1e-3f) - 1, -1.0f, 1.0f);
    out[a] += stretch, out[b] += stretch;
  }
  for (int v = 0; v < graph.vertices; ++v) out[v] /= static_cast<float>(std::max(1, graph.degree(v)));
  return out;
}

std::vector<float> DrivingFeatures::Of(const RayDrivenFrame& frame, std::span<const VertexRay> rays,
                                       std::span<const Eigen::Matrix3f> canonical) const {
  const MeshGraph& graph = model_.graph();
  const int vertices = graph.vertices;
  const std::vector<float> stretch = StretchOf(frame.position_mm), of_carrier = StretchOf(frame.carrier_mm);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(frame.position_mm, model_.rest().faces);
  const Eigen::Isometry3d to_space = frame.track.state.root.inverse();
  std::vector<float> out(static_cast<size_t>(vertices) * kDrivingFeatures, 0);
  const auto put = [&](int v, int at, const Eigen::Vector3f& vector) {
    for (int k = 0; k < 3; ++k) out[static_cast<size_t>(v) * kDrivingFeatures + at + k] = vector[k];
  };
  for (int v = 0; v < vertices; ++v) {
    float* of = &out[static_cast<size_t>(v) * kDrivingFeatures];
    of[0] = 1;
    const Eigen::Vector3f from_carrier = (frame.position_mm[v] - frame.carrier_mm[v]).cast<float>();
    put(v, 1, canonical[v].transpose() * from_carrier / kCarrierUnitMm);
    put(v, 14, (to_space.linear() * normals[v]).cast<float>());
    put(v, 17, (to_space * frame.position_mm[v]).cast<float>() / kPlaceUnitMm);
    put(v, 20, (model_.rest().vertices_mm[v] - rest_middle_mm_).cast<float>() / kPlaceUnitMm);
    of[23] = stretch[v] / kStretchUnit;
    of[24] = of_carrier[v] / kStretchUnit;
    of[25] = avatar_.left_mm[v] / kLeftUnitMm;
    of[26] = std::min(static_cast<float>(frame.misfit[v]), kWorstMisfit);
  }
  for (size_t i = 0; i < rays.size();) {
    const int v = rays[i].vertex;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Matrix3f across = Eigen::Matrix3f::Zero();
    int count = 0;
    for (; i < rays.size() && rays[i].vertex == v; ++i) {
      if (frame.rejected[i]) continue;
      const Eigen::Vector3f d = canonical[v].transpose() * rays[i].direction.cast<float>();
      sum += d;
      across += Eigen::Matrix3f::Identity() - d * d.transpose();
      ++count;
    }
    if (count == 0) continue;
    across /= static_cast<float>(count);
    float* of = &out[static_cast<size_t>(v) * kDrivingFeatures];
    put(v, 4, across.diagonal());
    put(v, 7, {across(0, 1), across(0, 2), across(1, 2)});
    of[10] = static_cast<float>(count) / 3;
    put(v, 11, sum / static_cast<float>(count));
  }
  for (float& value : out) value = std::clamp(value, -kMostFeature, kMostFeature);
  return out;
}

}  // namespace weft

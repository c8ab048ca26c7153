#include "animation/rays/evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

absl::Status CheckView(const DrivingView& view) {
  if (view.camera == nullptr) return absl::InvalidArgumentError("a view without camera");
  WEFT_RETURN_IF_ERROR(view.camera->Validate());
  for (const Observation& o : view.observations) {
    if (std::isfinite(o.x_px) && std::isfinite(o.y_px) && o.sigma_px >= 0 && std::isfinite(o.sigma_px))
      continue;
    return absl::InvalidArgumentError(absl::StrCat("camera ", view.camera->id, ": the observation of node ",
                                                   o.node.row, ", ", o.node.col,
                                                   " is not finite, or has a negative sigma"));
  }
  return absl::OkStatus();
}

// Views in the order of their cameras' names.
std::vector<int> OrderByName(std::span<const DrivingView> views) {
  std::vector<int> order(views.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return views[a].camera->id < views[b].camera->id; });
  return order;
}

bool IsBetter(const Observation& a, const Observation& b) {
  if (a.confidence != b.confidence) return a.confidence > b.confidence;
  if (a.sigma_px != b.sigma_px) return a.sigma_px < b.sigma_px;
  return std::pair(a.x_px, a.y_px) < std::pair(b.x_px, b.y_px);
}

void AppendRays(const DrivingView& view, int place, const NodeVertices& nodes, double cloth_sigma_px,
                std::vector<VertexRay>* out) {
  struct Seen {
    int vertex;
    const Observation* observation;
  };
  std::vector<Seen> seen;
  for (const Observation& o : view.observations) {
    const int vertex = nodes.VertexOf(o.node);
    if (vertex >= 0) seen.push_back({vertex, &o});
  }
  std::stable_sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return a.vertex != b.vertex ? a.vertex < b.vertex : IsBetter(*a.observation, *b.observation);
  });
  const CameraModel& camera = *view.camera;
  const double focal_px = std::sqrt(camera.fx_px * camera.fy_px);
  int last = -1;
  for (const Seen& s : seen) {
    if (s.vertex == last) continue;
    last = s.vertex;
    const std::optional<Ray> ray = camera.PixelRay({s.observation->x_px, s.observation->y_px});
    if (!ray) continue;
    const double sigma_px = std::hypot(static_cast<double>(s.observation->sigma_px), cloth_sigma_px);
    out->push_back({s.vertex, place, ray->origin_mm, ray->direction, sigma_px / focal_px, focal_px});
  }
}

}  // namespace

uint64_t NodeVertices::Key(int row, int col, NodeKind kind) {
  return static_cast<uint64_t>(static_cast<uint32_t>(row)) << 32 |
         static_cast<uint64_t>(static_cast<uint32_t>(col)) << 1 | (kind == NodeKind::kCorner ? 1 : 0);
}

NodeVertices::NodeVertices(const Template& garment) {
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const VertexNode& node = garment.node_of_vertex[v];
    if (node.row >= 0) vertex_.emplace(Key(node.row, node.col, node.kind), static_cast<int>(v));
  }
}

int NodeVertices::VertexOf(const BoardNode& node) const {
  if (node.row < 0 || node.col < 0) return -1;
  const auto found = vertex_.find(Key(node.row, node.col, node.kind));
  return found == vertex_.end() ? -1 : found->second;
}

std::vector<int> PlacesByName(std::span<const DrivingView> views) {
  const std::vector<int> order = OrderByName(views);
  std::vector<int> out(views.size());
  for (size_t place = 0; place < order.size(); ++place) out[order[place]] = static_cast<int>(place);
  return out;
}

absl::StatusOr<std::vector<VertexRay>> RaysOf(std::span<const DrivingView> views, const NodeVertices& nodes,
                                              double cloth_sigma_px) {
  for (const DrivingView& view : views) WEFT_RETURN_IF_ERROR(CheckView(view));
  const std::vector<int> order = OrderByName(views);
  std::vector<VertexRay> out;
  for (size_t place = 0; place < order.size(); ++place) {
    const DrivingView& view = views[order[place]];
    if (place > 0 && views[order[place - 1]].camera->id == view.camera->id)
      return absl::InvalidArgumentError(absl::StrCat("camera ", view.camera->id, " is there twice"));
    AppendRays(view, static_cast<int>(place), nodes, cloth_sigma_px, &out);
  }
  std::stable_sort(out.begin(), out.end(), [](const VertexRay& a, const VertexRay& b) {
    return a.vertex != b.vertex ? a.vertex < b.vertex : a.view < b.view;
  });
  return out;
}

void RayEvidence::Add(const VertexRay& ray, const Eigen::Vector3d& near_mm, double weight) {
  const double sigma_mm = ray.SigmaMm(near_mm);
  const Eigen::Matrix3d across = weight / (sigma_mm * sigma_mm) *
                                 (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose());
  information += across;
  moment += across * ray.origin_mm;
  ++rays;
}

}  // namespace weft

#include "animation/rays/imagined_views.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "alignment/ray_scene.h"
#include "alignment/vertex_normals.h"
#include "base/counter_random.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// Cloth this close before a vertex is its own fold at most.
constexpr double kClearanceMm = 3;

}  // namespace

absl::StatusOr<std::vector<VertexRay>> ImagineRays(const std::vector<Eigen::Vector3d>& vertices_mm,
                                                   const std::vector<Face>& faces,
                                                   const std::vector<bool>& is_node,
                                                   const ImaginedViews& views) {
  WEFT_ASSIGN_OR_RETURN(const RayScene scene, RayScene::Build(vertices_mm, faces));
  const std::vector<Eigen::Vector3d> normals = VertexNormals(vertices_mm, faces);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : vertices_mm) box.extend(p);
  const Eigen::Vector3d aside = views.up.unitOrthogonal();
  const size_t vertices = vertices_mm.size();
  std::vector<Eigen::Vector3d> eyes;
  for (int camera = 0; camera < views.cameras; ++camera) {
    const double angle = (views.azimuth_deg + 360.0 * camera / views.cameras) * kDegree;
    const double above = (camera % 2 == 0 ? 1 : -1) * views.elevation_deg * kDegree;
    const Eigen::Vector3d level = Eigen::AngleAxisd(angle, views.up.normalized()) * aside;
    eyes.push_back(box.center() + views.distance * box.diagonal().norm() *
                                      (std::cos(above) * level + std::sin(above) * views.up.normalized()));
  }
  // [vertices][cameras]
  std::vector<char> sees(vertices * eyes.size(), 0);
  const double least_facing = std::cos(views.most_facing_deg * kDegree);
  tbb::parallel_for(size_t{0}, vertices, [&](size_t v) {
    for (size_t camera = 0; camera < eyes.size() && is_node[v]; ++camera) {
      const Eigen::Vector3d to = (vertices_mm[v] - eyes[camera]).normalized();
      if (-normals[v].dot(to) < least_facing) continue;
      const uint64_t key = KeyOf(views.seed, absl::StrCat("lost ", camera));
      if (UniformOf(key, v) < views.lost_share) continue;
      sees[v * eyes.size() + camera] = scene.InSight(eyes[camera], vertices_mm[v], kClearanceMm) ? 1 : 0;
    }
  });
  std::vector<VertexRay> out;
  for (size_t v = 0; v < vertices; ++v)
    for (size_t camera = 0; camera < eyes.size(); ++camera) {
      if (sees[v * eyes.size() + camera] == 0) continue;
      const Eigen::Vector3d to = (vertices_mm[v] - eyes[camera]).normalized(), a = to.unitOrthogonal();
      const uint64_t key = KeyOf(views.seed, absl::StrCat("noise ", camera));
      const Eigen::Vector3d noise = a * NormalOf(key, 2 * v) + to.cross(a) * NormalOf(key, 2 * v + 1);
      out.push_back({static_cast<int>(v), static_cast<int>(camera), eyes[camera],
                     (to + views.noise_rad * noise).normalized(), views.sigma_rad});
    }
  return out;
}

}  // namespace weft

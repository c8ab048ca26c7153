#include "physics/impact_zones.h"

#include <algorithm>
#include <map>

#include "alignment/placement.h"

namespace weft {
namespace {

using Eigen::Vector3d;

}  // namespace

int ImpactZones::ZoneOf(int vertex) const {
  while (next_[vertex] != vertex) vertex = next_[vertex];
  return vertex;
}

void ImpactZones::Unite(const std::array<int, 4>& vertices) {
  int zone = *std::min_element(vertices.begin(), vertices.end());
  for (const int v : vertices)
    if (Contains(v)) zone = std::min(zone, ZoneOf(v));
  for (int v : vertices)
    while (next_[v] != zone) {  // the whole way leads there from now on
      const int following = Contains(v) ? next_[v] : zone;
      next_[v] = zone;
      v = following;
    }
}

bool ImpactZones::Unites(const std::array<int, 4>& vertices) const {
  return std::all_of(vertices.begin(), vertices.end(), [&](int v) {
    return Contains(v) && Contains(vertices[0]) && ZoneOf(v) == ZoneOf(vertices[0]);
  });
}

void ImpactZones::MoveAsOne(const std::vector<Vector3d>& from_mm, const std::vector<Vector3d>& wanted_mm,
                            double longest_mm, std::vector<Vector3d>& moved_mm) const {
  std::map<int, std::vector<int>> zones;
  for (size_t v = 0; v < next_.size(); ++v)
    if (next_[v] >= 0) zones[ZoneOf(static_cast<int>(v))].push_back(static_cast<int>(v));
  for (const auto& [name, members] : zones) {
    std::vector<Vector3d> from, to;
    Vector3d mean = Vector3d::Zero();
    for (const int v : members) {
      from.push_back(from_mm[v]);
      to.push_back(from_mm[v] + wanted_mm[v]);
      mean += wanted_mm[v] / static_cast<double>(members.size());
    }
    const Eigen::Isometry3d motion = RigidFit(from, to);
    const bool is_far = std::any_of(from.begin(), from.end(),
                                    [&](const Vector3d& p) { return (motion * p - p).norm() > longest_mm; });
    for (const int v : members) moved_mm[v] = is_far ? mean : Vector3d(motion * from_mm[v] - from_mm[v]);
  }
}

}  // namespace weft

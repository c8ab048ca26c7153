#include "simulation/impact_zones.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

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
    const auto count = static_cast<Eigen::Index>(members.size());
    Eigen::Matrix3Xd from(3, count), to(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      from.col(k) = from_mm[members[k]];
      to.col(k) = from.col(k) + wanted_mm[members[k]];
    }
    const Eigen::Isometry3d motion(Eigen::umeyama(from, to, false));
    Eigen::Matrix3Xd move = motion * from - from;
    if (move.colwise().norm().maxCoeff() > longest_mm) {
      const Vector3d mean = (to - from).rowwise().mean();
      move.colwise() = mean;
    }
    for (Eigen::Index k = 0; k < count; ++k) moved_mm[members[k]] = move.col(k);
  }
}

}  // namespace weft

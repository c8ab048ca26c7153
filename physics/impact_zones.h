// Vertices of cloth that can only move as one rigid body: the impact zones of Bridson, Fedkiw and Anderson
// 2002 (section 7.5), after Provot 1997.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace weft {

class ImpactZones {
 public:
  explicit ImpactZones(size_t vertices) : next_(vertices, -1) {}

  // Makes them, and the zones that they are in, one zone.
  void Unite(const std::array<int, 4>& vertices);
  bool Contains(int vertex) const { return next_[vertex] >= 0; }
  // Whether all are of one zone.
  bool Unites(const std::array<int, 4>& vertices) const;

  // The displacements `wanted_mm`, those of each zone replaced by the rigid motion that is nearest to them; a
  // translation where vertices would move by more than `longest_mm` otherwise. [vertices]
  void MoveAsOne(const std::vector<Eigen::Vector3d>& from_mm, const std::vector<Eigen::Vector3d>& wanted_mm,
                 double longest_mm, std::vector<Eigen::Vector3d>& moved_mm) const;

 private:
  int ZoneOf(int vertex) const;

  std::vector<int> next_;  // on the way to the vertex that names the zone, which is its own; -1: in no zone
};

}  // namespace weft

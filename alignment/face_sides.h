// Which side of a mesh its faces show: consistent orientation, and whether it is the outside.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// Faces that hang together by edges, with the sense in which each runs.
struct FaceSides {
  int components = 0;
  std::vector<int> component;   // [faces]
  std::vector<uint8_t> turned;  // [faces]: 1 where the face runs against the first one of its component
  int one_sided = -1;           // a face at which no orientation is consistent (a Moebius band); -1: none
};

// Vertices from 0; an edge has at most two faces.
FaceSides FindFaceSides(std::span<const Face> faces);

enum class ShownSide { kUnknown, kOutside, kInside };

// Sums over faces that tell whether they show the outside of what they enclose. The volume between the faces
// and a middle within is positive where they do: cones from the middle close all openings. Only surfaces that
// are nearly closed tell, as worn garments are: their area vectors cancel. Sheets have no inside.
class EnclosedVolume {
 public:
  explicit EnclosedVolume(const Eigen::Vector3d& middle_mm) : middle_mm_(middle_mm) {}

  void Add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d from = a - middle_mm_;
    const Eigen::Vector3d twice = (b - a).cross(c - a);
    volume_ += from.dot(twice) / 6;
    area_ += twice.norm() / 2;
    vector_ += twice / 2;
  }
  ShownSide Side() const;
  // 36 pi V^2 / A^3 to the power 1/2, with the sign of the volume: 1 for a sphere seen from outside.
  double Roundness() const;
  // Length of the sum of area vectors over the area: 0 for closed surfaces, 1 for plane ones.
  double Openness() const;

 private:
  Eigen::Vector3d middle_mm_;
  double volume_ = 0, area_ = 0;
  Eigen::Vector3d vector_ = Eigen::Vector3d::Zero();
};

// The mean of some corners of these faces, evenly spread.
Eigen::Vector3d MiddleOf(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces);
// Of the mesh whose faces these are.
EnclosedVolume VolumeWithin(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces);

}  // namespace weft

#include "alignment/face_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

namespace weft {
namespace {

// The least roundness and greatest openness that tell inside from outside. The garments of
// tests/alignment/template_build/template_check_test.cpp have roundness from 0.34 and openness up to 0.24; a
// plane has 0 and 1.
constexpr double kLeastRoundness = 0.08, kMostOpenness = 0.3;

struct Side {
  int low, high, face;
  bool forward;
};

// Of each face's three edges: twice the face beyond, plus 1 where both run through the edge in the same
// sense; -1 at borders.
std::vector<std::array<int, 3>> FacesBeyond(std::span<const Face> faces) {
  std::vector<Side> sides;
  sides.reserve(3 * faces.size());
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = faces[f][i], b = faces[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(3 * f) + i, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  std::vector<std::array<int, 3>> beyond(faces.size(), {-1, -1, -1});
  for (size_t i = 1; i < sides.size(); ++i) {
    const Side &a = sides[i - 1], &b = sides[i];
    if (a.low != b.low || a.high != b.high) continue;
    const int against = a.forward == b.forward;
    beyond[static_cast<size_t>(a.face / 3)][a.face % 3] = 2 * (b.face / 3) + against;
    beyond[static_cast<size_t>(b.face / 3)][b.face % 3] = 2 * (a.face / 3) + against;
  }
  return beyond;
}

}  // namespace

FaceSides FindFaceSides(std::span<const Face> faces) {
  const std::vector<std::array<int, 3>> beyond = FacesBeyond(faces);
  FaceSides sides;
  sides.component.assign(faces.size(), -1);
  sides.turned.assign(faces.size(), 0);
  std::vector<int> front;
  for (size_t first = 0; first < faces.size(); ++first) {
    if (sides.component[first] >= 0) continue;
    sides.component[first] = sides.components;
    front.assign(1, static_cast<int>(first));
    while (!front.empty()) {
      const auto f = static_cast<size_t>(front.back());
      front.pop_back();
      for (const int link : beyond[f]) {
        if (link < 0) continue;
        const auto other = static_cast<size_t>(link / 2);
        const auto turned = static_cast<uint8_t>(sides.turned[f] ^ (link & 1));
        if (sides.component[other] < 0) {
          sides.component[other] = sides.components;
          sides.turned[other] = turned;
          front.push_back(link / 2);
        } else if (sides.turned[other] != turned && sides.one_sided < 0) {
          sides.one_sided = link / 2;
        }
      }
    }
    ++sides.components;
  }
  return sides;
}

double EnclosedVolume::Roundness() const {
  return area_ > 0 ? 6 * std::sqrt(std::numbers::pi) * volume_ / std::pow(area_, 1.5) : 0;
}

double EnclosedVolume::Openness() const { return area_ > 0 ? vector_.norm() / area_ : 1; }

ShownSide EnclosedVolume::Side() const {
  const double roundness = Roundness();
  if (Openness() > kMostOpenness || std::abs(roundness) < kLeastRoundness) return ShownSide::kUnknown;
  return roundness > 0 ? ShownSide::kOutside : ShownSide::kInside;
}

Eigen::Vector3d MiddleOf(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces) {
  constexpr size_t kEnough = 1000;
  const size_t step = std::max<size_t>(1, faces.size() / kEnough);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (size_t f = 0; f < faces.size(); f += step, ++count)
    sum += vertices_mm[static_cast<size_t>(faces[f][0])];
  return count > 0 ? Eigen::Vector3d(sum / count) : sum;
}

EnclosedVolume VolumeWithin(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces) {
  EnclosedVolume volume(MiddleOf(vertices_mm, faces));
  for (const Face& face : faces) {
    volume.Add(vertices_mm[static_cast<size_t>(face[0])], vertices_mm[static_cast<size_t>(face[1])],
               vertices_mm[static_cast<size_t>(face[2])]);
  }
  return volume;
}

}  // namespace weft

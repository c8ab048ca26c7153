#include "physics/fabric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "physics/parallel.h"

namespace weft {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kKgPerMm2PerKgPerM2 = 1e-6;
constexpr double kKgMm2PerS2PerNm = 1e6;  // 1 N m = 1e6 kg mm^2 / s^2
// Cells cut in two bend more easily along rows and columns than along their diagonals: 0.8 and 1.2 of the
// plate.
constexpr double kHingeShare = 0.8;
constexpr double kLocking = 5;        // stress beyond `locks_at` e is this times (strain - e)^2 / e, relative
constexpr double kShearLocking = 10;  // of the energy, times the fourth power of shear

double Cotangent(const Vector2d& at, const Vector2d& p, const Vector2d& q) {
  const Vector2d a = p - at, b = q - at;
  return a.dot(b) / std::max(std::abs(a.x() * b.y() - a.y() * b.x()), 1e-9);
}

// Per unit of stiffness, at a thread's strain (above 0 when longer).
struct ThreadLaw {
  double energy, stress, slope;
};
ThreadLaw LawOf(double strain, const JerseyOptions& o) {
  if (strain < 0)
    return {o.compression_share * strain * strain / 2, o.compression_share * strain, o.compression_share};
  const double over = std::max(0.0, strain - o.locks_at), locking = kLocking / o.locks_at;
  return {strain * strain / 2 + locking * over * over * over / 3, strain + locking * over * over,
          1 + 2 * locking * over};
}

}  // namespace

absl::Status JerseyOptions::Validate() const {
  const auto check = [](const char* field, double value, double low, double high) -> absl::Status {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("fabric: ", field, " is ", value, ", expected ", low, " to ", high));
  };
  absl::Status status = check("density_kg_m2", density_kg_m2, 1e-3, 10);
  status.Update(check("stretch_n_per_m", stretch_n_per_m, 1, 1e5));
  status.Update(check("compression_share", compression_share, 0.01, 1));
  status.Update(check("shear_n_per_m", shear_n_per_m, 0, 1e5));
  status.Update(check("locks_at", locks_at, 0.01, 10));
  status.Update(check("bending_n_m", bending_n_m, 0, 1e-2));
  status.Update(check("damping_s", damping_s, 0, 0.1));
  status.Update(check("air_drag_per_s", air_drag_per_s, 0, 100));
  status.Update(check("friction", friction, 0, 2));
  status.Update(check("thickness_cells", thickness_cells, 0.05, 0.4));
  return status;
}

int Fabric::Pattern::Find(int row, int col) const {
  const auto begin = column.begin() + first[row], end = column.begin() + first[row + 1];
  return static_cast<int>(std::lower_bound(begin, end, col) - column.begin());
}

Fabric::Pattern Fabric::Pattern::Of(int rows, std::vector<std::array<int, 2>> entries) {
  std::sort(entries.begin(), entries.end());
  entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
  Pattern out;
  out.first.assign(rows + 1, 0);
  for (const auto& [row, col] : entries) {
    ++out.first[row + 1];
    out.column.push_back(col);
  }
  for (int r = 0; r < rows; ++r) out.first[r + 1] += out.first[r];
  return out;
}

Fabric::Fabric(int vertices, const std::vector<Face>& faces,
               const std::vector<std::array<Vector2d, 3>>& flat_mm, const JerseyOptions& options,
               const std::vector<Crease>& creases)
    : options_(options), mass_kg_(vertices, 0), state_(faces.size()), forces_(vertices, Vector3d::Zero()) {
  std::vector<std::array<int, 2>> entries;
  for (size_t f = 0; f < faces.size(); ++f) {
    const auto& p = flat_mm[f];
    const Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
    const double det = e1.x() * e2.y() - e1.y() * e2.x();
    Triangle t;
    t.v = faces[f];
    t.area_mm2 = static_cast<float>(std::abs(det) / 2);
    for (int k = 0; k < 3; ++k) {
      const Vector2d opposite = p[(k + 2) % 3] - p[(k + 1) % 3];
      t.a[k] = static_cast<float>(-opposite.y() / det);
      t.b[k] = static_cast<float>(opposite.x() / det);
      mass_kg_[faces[f][k]] += options.density_kg_m2 * kKgPerMm2PerKgPerM2 * t.area_mm2 / 3;
      for (int j = 0; j < 3; ++j) entries.push_back({faces[f][k], faces[f][j]});
    }
    triangles_.push_back(t);
  }
  membrane_ = Pattern::Of(vertices, std::move(entries));
  block_.assign(membrane_.column.size(), Matrix3f::Zero());
  corner_first_.assign(vertices + 1, 0);
  for (const Face& f : faces)
    for (const int v : f) ++corner_first_[v + 1];
  for (int v = 0; v < vertices; ++v) corner_first_[v + 1] += corner_first_[v];
  corners_.resize(corner_first_.back());
  std::vector<int> used(corner_first_.begin(), corner_first_.end() - 1);
  for (size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      Corner corner = {static_cast<int>(f), k, {}};
      for (int j = 0; j < 3; ++j) corner.entry[j] = membrane_.Find(faces[f][k], faces[f][j]);
      corners_[used[faces[f][k]]++] = corner;
    }
  AddBending(faces, flat_mm, creases);
  AddCreases();
}

void Fabric::AddBending(const std::vector<Face>& faces, const std::vector<std::array<Vector2d, 3>>& flat_mm,
                        const std::vector<Crease>& creases) {
  struct Side {
    int face, corner;  // opposite the edge
  };
  std::map<std::pair<int, int>, std::vector<Side>> sides;
  for (size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k)
      sides[std::minmax(faces[f][(k + 1) % 3], faces[f][(k + 2) % 3])].push_back({static_cast<int>(f), k});
  std::map<std::pair<int, int>, double> crease_of;
  for (const Crease& c : creases) crease_of[std::minmax(c.a, c.b)] = c.angle_rad;
  std::vector<Hinge> hinges;
  std::vector<std::array<int, 2>> entries;
  for (const auto& [edge, both] : sides) {
    if (both.size() != 2) continue;
    Hinge h = {{edge.first, edge.second, 0, 0}, {0, 0, 0, 0}};
    double area = 0;
    for (int s = 0; s < 2; ++s) {
      const auto& [f, k] = both[s];
      const auto& p = flat_mm[f];
      h.v[2 + s] = faces[f][k];
      double cot[2];
      for (int e = 0; e < 2; ++e) {
        const int at = faces[f][(k + 1) % 3] == h.v[e] ? (k + 1) % 3 : (k + 2) % 3;
        cot[e] = Cotangent(p[at], p[k], p[3 - k - at]);
      }
      h.weight[0] += cot[1], h.weight[1] += cot[0], h.weight[2 + s] = -(cot[0] + cot[1]);
      area += triangles_[f].area_mm2;
      h.length_mm += (p[(k + 1) % 3] - p[(k + 2) % 3]).norm() / 2;
    }
    h.stiffness = kHingeShare * options_.bending_n_m * kKgMm2PerS2PerNm / area;
    hinges.push_back(h);
    if (const auto crease = crease_of.find(edge); crease != crease_of.end())
      bent_.push_back(
          {h, 2 * h.length_mm * std::sin(crease->second / 2), {faces[both[0].face], faces[both[1].face]}});
    for (const int i : h.v)
      for (const int j : h.v) entries.push_back({i, j});
  }
  bending_ = Pattern::Of(vertices(), std::move(entries));
  std::vector<double> value(bending_.column.size(), 0);
  for (const Hinge& h : hinges)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        value[bending_.Find(h.v[i], h.v[j])] += h.stiffness * h.weight[i] * h.weight[j];
  bend_.assign(value.begin(), value.end());
}

void Fabric::AddCreases() {
  pull_.resize(bent_.size());
  bent_first_.assign(vertices() + 1, 0);
  for (const BentHinge& bent : bent_)
    for (const int v : bent.hinge.v) ++bent_first_[v + 1];
  for (int v = 0; v < vertices(); ++v) bent_first_[v + 1] += bent_first_[v];
  bent_corners_.resize(bent_first_.back());
  std::vector<int> used(bent_first_.begin(), bent_first_.end() - 1);
  for (size_t h = 0; h < bent_.size(); ++h)
    for (int i = 0; i < 4; ++i)
      bent_corners_[used[bent_[h].hinge.v[i]]++] = {static_cast<int>(h), bent_[h].hinge.weight[i]};
}

// Half way between those of the two faces.
Vector3d Fabric::NormalOf(const BentHinge& bent, const std::vector<Vector3d>& x) {
  Vector3d sum = Vector3d::Zero();
  for (const auto& [a, b, c] : bent.faces) sum += (x[b] - x[a]).cross(x[c] - x[a]).normalized();
  return sum.normalized();
}

void Fabric::EvaluateFaces(const std::vector<Vector3d>& x) {
  const double full = options_.stretch_n_per_m, shear = options_.shear_n_per_m;
  ForEachIndex(triangles_.size(), [&](size_t f) {
    const Triangle& t = triangles_[f];
    TriangleState& s = state_[f];
    const Vector3d e1 = x[t.v[1]] - x[t.v[0]], e2 = x[t.v[2]] - x[t.v[0]];
    const Vector3d wu = e1 * t.a[1] + e2 * t.a[2], wv = e1 * t.b[1] + e2 * t.b[2];
    const auto thread = [&](const Vector3d& w, Matrix3f& p) -> Vector3d {
      const double length = std::max(w.norm(), 1e-9);
      const Vector3d n = w / length;
      const double k = t.area_mm2 * full;
      const ThreadLaw law = LawOf(length - 1, options_);
      const double across = std::max(0.0, law.stress / length);
      p = (k * ((law.slope - across) * (n * n.transpose()) + across * Eigen::Matrix3d::Identity()))
              .cast<float>();
      return k * law.stress * n;
    };
    const double angle = wu.dot(wv), locking = 2 * kShearLocking * angle * angle;
    const double stress = t.area_mm2 * shear * angle * (1 + locking);
    s.tu = thread(wu, s.pu) + stress * wv;
    s.tv = thread(wv, s.pv) + stress * wu;
    s.wu = wu.cast<float>(), s.wv = wv.cast<float>();
    s.shear = static_cast<float>(t.area_mm2 * shear * (1 + 3 * locking));
  });
}

void Fabric::Linearize(const std::vector<Vector3d>& x) {
  EvaluateFaces(x);
  // The bend is along the normal, so that the normal's own change does no work.
  ForEachIndex(bent_.size(), [&](size_t h) {
    pull_[h] = bent_[h].hinge.stiffness * bent_[h].rest * NormalOf(bent_[h], x);
  });
  ForEachIndex(forces_.size(), [&](size_t v) {
    Vector3d force = Vector3d::Zero();
    for (int e = membrane_.first[v]; e < membrane_.first[v + 1]; ++e) block_[e].setZero();
    for (int c = corner_first_[v]; c < corner_first_[v + 1]; ++c) {
      const Corner& corner = corners_[c];
      const Triangle& t = triangles_[corner.face];
      const TriangleState& s = state_[corner.face];
      const float a = t.a[corner.corner], b = t.b[corner.corner];
      force -= a * s.tu + b * s.tv;
      const Vector3f g = s.shear * (a * s.wv + b * s.wu);
      for (int j = 0; j < 3; ++j) {
        Matrix3f& block = block_[corner.entry[j]];
        block += (a * t.a[j]) * s.pu + (b * t.b[j]) * s.pv;
        block += g * (t.a[j] * s.wv + t.b[j] * s.wu).transpose();
      }
    }
    // Relative to the vertex itself: rows of the bending matrix sum to zero.
    for (int e = bending_.first[v]; e < bending_.first[v + 1]; ++e)
      force -= static_cast<double>(bend_[e]) * (x[bending_.column[e]] - x[v]);
    for (int c = bent_first_[v]; c < bent_first_[v + 1]; ++c)
      force += bent_corners_[c].weight * pull_[bent_corners_[c].hinge];
    forces_[v] = force;
  });
}

void Fabric::Multiply(const std::vector<Vector3f>& p, std::vector<Vector3f>& out) const {
  ForEachIndex(p.size(), [&](size_t v) {
    Vector3f sum = Vector3f::Zero();
    for (int e = membrane_.first[v]; e < membrane_.first[v + 1]; ++e)
      sum.noalias() += block_[e] * p[membrane_.column[e]];
    for (int e = bending_.first[v]; e < bending_.first[v + 1]; ++e) sum += bend_[e] * p[bending_.column[e]];
    out[v] = sum;
  });
}

Matrix3f Fabric::Diagonal(int v) const {
  Matrix3f out = block_[membrane_.Find(v, v)];
  if (bending_.first[v] < bending_.first[v + 1]) out.diagonal().array() += bend_[bending_.Find(v, v)];
  return out;
}

std::vector<std::array<double, 2>> Fabric::Stretches(const std::vector<Vector3d>& x) const {
  std::vector<std::array<double, 2>> out;
  for (const Triangle& t : triangles_) {
    const Vector3d e1 = x[t.v[1]] - x[t.v[0]], e2 = x[t.v[2]] - x[t.v[0]];
    out.push_back({(e1 * t.a[1] + e2 * t.a[2]).norm(), (e1 * t.b[1] + e2 * t.b[2]).norm()});
  }
  return out;
}

double Fabric::MembraneEnergy(const std::vector<Vector3d>& x) const {
  double sum = 0;
  const double k = options_.stretch_n_per_m;
  for (const Triangle& t : triangles_) {
    const Vector3d e1 = x[t.v[1]] - x[t.v[0]], e2 = x[t.v[2]] - x[t.v[0]];
    const Vector3d wu = e1 * t.a[1] + e2 * t.a[2], wv = e1 * t.b[1] + e2 * t.b[2];
    const double angle2 = std::pow(wu.dot(wv), 2);
    sum += t.area_mm2 * (k * (LawOf(wu.norm() - 1, options_).energy + LawOf(wv.norm() - 1, options_).energy) +
                         options_.shear_n_per_m * angle2 * (1 + kShearLocking * angle2) / 2);
  }
  return sum;
}

double Fabric::BendingEnergy(const std::vector<Vector3d>& x) const {
  double sum = 0;
  for (size_t v = 0; v < x.size(); ++v)
    for (int e = bending_.first[v]; e < bending_.first[v + 1]; ++e)
      sum += bend_[e] * (x[bending_.column[e]] - x[v]).dot(x[v]) / 2;
  for (const BentHinge& bent : bent_) {
    Vector3d bend = Vector3d::Zero();
    for (int i = 0; i < 4; ++i) bend += bent.hinge.weight[i] * x[bent.hinge.v[i]];
    sum += bent.hinge.stiffness * bent.rest * (bent.rest / 2 - NormalOf(bent, x).dot(bend));
  }
  return sum;
}

}  // namespace weft

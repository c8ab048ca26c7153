#include "alignment/elastic_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

// The same loops compiled for several instruction sets, chosen at load time. Lanes never mix and products are
// never fused, so every one of them gives the same bytes. Sanitizers cannot instrument the choice.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define WEFT_SIMD_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define WEFT_SIMD_CLONES
#endif
#define WEFT_INLINE inline __attribute__((always_inline))

namespace weft {
namespace {

using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

struct Lanes3 {
  Lanes x, y, z;
};
struct LanesQ {
  Lanes w, x, y, z;
};

WEFT_INLINE void Load(const float* p, Lanes& out) { std::memcpy(&out, p, sizeof(Lanes)); }
WEFT_INLINE void Store(const Lanes& v, float* p) { std::memcpy(p, &v, sizeof(Lanes)); }
WEFT_INLINE void Gather(const float* p, const int32_t* index, Lanes& out) {
  float values[kLanes];
  for (int l = 0; l < kLanes; ++l) values[l] = p[index[l]];
  std::memcpy(&out, values, sizeof(Lanes));
}
WEFT_INLINE void Load(const Field3& f, size_t at, Lanes3& out) {
  Load(f.x.data() + at, out.x), Load(f.y.data() + at, out.y), Load(f.z.data() + at, out.z);
}
WEFT_INLINE void Gather(const Field3& f, const int32_t* index, Lanes3& out) {
  Gather(f.x.data(), index, out.x), Gather(f.y.data(), index, out.y), Gather(f.z.data(), index, out.z);
}
WEFT_INLINE void Load(const FieldQ& f, size_t at, LanesQ& out) {
  Load(f.w.data() + at, out.w), Load(f.x.data() + at, out.x);
  Load(f.y.data() + at, out.y), Load(f.z.data() + at, out.z);
}
WEFT_INLINE void Gather(const FieldQ& f, const int32_t* index, LanesQ& out) {
  Gather(f.w.data(), index, out.w), Gather(f.x.data(), index, out.x);
  Gather(f.y.data(), index, out.y), Gather(f.z.data(), index, out.z);
}
// w v
WEFT_INLINE void Multiply(const FieldSym& w, size_t at, const Lanes3& v, Lanes3& out) {
  Lanes xx, xy, xz, yy, yz, zz;
  Load(w.xx.data() + at, xx), Load(w.xy.data() + at, xy), Load(w.xz.data() + at, xz);
  Load(w.yy.data() + at, yy), Load(w.yz.data() + at, yz), Load(w.zz.data() + at, zz);
  out.x = xx * v.x + xy * v.y + xz * v.z;
  out.y = xy * v.x + yy * v.y + yz * v.z;
  out.z = xz * v.x + yz * v.y + zz * v.z;
}
WEFT_INLINE void Subtract(const Lanes3& a, const Lanes3& b, Lanes3& out) {
  out.x = a.x - b.x, out.y = a.y - b.y, out.z = a.z - b.z;
}
WEFT_INLINE void Dot(const Lanes3& a, const Lanes3& b, Lanes& out) {
  out = a.x * b.x + a.y * b.y + a.z * b.z;
}

// v + 2 w (q x v) + 2 q x (q x v)
WEFT_INLINE void Rotate(const LanesQ& q, const Lanes3& v, Lanes3& out) {
  const Lanes tx = 2 * (q.y * v.z - q.z * v.y);
  const Lanes ty = 2 * (q.z * v.x - q.x * v.z);
  const Lanes tz = 2 * (q.x * v.y - q.y * v.x);
  out.x = v.x + q.w * tx + (q.y * tz - q.z * ty);
  out.y = v.y + q.w * ty + (q.z * tx - q.x * tz);
  out.z = v.z + q.w * tz + (q.x * ty - q.y * tx);
}

// q <- q * (1, omega / 2), normalised: the rotation by omega, to first order, before q.
WEFT_INLINE void Turn(const Lanes3& omega, LanesQ& q) {
  const Lanes x = 0.5f * omega.x, y = 0.5f * omega.y, z = 0.5f * omega.z;
  const LanesQ p = {q.w - q.x * x - q.y * y - q.z * z, q.x + q.w * x + q.y * z - q.z * y,
                    q.y + q.w * y + q.z * x - q.x * z, q.z + q.w * z + q.x * y - q.y * x};
  Lanes norm = p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z;
  for (int l = 0; l < kLanes; ++l) norm[l] = std::sqrt(norm[l]);
  q.w = p.w / norm, q.x = p.x / norm, q.y = p.y / norm, q.z = p.z / norm;
}

// Columns of the sum of t e^T.
struct Moment {
  Lanes3 by_ex, by_ey, by_ez;
};

// One Newton step for the rotation that maximises tr(R^T M). With S = R^T M and R <- R exp([omega]), the
// value is tr S + g . omega - omega^T (tr(S) I - S) omega / 2 to second order, g the axial vector of S. Where
// the quadratic part is not definite (far from the optimum) the step is g / |tr S| (Mueller et al. 2016).
WEFT_INLINE void NewtonStep(const Moment& m, LanesQ& q) {
  const LanesQ inverse = {q.w, -q.x, -q.y, -q.z};
  Lanes3 s0, s1, s2;  // columns of S
  Rotate(inverse, m.by_ex, s0);
  Rotate(inverse, m.by_ey, s1);
  Rotate(inverse, m.by_ez, s2);
  const Lanes3 g = {s1.z - s2.y, s2.x - s0.z, s0.y - s1.x};
  const Lanes trace = s0.x + s1.y + s2.z;
  const Lanes h00 = trace - s0.x, h11 = trace - s1.y, h22 = trace - s2.z;
  const Lanes h01 = -0.5f * (s1.x + s0.y), h02 = -0.5f * (s2.x + s0.z), h12 = -0.5f * (s2.y + s1.z);
  const Lanes c00 = h11 * h22 - h12 * h12, c01 = h02 * h12 - h01 * h22, c02 = h01 * h12 - h02 * h11;
  const Lanes c11 = h00 * h22 - h02 * h02, c12 = h01 * h02 - h00 * h12, c22 = h00 * h11 - h01 * h01;
  const Lanes determinant = h00 * c00 + h01 * c01 + h02 * c02;
  const Lanes size = trace * trace * trace;
  const auto definite = (trace > 0) & (h00 > 0) & (c22 > 0) & (determinant > 1e-3f * size);
  const Lanes scale = 1 / (definite ? determinant : size * 0 + 1);
  const Lanes damped = 1 / ((trace < 0 ? -trace : trace) + 1e-20f);
  const Lanes3 omega = {definite ? (c00 * g.x + c01 * g.y + c02 * g.z) * scale : g.x * damped,
                        definite ? (c01 * g.x + c11 * g.y + c12 * g.z) * scale : g.y * damped,
                        definite ? (c02 * g.x + c12 * g.y + c22 * g.z) * scale : g.z * damped};
  Turn(omega, q);
}

WEFT_INLINE void AddOuter(const Lanes3& t, const Lanes3& e, Moment& m) {
  m.by_ex.x += t.x * e.x, m.by_ex.y += t.y * e.x, m.by_ex.z += t.z * e.x;
  m.by_ey.x += t.x * e.y, m.by_ey.y += t.y * e.y, m.by_ey.z += t.z * e.y;
  m.by_ez.x += t.x * e.z, m.by_ez.y += t.y * e.z, m.by_ez.z += t.z * e.z;
}

// Rest edge and current edge of a slot.
WEFT_INLINE void LoadEdge(const SlicedMesh& mesh, size_t slot, const Field3& position, const Lanes3& own,
                          Lanes3& e, Lanes3& d) {
  const size_t at = slot * kLanes;
  Load(mesh.rest_x.data() + at, e.x), Load(mesh.rest_y.data() + at, e.y), Load(mesh.rest_z.data() + at, e.z);
  Lanes3 other;
  Gather(position, mesh.neighbor.data() + at, other);
  Subtract(other, own, d);
}

}  // namespace

SlicedMesh SliceMesh(const TriangleMesh& rest, const MeshGraph& graph) {
  SlicedMesh mesh;
  mesh.vertices = graph.vertices;
  mesh.slices = (graph.vertices + kLanes - 1) / kLanes;
  mesh.first_slot.assign(1, 0);
  mesh.degree.assign(static_cast<size_t>(mesh.slices) * kLanes, 0);
  for (int s = 0; s < mesh.slices; ++s) {
    const int begin = s * kLanes, end = std::min(begin + kLanes, graph.vertices);
    int slots = 0;
    for (int v = begin; v < end; ++v) slots = std::max(slots, graph.degree(v));
    for (int j = 0; j < slots; ++j) {
      for (int v = begin; v < begin + kLanes; ++v) {
        const bool exists = v < end && j < graph.degree(v);
        const int other = exists ? graph.neighbor[graph.first[v] + j] : v;
        Eigen::Vector3d e = Eigen::Vector3d::Zero();
        if (exists) e = rest.vertices_mm[other] - rest.vertices_mm[v];
        mesh.neighbor.push_back(other);
        mesh.rest_x.push_back(static_cast<float>(e.x()));
        mesh.rest_y.push_back(static_cast<float>(e.y()));
        mesh.rest_z.push_back(static_cast<float>(e.z()));
      }
    }
    for (int v = begin; v < end; ++v) mesh.degree[v] = static_cast<float>(graph.degree(v));
    mesh.first_slot.push_back(mesh.first_slot.back() + slots);
  }
  return mesh;
}

WEFT_SIMD_CLONES void FitRotations(const SlicedMesh& mesh, SliceRange range, const RotationStep& step,
                                   const Field3& position, const FieldQ& current, FieldQ* next) {
  for (int s = range.first; s < range.last; ++s) {
    const size_t at = static_cast<size_t>(s) * kLanes;
    Lanes3 own;
    LanesQ q;
    Load(position, at, own);
    Load(current, at, q);
    Moment m = {};
    for (int slot = mesh.first_slot[s]; slot < mesh.first_slot[s + 1]; ++slot) {
      Lanes3 e, d, a, b;
      LanesQ other;
      LoadEdge(mesh, slot, position, own, e, d);
      Gather(current, mesh.neighbor.data() + static_cast<size_t>(slot) * kLanes, other);
      Rotate(other, e, b);
      Rotate(q, e, a);
      const Lanes3 t = {step.along_edge * d.x + step.along_neighbor * b.x + step.along_own * a.x,
                        step.along_edge * d.y + step.along_neighbor * b.y + step.along_own * a.y,
                        step.along_edge * d.z + step.along_neighbor * b.z + step.along_own * a.z};
      AddOuter(t, e, m);
    }
    for (int i = 0; i < step.newton_steps; ++i) NewtonStep(m, q);
    Store(q.w, next->w.data() + at), Store(q.x, next->x.data() + at);
    Store(q.y, next->y.data() + at), Store(q.z, next->z.data() + at);
  }
}

WEFT_SIMD_CLONES double EnergyAndGradient(const SlicedMesh& mesh, SliceRange range, const EnergyTerms& terms,
                                          const Field3& position, const FieldQ& rotation,
                                          Field3* half_gradient) {
  double total = 0;
  for (int s = range.first; s < range.last; ++s) {
    const size_t at = static_cast<size_t>(s) * kLanes;
    Lanes3 own, target;
    LanesQ q;
    Load(position, at, own);
    Load(*terms.target, at, target);
    Load(rotation, at, q);
    Lanes3 off, g;
    Subtract(own, target, off);
    Multiply(*terms.weight, at, off, g);
    Lanes energy;  // Eq. 1, 3, 4, 5
    Dot(off, g, energy);
    for (int slot = mesh.first_slot[s]; slot < mesh.first_slot[s + 1]; ++slot) {
      Lanes3 e, d, a, b;
      LanesQ other;
      LoadEdge(mesh, slot, position, own, e, d);
      Gather(rotation, mesh.neighbor.data() + static_cast<size_t>(slot) * kLanes, other);
      Rotate(q, e, a);
      Rotate(other, e, b);
      const Lanes3 r = {d.x - 0.5f * (a.x + b.x), d.y - 0.5f * (a.y + b.y), d.z - 0.5f * (a.z + b.z)};
      const Lanes3 h = {a.x - b.x, a.y - b.y, a.z - b.z};
      Lanes r2, h2;
      Dot(r, r, r2);
      Dot(h, h, h2);
      // Eq. 2, reduced (distortion.h); each edge is met from both ends.
      energy += 0.5f * (terms.stretch * r2 + terms.bending * h2);
      g.x -= terms.stretch * r.x, g.y -= terms.stretch * r.y, g.z -= terms.stretch * r.z;
    }
    Store(g.x, half_gradient->x.data() + at), Store(g.y, half_gradient->y.data() + at);
    Store(g.z, half_gradient->z.data() + at);
    double slice_energy = 0;
    for (int l = 0; l < kLanes; ++l) slice_energy += energy[l];
    total += slice_energy;
  }
  return total;
}

}  // namespace weft

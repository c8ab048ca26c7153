// Body of the elastic kernels; see simd/lanes.h. A slice of sixteen vertices is taken in parts of kLanes.
#include "alignment/elastic_kernel.h"
#include "simd/lanes.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

struct Lanes3 {
  Lanes x, y, z;
};
struct LanesQ {
  Lanes w, x, y, z;
};

inline Lanes3 Load3(const float* const* p, size_t at) {
  return {Load(p[0] + at), Load(p[1] + at), Load(p[2] + at)};
}
inline Lanes3 LoadPositions(const float* records) {
  Lanes r[4];
  LoadRecords(records, r);
  return {r[0], r[1], r[2]};
}
inline Lanes3 GatherPositions(const float* records, const int32_t* index) {
  Lanes r[4];
  GatherRecords(records, index, r);
  return {r[0], r[1], r[2]};
}
inline LanesQ LoadRotations(const float* records) {
  Lanes r[4];
  LoadRecords(records, r);
  return {r[0], r[1], r[2], r[3]};
}
inline LanesQ GatherRotations(const float* records, const int32_t* index) {
  Lanes r[4];
  GatherRecords(records, index, r);
  return {r[0], r[1], r[2], r[3]};
}

inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Lanes3 operator*(float s, const Lanes3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Lanes Dot(const Lanes3& a, const Lanes3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// v + 2 w (q x v) + 2 q x (q x v)
inline Lanes3 Rotate(const LanesQ& q, const Lanes3& v) {
  const Lanes tx = 2.0f * (q.y * v.z - q.z * v.y);
  const Lanes ty = 2.0f * (q.z * v.x - q.x * v.z);
  const Lanes tz = 2.0f * (q.x * v.y - q.y * v.x);
  return {v.x + q.w * tx + (q.y * tz - q.z * ty), v.y + q.w * ty + (q.z * tx - q.x * tz),
          v.z + q.w * tz + (q.x * ty - q.y * tx)};
}

// A matrix by its columns.
struct LanesMatrix {
  Lanes3 column[3];
};

inline Lanes3 operator*(const LanesMatrix& m, const Lanes3& v) {
  const Lanes3* c = m.column;
  return {c[0].x * v.x + c[1].x * v.y + c[2].x * v.z, c[0].y * v.x + c[1].y * v.y + c[2].y * v.z,
          c[0].z * v.x + c[1].z * v.y + c[2].z * v.z};
}

inline LanesMatrix MatrixOf(const LanesQ& q) {
  const Lanes x2 = 2.0f * q.x, y2 = 2.0f * q.y, z2 = 2.0f * q.z;
  const Lanes xx = q.x * x2, xy = q.x * y2, xz = q.x * z2, yy = q.y * y2, yz = q.y * z2, zz = q.z * z2;
  const Lanes wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  return {{{1.0f - (yy + zz), xy + wz, xz - wy},
           {xy - wz, 1.0f - (xx + zz), yz + wx},
           {xz + wy, yz - wx, 1.0f - (xx + yy)}}};
}

// q <- q * (1, omega / 2), normalised: the rotation by omega, to first order, before q.
inline void Turn(const Lanes3& omega, LanesQ* q) {
  const Lanes x = 0.5f * omega.x, y = 0.5f * omega.y, z = 0.5f * omega.z;
  const LanesQ p = {q->w - q->x * x - q->y * y - q->z * z, q->x + q->w * x + q->y * z - q->z * y,
                    q->y + q->w * y + q->z * x - q->x * z, q->z + q->w * z + q->x * y - q->y * x};
  const Lanes scale = 1.0f / Sqrt(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
  *q = {scale * p.w, scale * p.x, scale * p.y, scale * p.z};
}

// One Newton step for the rotation that maximises tr(R^T M). With S = R^T M and R <- R exp([omega]), the
// value is tr S + g . omega - omega^T (tr(S) I - S) omega / 2 to second order, g the axial vector of S. Where
// the quadratic part is not definite (far from the optimum) the step is g / |tr S| (Mueller et al. 2016).
inline void NewtonStep(const LanesMatrix& m, LanesQ* q) {
  const LanesQ inverse = {q->w, -q->x, -q->y, -q->z};
  const Lanes3 s0 = Rotate(inverse, m.column[0]), s1 = Rotate(inverse, m.column[1]),
               s2 = Rotate(inverse, m.column[2]);  // columns of S
  const Lanes3 g = {s1.z - s2.y, s2.x - s0.z, s0.y - s1.x};
  const Lanes trace = s0.x + s1.y + s2.z;
  const Lanes h00 = trace - s0.x, h11 = trace - s1.y, h22 = trace - s2.z;
  const Lanes h01 = -0.5f * (s1.x + s0.y), h02 = -0.5f * (s2.x + s0.z), h12 = -0.5f * (s2.y + s1.z);
  const Lanes c00 = h11 * h22 - h12 * h12, c01 = h02 * h12 - h01 * h22, c02 = h01 * h12 - h02 * h11;
  const Lanes c11 = h00 * h22 - h02 * h02, c12 = h01 * h02 - h00 * h12, c22 = h00 * h11 - h01 * h01;
  const Lanes determinant = h00 * c00 + h01 * c01 + h02 * c02;
  const Lanes size = trace * trace * trace;
  const IntLanes definite = (trace > 0.0f) & (h00 > 0.0f) & (c22 > 0.0f) & (determinant > 1e-3f * size);
  const Lanes scale = 1.0f / (definite ? determinant : Lanes{} + 1.0f);
  const Lanes damped = 1.0f / ((trace < 0.0f ? -trace : trace) + 1e-20f);
  const Lanes3 omega = {definite ? (c00 * g.x + c01 * g.y + c02 * g.z) * scale : g.x * damped,
                        definite ? (c01 * g.x + c11 * g.y + c12 * g.z) * scale : g.y * damped,
                        definite ? (c02 * g.x + c12 * g.y + c22 * g.z) * scale : g.z * damped};
  Turn(omega, q);
}

// m += t e^T
inline void AddOuter(const Lanes3& t, const Lanes3& e, LanesMatrix* m) {
  m->column[0].x += t.x * e.x, m->column[0].y += t.y * e.x, m->column[0].z += t.z * e.x;
  m->column[1].x += t.x * e.y, m->column[1].y += t.y * e.y, m->column[1].z += t.z * e.y;
  m->column[2].x += t.x * e.z, m->column[2].y += t.y * e.z, m->column[2].z += t.z * e.z;
}

// m += the sum over edges of (scale R e) e^T
inline void AddOwn(const SliceTables& mesh, SliceRange slots, int first, float scale, const LanesQ& q,
                   LanesMatrix* m) {
  LanesMatrix edges = {};
  for (int slot = slots.first; slot < slots.last; ++slot) {
    const Lanes3 e = Load3(mesh.rest, static_cast<size_t>(slot) * kSliceLanes + first);
    AddOuter(e, e, &edges);
  }
  for (int k = 0; k < 3; ++k) m->column[k] = m->column[k] + scale * Rotate(q, edges.column[k]);
}

void FitRotations(const SliceTables& mesh, SliceRange range, const RotationStep& step, const float* position,
                  const float* current, float* next) {
  for (int s = range.first; s < range.last; ++s) {
    const SliceRange slots = {mesh.first_slot[s], mesh.first_slot[s + 1]};
    for (int first = 0; first < kSliceLanes; first += kLanes) {
      const size_t own_record = 4 * (static_cast<size_t>(s) * kSliceLanes + first);
      const Lanes3 own = LoadPositions(position + own_record);
      LanesQ q = LoadRotations(current + own_record);
      LanesMatrix m = {};
      for (int slot = slots.first; slot < slots.last; ++slot) {
        const size_t at = static_cast<size_t>(slot) * kSliceLanes + first;
        const Lanes3 e = Load3(mesh.rest, at);
        const Lanes3 d = GatherPositions(position, mesh.neighbor + at) - own;
        const Lanes3 b = Rotate(GatherRotations(current, mesh.neighbor + at), e);
        AddOuter(step.along_edge * d + step.along_neighbor * b, e, &m);
      }
      if (step.along_own != 0) AddOwn(mesh, slots, first, step.along_own, q, &m);
      for (int i = 0; i < step.newton_steps; ++i) NewtonStep(m, &q);
      StoreRecords(q.w, q.x, q.y, q.z, next + own_record);
    }
  }
}

// w v
inline Lanes3 Weighed(const float* const* w, size_t at, const Lanes3& v) {
  const Lanes xx = Load(w[0] + at), xy = Load(w[1] + at), xz = Load(w[2] + at);
  const Lanes yy = Load(w[3] + at), yz = Load(w[4] + at), zz = Load(w[5] + at);
  return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
}

// Energy of kLanes vertices; each edge is met from both ends and counts half.
inline Lanes PartEnergy(const SliceTables& mesh, int s, int first, const EnergyTables& terms,
                        const float* position, const float* rotation, float* const* half_gradient) {
  const size_t vertex = static_cast<size_t>(s) * kSliceLanes + first;
  const Lanes3 own = LoadPositions(position + 4 * vertex);
  const LanesMatrix turn = MatrixOf(LoadRotations(rotation + 4 * vertex));
  const Lanes3 off = own - Load3(terms.target, vertex);
  const Lanes3 pull = Weighed(terms.weight, vertex, off);
  Lanes edges = {};
  Lanes3 force = {};
  for (int slot = mesh.first_slot[s]; slot < mesh.first_slot[s + 1]; ++slot) {
    const size_t at = static_cast<size_t>(slot) * kSliceLanes + first;
    const Lanes3 e = Load3(mesh.rest, at);
    const Lanes3 d = GatherPositions(position, mesh.neighbor + at) - own;
    const Lanes3 a = turn * e, b = Rotate(GatherRotations(rotation, mesh.neighbor + at), e);
    const Lanes3 r = d - 0.5f * (a + b), h = a - b;
    edges += terms.stretch * Dot(r, r) + terms.bending * Dot(h, h);  // Eq. 2, reduced (distortion.h)
    force = force + r;
  }
  const Lanes3 g = pull - terms.stretch * force;
  Store(g.x, half_gradient[0] + vertex), Store(g.y, half_gradient[1] + vertex),
      Store(g.z, half_gradient[2] + vertex);
  return Dot(off, pull) + 0.5f * edges;  // Eq. 1, 3, 4, 5
}

double Energy(const SliceTables& mesh, SliceRange range, const EnergyTables& terms, const float* position,
              const float* rotation, float* const* half_gradient) {
  double total = 0;
  for (int s = range.first; s < range.last; ++s) {
    float energy[kSliceLanes];
    for (int first = 0; first < kSliceLanes; first += kLanes)
      Store(PartEnergy(mesh, s, first, terms, position, rotation, half_gradient), energy + first);
    double slice_energy = 0;
    for (const float e : energy) slice_energy += e;
    total += slice_energy;
  }
  return total;
}

}  // namespace

extern const ElasticKernels kElasticKernels;
const ElasticKernels kElasticKernels = {FitRotations, Energy};

}  // namespace weft::WEFT_KERNEL_NAMESPACE

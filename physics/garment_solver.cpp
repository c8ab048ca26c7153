#include "physics/garment_solver.h"

#include <algorithm>
#include <cmath>

#include "physics/parallel.h"

namespace weft {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kMaxIterations = 40;
constexpr double kTolerance = 2e-3;      // of the residual, relative to the right-hand side,
constexpr double kFineTolerance = 3e-4;  // where few large forces dominate that
constexpr double kContactNPerM = 40;     // stiffness of a contact between layers,
constexpr double kPressed = 0.1;         // of layers nearer than this, relative to their thickness, a
constexpr double kStiffest = 300;        // multiple of that, at the most this
constexpr double kBodyNPerM = 150;       // and of a vertex against the body
constexpr double kStickMmPerS = 15;      // slower than this, friction holds like a damper
constexpr double kNearThickness = 0.3;   // of neighbours in the sheet, relative
constexpr double kReachCells = 0.55;     // contacts are looked for within; neighbours at rest are farther
// A vertex that layers hold fast is let go by the body for so many steps, then is led out of it in small
// moves of so many cells for as many more.
constexpr int kYieldSteps = 8, kReturnSteps = 40;
constexpr double kReturnCells = 0.03;
// So is one whose threads are pulled to this length, over that at rest. In the data set shirt-drive-12, takes
// that do not tear reach 1.8 (every fiftieth frame of four of them).
constexpr double kTorn = 2;

// Damping that stands for Coulomb friction under a normal force, in kg/s.
double FrictionDamping(double friction, double normal_force, double slip_mm_s) {
  return friction * normal_force / std::max(slip_mm_s, kStickMmPerS);
}

// Stiffness of a contact beside its usual one, which is too weak for layers that a body presses together and
// that taut cloth then pulls at.
double PressedStiffness(double distance_mm, double pressed_mm) {
  if (distance_mm >= pressed_mm) return 0;
  return kContactNPerM * (std::min(kStiffest, std::pow(pressed_mm / distance_mm, 4)) - 1);
}

Vector3d Across(const Vector3d& v, const Vector3d& normal) { return v - normal.dot(v) * normal; }

}  // namespace

GarmentSolver::GarmentSolver(const std::vector<Face>& faces,
                             const std::vector<std::array<Eigen::Vector2d, 3>>& flat_mm,
                             std::vector<Vector3d> x_mm, double cell_mm, const JerseyOptions& options,
                             const std::vector<Crease>& creases)
    : options_(options),
      cell_mm_(cell_mm),
      thickness_mm_(options.thickness_cells * cell_mm),
      reach_mm_(kReachCells * cell_mm),
      body_gap_mm_(1 + 0.15 * cell_mm),
      fabric_(static_cast<int>(x_mm.size()), faces, flat_mm, options, creases),
      finder_(static_cast<int>(x_mm.size()), faces, reach_mm_),
      x_(std::move(x_mm)),
      v_(x_.size(), Vector3d::Zero()),
      yields_(x_.size(), 0),
      local_(x_.size()),
      inverse_(x_.size()),
      rhs_(x_.size()),
      dv_(x_.size(), Vector3f::Zero()),
      product_(x_.size()),
      is_held_(x_.size()) {
  for (size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = static_cast<int>(faces[f][k]), b = static_cast<int>(faces[f][(k + 1) % 3]);
      edges_.push_back({a, b, (flat_mm[f][k] - flat_mm[f][(k + 1) % 3]).norm()});
    }
}

void GarmentSolver::PushLayersApart(double step_s, const StepInput& input,
                                    const std::vector<ContactPair>& pairs) {
  contacts_.clear();
  is_pressed_ = false;
  const double k = kContactNPerM, pressed_mm = input.obstacle == nullptr ? 0 : kPressed * thickness_mm_;
  for (const ContactPair& p : pairs) {
    const double thickness = p.is_near ? kNearThickness * thickness_mm_ : thickness_mm_;
    Vector3d relative = Vector3d::Zero();
    for (int i = 0; i < 4; ++i) relative += static_cast<double>(p.weight[i]) * v_[p.v[i]];
    const double closing = p.normal.dot(relative) * step_s;
    const double depth = thickness - p.distance_mm, depth_after = depth - closing;
    if (depth <= 0 && depth_after <= 0) continue;
    const Matrix3d along = p.normal * p.normal.transpose();
    const Vector3d slip = Across(relative, p.normal);
    const double damping =
        p.is_near ? 0 : FrictionDamping(options_.friction, k * std::max(0.0, depth_after), slip.norm());
    const double more = PressedStiffness(p.distance_mm, pressed_mm);
    const double push = step_s * k * depth_after + step_s * more * (pressed_mm - p.distance_mm - closing);
    is_pressed_ |= more > 0;
    Contact c;
    c.v = p.v, c.weight = p.weight;
    c.stiffness = ((k + more) * step_s * step_s * along + step_s * damping * (Matrix3d::Identity() - along))
                      .cast<float>();
    c.impulse = (push * p.normal - step_s * damping * slip).cast<float>();
    contacts_.push_back(c);
  }
  touch_first_.assign(x_.size() + 1, 0);
  for (const Contact& c : contacts_)
    for (const int v : c.v) ++touch_first_[v + 1];
  for (size_t v = 0; v < x_.size(); ++v) touch_first_[v + 1] += touch_first_[v];
  touches_.resize(touch_first_.back());
  std::vector<int> used(touch_first_.begin(), touch_first_.end() - 1);
  for (size_t k_contact = 0; k_contact < contacts_.size(); ++k_contact)
    for (int i = 0; i < 4; ++i)
      touches_[used[contacts_[k_contact].v[i]]++] = {static_cast<int>(k_contact),
                                                     contacts_[k_contact].weight[i]};
  contact_sum_.resize(contacts_.size());
}

void GarmentSolver::TouchBody(double step_s, const StepInput& input) {
  if (input.obstacle == nullptr) return;
  ForEachIndex(x_.size(), [&](size_t v) {
    if (yields_[v] > kReturnSteps) return;
    const double far = body_gap_mm_ + 2 * step_s * v_[v].norm() + 1;
    const SurfaceDistance d = input.obstacle->distance(x_[v], far);
    // Distances are to the body at the end of the step; the cloth's own motion closes in on it.
    // A vertex that leaves is still held by the end of the spring, else it would be thrown to and fro.
    double before = body_gap_mm_ - d.distance_mm;
    if (yields_[v] > 0) before = std::min(before, body_gap_mm_);
    const double depth = before - step_s * d.normal.dot(v_[v]);
    if (before <= 0 && depth <= 0) return;
    const Vector3d slip = Across(v_[v] - input.obstacle->velocity_mm_s(x_[v]), d.normal);
    const Matrix3d along = d.normal * d.normal.transpose();
    const double k = kBodyNPerM * std::min(1.0, cell_mm_ * cell_mm_ / 36);
    const double damping = FrictionDamping(options_.friction, k * std::max(0.0, depth), slip.norm());
    local_[v] +=
        (k * step_s * step_s * along + step_s * damping * (Matrix3d::Identity() - along)).cast<float>();
    rhs_[v] += (step_s * k * depth * d.normal - step_s * damping * slip).cast<float>();
  });
}

// A dv = rhs with A = M (1 + h drag) + h (h + damping) K + contacts.
void GarmentSolver::BuildSystem(double step_s, const StepInput& input) {
  const size_t n = x_.size();
  fabric_.Linearize(x_);
  elastic_scale_ = static_cast<float>(step_s * (step_s + options_.damping_s));
  std::vector<Vector3f> v(n);
  ForEachIndex(n, [&](size_t i) { v[i] = v_[i].cast<float>(); });
  fabric_.Multiply(v, product_);
  const double drag = options_.air_drag_per_s + input.drag_per_s;
  ForEachIndex(n, [&](size_t i) {
    const double mass = fabric_.mass_kg()[i];
    local_[i] = static_cast<float>(mass * (1 + step_s * drag)) * Matrix3f::Identity();
    const Vector3d force = fabric_.forces()[i] + mass * (input.gravity_mm_s2 - drag * v_[i]);
    rhs_[i] = (step_s * force).cast<float>() - elastic_scale_ * product_[i];
    is_held_[i] = 0;
  });
  TouchBody(step_s, input);
  for (const Grip& g : input.grips) {
    const double k = input.grip_n_per_m;
    local_[g.vertex] += static_cast<float>(k * step_s * step_s) * Matrix3f::Identity();
    rhs_[g.vertex] += (step_s * k * (g.at_mm - x_[g.vertex] - step_s * v_[g.vertex])).cast<float>();
  }
  ForEachIndex(n, [&](size_t i) {
    Matrix3f block = local_[i] + elastic_scale_ * fabric_.Diagonal(static_cast<int>(i));
    for (int t = touch_first_[i]; t < touch_first_[i + 1]; ++t) {
      const Contact& c = contacts_[touches_[t].contact];
      block += touches_[t].weight * touches_[t].weight * c.stiffness;
      rhs_[i] += touches_[t].weight * c.impulse;
    }
    inverse_[i] = block.cast<double>().inverse().cast<float>();
  });
  for (size_t k = 0; k < input.held.size(); ++k) {
    const int i = input.held[k];
    is_held_[i] = 1;
    dv_[i] = ((input.held_at_mm[k] - x_[i]) / step_s - v_[i]).cast<float>();
  }
}

void GarmentSolver::Multiply(const std::vector<Vector3f>& p, std::vector<Vector3f>& out) {
  fabric_.Multiply(p, out);
  ForEachIndex(contacts_.size(), [&](size_t k) {
    const Contact& c = contacts_[k];
    Vector3f sum = Vector3f::Zero();
    for (int i = 0; i < 4; ++i) sum += c.weight[i] * p[c.v[i]];
    contact_sum_[k] = c.stiffness * sum;
  });
  ForEachIndex(p.size(), [&](size_t v) {
    Vector3f sum = elastic_scale_ * out[v] + local_[v] * p[v];
    for (int t = touch_first_[v]; t < touch_first_[v + 1]; ++t)
      sum += touches_[t].weight * contact_sum_[touches_[t].contact];
    out[v] = sum;
  });
}

// Preconditioned conjugate gradients from the last step's solution; held vertices keep what dv_ holds.
int GarmentSolver::Solve() {
  const size_t n = x_.size();
  std::vector<Vector3f> r(n), z(n), p(n);
  Multiply(dv_, product_);
  ForEachIndex(n, [&](size_t i) {
    r[i] = is_held_[i] ? Vector3f::Zero() : Vector3f(rhs_[i] - product_[i]);
    z[i] = inverse_[i] * r[i];
    p[i] = z[i];
  });
  const auto dot = [&](const std::vector<Vector3f>& a, const std::vector<Vector3f>& b) {
    return SumOf(n, [&](size_t i) { return static_cast<double>(a[i].dot(b[i])); });
  };
  double rz = dot(r, z);
  const double tolerance = is_pressed_ ? kFineTolerance : kTolerance;
  const double goal = tolerance * tolerance * SumOf(n, [&](size_t i) {
                        return is_held_[i] ? 0.0 : static_cast<double>(rhs_[i].dot(inverse_[i] * rhs_[i]));
                      });
  int iteration = 0;
  for (; iteration < kMaxIterations && rz > goal && rz > 0; ++iteration) {
    Multiply(p, product_);
    const double curvature =
        SumOf(n, [&](size_t i) { return is_held_[i] ? 0.0 : static_cast<double>(p[i].dot(product_[i])); });
    if (!(curvature > 0)) break;
    const float alpha = static_cast<float>(rz / curvature);
    ForEachIndex(n, [&](size_t i) {
      if (is_held_[i]) return;
      dv_[i] += alpha * p[i];
      r[i] -= alpha * product_[i];
      z[i] = inverse_[i] * r[i];
    });
    const double next = dot(r, z);
    const float beta = static_cast<float>(next / rz);
    rz = next;
    ForEachIndex(n, [&](size_t i) { p[i] = z[i] + beta * p[i]; });
  }
  return iteration;
}

void GarmentSolver::PushOutOfBody(const StepInput& input, std::vector<Vector3d>& to) const {
  if (input.obstacle == nullptr) return;
  const double least = 0.4 * body_gap_mm_;
  ForEachIndex(to.size(), [&](size_t v) {
    if (is_held_[v] || yields_[v] > kReturnSteps) return;
    const SurfaceDistance d = input.obstacle->distance(to[v], body_gap_mm_);
    double push = least - d.distance_mm;
    if (yields_[v] > 0) push = std::min(push, kReturnCells * cell_mm_);
    if (push > 0) to[v] += push * d.normal;
  });
}

StepReport GarmentSolver::Step(double step_s, const StepInput& input) {
  StepReport report;
  const std::vector<ContactPair>& pairs = finder_.Find(x_, carry_);
  PushLayersApart(step_s, input, pairs);
  BuildSystem(step_s, input);
  report.contacts = static_cast<int>(contacts_.size());
  report.iterations = Solve();
  std::vector<Vector3d> to(x_.size());
  ForEachIndex(x_.size(), [&](size_t i) { to[i] = x_[i] + step_s * (v_[i] + dv_[i].cast<double>()); });
  PushOutOfBody(input, to);
  const bool has_body = input.obstacle != nullptr;
  const KeptApart kept = KeepApart(pairs, x_, input.carry, {reach_mm_, thickness_mm_, has_body}, to);
  report.held_back = kept.held_back;
  for (uint8_t& steps : yields_) steps -= steps > 0;
  for (const int v : kept.stuck) yields_[v] = kYieldSteps + kReturnSteps;
  for (const ClothEdge& e : edges_)
    if ((to[e.a] - to[e.b]).squaredNorm() > kTorn * kTorn * e.rest_mm * e.rest_mm)
      yields_[e.a] = yields_[e.b] = kYieldSteps + kReturnSteps;
  ForEachIndex(x_.size(), [&](size_t i) {
    v_[i] = (to[i] - x_[i]) / step_s;
    x_[i] = to[i];
  });
  carry_ = input.carry;
  return report;
}

bool GarmentSolver::IsFinite() const {
  return std::all_of(x_.begin(), x_.end(), [](const Vector3d& p) { return p.allFinite(); });
}

}  // namespace weft

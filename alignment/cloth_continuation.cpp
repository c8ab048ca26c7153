#include "alignment/cloth_continuation.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "alignment/untangle/untangle_patch.h"

namespace weft {
namespace {

// At most so many edges from the template's border: hems go on as they bend, folds do not.
constexpr int kHemRings = 8;

// Standard deviation of the guess: ring^kSigmaExponent times kSigmaEdges mean edges and, in quadrature,
// kNoiseGain times that of the points, whose noise turns the cloth beyond them.
constexpr double kSigmaEdges = 0.15;
constexpr double kNoiseGain = 2;
constexpr double kSigmaExponent = 1.5;

// Of the measured vertices at most 2 * ring + kBeyondRings edges away so many must lie on one side: cloth
// between measured cloth is left to the smooth fill.
constexpr double kMinOneSided = 0.95;
constexpr int kBeyondRings = 8;

// Of a face's spread to its neighbours, what is added so that no curvature is taken from noise alone.
constexpr double kFlatShare = 0.015;

// Largest angle between neighbouring faces that still is an arc; beyond it lies a crease, which ends.
constexpr double kMostBend = 0.9;

// Cosine to the mean direction from which on a vertex lies beyond.
constexpr double kBeyond = -0.2;

// Sine of the least angle of a face that tells its rotation.
constexpr double kLeastArea = 0.05;

double NoiseMm(const VertexTarget& target, double reference_sigma_mm) {
  if (target.sigma_mm == 0) return reference_sigma_mm;
  return std::sqrt(std::max(0.0, target.sigma_mm * target.sigma_mm - target.fold_covariance_mm2.trace() / 3));
}

Eigen::Vector3d AxisTimesAngle(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d RotationBy(const Eigen::Vector3d& axis_times_angle) {
  const double angle = axis_times_angle.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, axis_times_angle / angle).toRotationMatrix();
}

// The rotation nearest to a matrix.
Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

// What is known of a face: its rotation from rest, and by how much that changes along the rest shape.
struct FaceState {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();  // axis times angle, per mm
  bool bent = false;                                    // curvature is there
};

class Continuation {
 public:
  Continuation(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
               const ContinuationOptions& options, double reference_sigma_mm)
      : model_(model),
        options_(options),
        rest_mm_(model.rest().vertices_mm),
        faces_(model.rest().faces),
        around_(model.graph().vertices, faces_),
        position_mm_(rest_mm_.size(), Eigen::Vector3d::Zero()),
        noise_mm_(rest_mm_.size(), 0),
        measured_(rest_mm_.size(), false),
        state_of_(faces_.size(), -1),
        seen_from_(rest_mm_.size(), -1) {
    for (const VertexTarget& t : targets) {
      position_mm_[t.vertex] = t.position_mm;
      noise_mm_[t.vertex] = NoiseMm(t, reference_sigma_mm);
      measured_[t.vertex] = true;
    }
    ring_ = RingDistance(model.graph(), measured_);
    hem_ring_ = RingDistance(model.graph(), AtBorder());
    std::vector<bool> is_gap = measured_;
    is_gap.flip();
    gap_ring_ = RingDistance(model.graph(), is_gap);
  }

  std::vector<ContinuedVertex> Run() {
    std::vector<ContinuedVertex> out;
    FindRotations();
    for (int ring = 1; ring <= options_.rings; ++ring) {
      std::vector<int> vertices;
      for (int v = 0; v < model_.graph().vertices; ++v)
        if (ring_[v] == ring && Matters(v)) vertices.push_back(v);
      CarryOn(vertices, ring);
      for (const int v : vertices)
        if (const int placed = Place(v, ring); placed > 0 && IsNearHem(v) && IsOpen(v, ring))
          out.push_back({v, position_mm_[v], SigmaMm(v, ring)});
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.vertex < b.vertex; });
    return out;
  }

 private:
  // Vertices with fewer faces than edges.
  std::vector<bool> AtBorder() const {
    std::vector<bool> at_border(rest_mm_.size());
    for (int v = 0; v < model_.graph().vertices; ++v)
      at_border[v] = static_cast<int>(around_.of(v).size()) < model_.graph().degree(v);
    return at_border;
  }
  bool IsNearHem(int v) const { return hem_ring_[v] >= 0 && hem_ring_[v] <= kHemRings; }
  // Whether some vertex near a hem may depend on this one: a place depends on faces around it, they on those
  // beside them of the ring before, and curvatures on those beside them.
  bool Matters(int v) const {
    return hem_ring_[v] >= 0 && hem_ring_[v] <= kHemRings + 2 * options_.rings + 4;
  }

  Eigen::Vector3d CenterOf(int face) const {
    const Face& f = faces_[face];
    return (rest_mm_[f[0]] + rest_mm_[f[1]] + rest_mm_[f[2]]) / 3;
  }
  // What the cloth may do, and what noise turns it by.
  double SigmaMm(int v, int ring) const {
    return std::pow(ring, kSigmaExponent) *
           std::hypot(kSigmaEdges * model_.mean_edge_mm(), kNoiseGain * noise_mm_[v]);
  }
  // Of its three vertices.
  int OuterRing(int face) const {
    int outer = 0;
    for (const int v : faces_[face]) outer = ring_[v] < 0 ? options_.rings + 1 : std::max(outer, ring_[v]);
    return outer;
  }

  bool IsKnown(int face) const { return state_of_[face] >= 0; }
  FaceState& StateOf(int face) { return states_[state_of_[face]]; }
  void SetState(int face, const FaceState& state) {
    state_of_[face] = static_cast<int>(states_.size());
    states_.push_back(state);
  }

  // Of the faces that have three targets.
  void FindRotations() {
    for (size_t f = 0; f < faces_.size(); ++f) {
      const Face& face = faces_[f];
      if (!measured_[face[0]] || !measured_[face[1]] || !measured_[face[2]]) continue;
      if (!Matters(face[0]) || !IsNearGap(face)) continue;
      const Eigen::Vector3d u = rest_mm_[face[1]] - rest_mm_[face[0]],
                            v = rest_mm_[face[2]] - rest_mm_[face[0]];
      const Eigen::Vector3d a = position_mm_[face[1]] - position_mm_[face[0]],
                            b = position_mm_[face[2]] - position_mm_[face[0]];
      Eigen::Matrix3d from, to;
      from << u, v, u.cross(v).normalized();
      to << a, b, a.cross(b).normalized();
      if (!(from.determinant() > kLeastArea * u.norm() * v.norm())) continue;
      if (!(to.determinant() > kLeastArea * a.norm() * b.norm())) continue;
      SetState(static_cast<int>(f), {.rotation = NearestRotation(to * from.inverse())});
    }
  }
  // Only faces within two rings of what is to be found are asked.
  bool IsNearGap(const Face& face) const {
    return std::any_of(face.begin(), face.end(),
                       [this](int v) { return gap_ring_[v] >= 0 && gap_ring_[v] <= 2; });
  }

  template <typename Function>
  void ForFacesBeside(int face, const Function& function) const {
    for (const int v : faces_[face])
      for (const int other : around_.of(v))
        if (other != face) function(other);
  }

  // Least squares of the rotations around, drawn a little to no curvature.
  void FindCurvature(int face) {
    FaceState& own = StateOf(face);
    own.bent = true;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(), moment = spread;
    const Eigen::Vector3d center = CenterOf(face);
    int count = 0;
    ForFacesBeside(face, [&](int other) {
      if (!IsKnown(other) || OuterRing(other) > 0) return;
      const Eigen::Vector3d way = CenterOf(other) - center;
      spread += way * way.transpose();
      moment += AxisTimesAngle(own.rotation.transpose() * StateOf(other).rotation) * way.transpose();
      ++count;
    });
    if (count < 3) return;
    spread.diagonal().array() += kFlatShare / 2 * spread.trace() + 1e-12;
    own.curvature = moment * spread.inverse();
    const double bend = own.curvature.norm() * model_.mean_edge_mm();
    if (bend > kMostBend) own.curvature *= kMostBend / bend;
  }

  // Rotations and curvatures of the faces that reach up to this ring.
  void CarryOn(const std::vector<int>& vertices, int ring) {
    std::vector<int> reached;
    for (const int v : vertices)
      for (const int f : around_.of(v))
        if (!IsKnown(f) && OuterRing(f) <= ring) reached.push_back(f);
    std::sort(reached.begin(), reached.end());
    reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
    std::vector<FaceState> carried(reached.size());
    std::vector<bool> found(reached.size());
    for (size_t i = 0; i < reached.size(); ++i) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      int count = 0;
      ForFacesBeside(reached[i], [&](int other) {
        if (!IsKnown(other)) return;
        const FaceState& from = StateOf(other);
        if (!from.bent) FindCurvature(other);
        sum += from.rotation * RotationBy(from.curvature * (CenterOf(reached[i]) - CenterOf(other)));
        carried[i].curvature += from.curvature;
        ++count;
      });
      if (count == 0) continue;
      carried[i].rotation = NearestRotation(sum);
      carried[i].curvature /= count;
      found[i] = carried[i].bent = true;
    }
    for (size_t i = 0; i < reached.size(); ++i)
      if (found[i]) SetState(reached[i], carried[i]);
  }

  // Mean of where the edges of the faces around have the vertex; returns their number.
  int Place(int v, int ring) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double noise_mm = 0;
    int count = 0;
    for (const int f : around_.of(v)) {
      if (!IsKnown(f)) continue;
      for (const int other : faces_[f]) {
        if (ring_[other] < 0 || ring_[other] >= ring) continue;
        sum += position_mm_[other] + StateOf(f).rotation * (rest_mm_[v] - rest_mm_[other]);
        noise_mm += noise_mm_[other];
        ++count;
      }
    }
    if (count > 0) noise_mm_[v] = noise_mm / count;
    position_mm_[v] = count > 0 ? Eigen::Vector3d(sum / count) : NearestPlaced(v, ring);
    return count;
  }
  Eigen::Vector3d NearestPlaced(int v, int ring) const {
    const MeshGraph& graph = model_.graph();
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i)
      if (ring_[graph.neighbor[i]] == ring - 1) return position_mm_[graph.neighbor[i]];
    return position_mm_[v];
  }

  // Whether measured cloth nearby lies on one side only: on that of the mean direction to it.
  bool IsOpen(int v, int ring) {
    std::vector<Eigen::Vector3d> directions;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int other : Nearby(v, 2 * ring + kBeyondRings)) {
      if (!measured_[other]) continue;
      directions.push_back((rest_mm_[other] - rest_mm_[v]).normalized());
      sum += directions.back();
    }
    const Eigen::Vector3d side = sum.normalized();
    const auto on_side = std::count_if(directions.begin(), directions.end(),
                                       [&](const Eigen::Vector3d& d) { return d.dot(side) > kBeyond; });
    return !directions.empty() &&
           static_cast<double>(on_side) >= kMinOneSided * static_cast<double>(directions.size());
  }

  // Vertices at most so many edges away.
  std::vector<int> Nearby(int v, int edges) {
    const MeshGraph& graph = model_.graph();
    std::vector<int> reached = {v};
    seen_from_[v] = v;
    for (size_t first = 0; edges > 0; --edges) {
      for (const size_t last = reached.size(); first < last; ++first) {
        const int from = reached[first];
        for (int i = graph.first[from]; i < graph.first[from + 1]; ++i) {
          if (std::exchange(seen_from_[graph.neighbor[i]], v) != v) reached.push_back(graph.neighbor[i]);
        }
      }
    }
    return reached;
  }

  const AlignmentModel& model_;
  const ContinuationOptions& options_;
  const std::vector<Eigen::Vector3d>& rest_mm_;
  const std::vector<Face>& faces_;
  const FacesOfVertex around_;
  std::vector<Eigen::Vector3d> position_mm_;
  std::vector<double> noise_mm_;
  std::vector<bool> measured_;
  // Edges to the nearest target, to the template's border and to the nearest vertex without a target.
  std::vector<int> ring_, hem_ring_, gap_ring_;
  // Few faces matter: where the state of a face stands, -1 where it is not known.
  std::vector<int> state_of_;
  std::vector<FaceState> states_;
  std::vector<int> seen_from_;  // the last vertex whose neighbourhood a vertex was in
};

}  // namespace

std::vector<ContinuedVertex> ContinueCloth(const AlignmentModel& model,
                                           const std::vector<VertexTarget>& targets,
                                           const ContinuationOptions& options, double reference_sigma_mm) {
  if (options.rings == 0) return {};
  return Continuation(model, targets, options, reference_sigma_mm).Run();
}

}  // namespace weft

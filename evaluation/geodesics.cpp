#include "evaluation/geodesics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
// Angles this close to a full (border: half) turn count as flat.
constexpr double kFlatAngle = 1e-8;
// Relative to the edge: what windows may miss a corner by, and how narrow a window may be.
constexpr double kTouch = 1e-9;
constexpr double kNarrow = 1e-10;
// By less than this, relative to the edge, no path counts as shorter: regular meshes are full of ties, and of
// two equal paths one must stay.
constexpr double kTie = 1e-9;

// Positive when `b` points to the left of `a`.
double Turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

absl::Status CheckMesh(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces) {
  const int count = static_cast<int>(vertices_mm.size());
  for (int v = 0; v < count; ++v)
    if (!vertices_mm[v].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " is not finite"));
  for (size_t f = 0; f < faces.size(); ++f)
    for (const int v : faces[f])
      if (v < 0 || v >= count)
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, " names vertex ", v, " of a mesh with ", count, " vertices"));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<GeodesicMesh> GeodesicMesh::Build(const std::vector<Eigen::Vector3d>& vertices_mm,
                                                 const std::vector<Face>& faces) {
  WEFT_RETURN_IF_ERROR(CheckMesh(vertices_mm, faces));
  GeodesicMesh mesh;
  const size_t vertices = vertices_mm.size();
  mesh.halfedges_.resize(3 * faces.size());
  mesh.first_.assign(vertices + 1, 0);
  std::vector<double> angle(vertices, 0);
  std::vector<std::pair<std::pair<int, int>, int>> by_edge;
  for (size_t h = 0; h < mesh.halfedges_.size(); ++h) {
    const Face& face = faces[h / 3];
    HalfEdge& edge = mesh.halfedges_[h];
    edge.from = face[h % 3], edge.to = face[(h + 1) % 3], edge.opposite = face[(h + 2) % 3];
    const Eigen::Vector3d along = vertices_mm[edge.to] - vertices_mm[edge.from];
    const Eigen::Vector3d across = vertices_mm[edge.opposite] - vertices_mm[edge.from];
    edge.length_mm = along.norm();
    const double twice_area = along.cross(across).norm();
    if (edge.length_mm > 0) {
      edge.opposite_x = along.dot(across) / edge.length_mm;
      edge.opposite_y = twice_area / edge.length_mm;
    }
    angle[edge.from] += std::atan2(twice_area, along.dot(across));
    ++mesh.first_[edge.opposite + 1];
    by_edge.push_back({std::minmax(edge.from, edge.to), static_cast<int>(h)});
  }
  for (size_t v = 0; v < vertices; ++v) mesh.first_[v + 1] += mesh.first_[v];
  mesh.outgoing_.resize(mesh.halfedges_.size());
  std::vector<int> next(mesh.first_.begin(), mesh.first_.end() - 1);
  for (size_t h = 0; h < mesh.halfedges_.size(); ++h)
    mesh.outgoing_[next[mesh.halfedges_[h].opposite]++] = static_cast<int>(h);

  std::sort(by_edge.begin(), by_edge.end());
  std::vector<bool> at_border(vertices, false);
  for (size_t i = 0; i < by_edge.size();) {
    size_t end = i + 1;
    while (end < by_edge.size() && by_edge[end].first == by_edge[i].first) ++end;
    const auto [a, b] = by_edge[i].first;
    if (end - i > 2)
      return absl::InvalidArgumentError(
          absl::StrCat("the edge of vertices ", a, " and ", b, " has more than two faces"));
    if (end - i == 2) {
      mesh.halfedges_[by_edge[i].second].twin = by_edge[i + 1].second;
      mesh.halfedges_[by_edge[i + 1].second].twin = by_edge[i].second;
    } else {
      at_border[a] = at_border[b] = true;
    }
    i = end;
  }
  mesh.branches_.resize(vertices);
  for (size_t v = 0; v < vertices; ++v) {
    const double flat = at_border[v] ? std::numbers::pi - 2 * kFlatAngle : 2 * std::numbers::pi;
    mesh.branches_[v] = angle[v] > flat + kFlatAngle;
  }
  return mesh;
}

// One search. A window is an interval of an edge whose points see the source (or the last vertex where the
// path bent) straight through the crossed faces. It is unfolded into the plane of the face ahead.
class WindowPropagation {
 public:
  WindowPropagation(const GeodesicMesh& mesh, int source)
      : mesh_(mesh),
        distance_(mesh.branches_.size(), kFar),
        nearest_at_corner_(mesh.halfedges_.size(), {kFar, 0}) {
    distance_[source] = 0;
    StartFrom(source);
  }

  std::vector<double> Run() {
    while (!queue_.empty()) {
      const Event event = queue_.top();
      queue_.pop();
      if (event.window < 0) {
        const int vertex = -1 - event.window;
        if (event.key_mm <= distance_[vertex]) StartFrom(vertex);  // else a shorter path came later
      } else {
        const Window window = windows_[event.window];
        free_.push_back(event.window);
        if (!IsBeaten(window)) Cross(window);
      }
    }
    return std::move(distance_);
  }

 private:
  using Point = Eigen::Vector2d;

  struct Window {
    int edge = -1;              // halfedge of the face ahead
    double begin = 0, end = 0;  // mm from its `from`
    Point source{0, 0};         // y <= 0
    double before_mm = 0;       // path length up to `source`
    double At(double x) const { return before_mm + (Point(x, 0) - source).norm(); }
  };
  struct Event {
    double key_mm;
    int window;  // or -1 - vertex
    bool operator<(const Event& other) const {
      return key_mm != other.key_mm ? key_mm > other.key_mm : window > other.window;
    }
  };
  struct Occupant {
    double distance_mm;
    double entry;  // where its ray to the corner crosses the edge
  };

  // Straight paths in all directions; backward ones are beaten at once.
  void StartFrom(int vertex) {
    const double before_mm = distance_[vertex];
    for (int i = mesh_.first_[vertex]; i < mesh_.first_[vertex + 1]; ++i) {
      const auto& edge = mesh_.halfedges_[mesh_.outgoing_[i]];
      const Point apex(edge.opposite_x, edge.opposite_y);
      Reach(edge.from, before_mm + apex.norm());
      Reach(edge.to, before_mm + (apex - Point(edge.length_mm, 0)).norm());
      if (edge.twin < 0) continue;
      const auto& ahead = mesh_.halfedges_[edge.twin];
      const bool reversed = ahead.from != edge.from;
      const double x = reversed ? edge.length_mm - edge.opposite_x : edge.opposite_x;
      Add({edge.twin, 0, edge.length_mm, Point(x, -edge.opposite_y), before_mm});
    }
  }

  void Reach(int vertex, double distance_mm) {
    if (distance_mm >= distance_[vertex]) return;
    distance_[vertex] = distance_mm;
    if (mesh_.branches_[vertex]) queue_.push({distance_mm, -1 - vertex});
  }

  // A path by way of an end of the edge is shorter for every point of the window (Xin and Wang 2009,
  // Theorem 3.2).
  bool IsBeaten(const Window& w) const {
    const auto& edge = mesh_.halfedges_[w.edge];
    const double slack_mm = kTie * edge.length_mm;
    return w.At(w.end) > distance_[edge.from] + w.end + slack_mm ||
           w.At(w.begin) > distance_[edge.to] + edge.length_mm - w.begin + slack_mm;
  }

  void Add(const Window& w) {
    const auto& edge = mesh_.halfedges_[w.edge];
    if (!(w.end - w.begin > kNarrow * edge.length_mm) || IsBeaten(w)) return;
    const double x = std::clamp(w.source.x(), w.begin, w.end);
    int slot = static_cast<int>(windows_.size());
    if (free_.empty()) {
      windows_.push_back(w);
    } else {
      slot = free_.back();
      free_.pop_back();
      windows_[slot] = w;
    }
    queue_.push({w.At(x), slot});
  }

  // Through the face ahead, to its other two edges.
  void Cross(const Window& w) {
    const auto& edge = mesh_.halfedges_[w.edge];
    const Point apex(edge.opposite_x, edge.opposite_y), source = w.source;
    const Point to_begin = Point(w.begin, 0) - source, to_end = Point(w.end, 0) - source,
                to_apex = apex - source;
    const double touch = kTouch * edge.length_mm;
    const bool left_of_begin = Turn(to_begin, to_apex) > touch * to_begin.norm();
    const bool right_of_end = Turn(to_end, to_apex) < -touch * to_end.norm();
    if (left_of_begin) return CrossTo(w, true, w.begin, w.end, false);
    if (right_of_end) return CrossTo(w, false, w.begin, w.end, false);

    const double distance_mm = w.before_mm + to_apex.norm();
    Reach(edge.opposite, distance_mm);
    const double fall = to_apex.y() > 0 ? -source.y() / to_apex.y() : 0;
    const double entry = source.x() + fall * to_apex.x();
    // Of all windows that see a corner through one edge, only the nearest needs both its parts behind it.
    // The others need the one on their side of its ray (Chen and Han 1990, "one angle, one split").
    Occupant& occupant = nearest_at_corner_[w.edge];
    const double tie = kTie * edge.length_mm;
    const bool splits = distance_mm <= occupant.distance_mm + tie;
    const bool keep_left = splits || entry <= occupant.entry + tie;
    const bool keep_right = splits || entry >= occupant.entry - tie;
    if (distance_mm < occupant.distance_mm) occupant = {distance_mm, entry};
    if (keep_left) CrossTo(w, false, w.begin, std::clamp(entry, w.begin, w.end), true);
    if (keep_right) CrossTo(w, true, std::clamp(entry, w.begin, w.end), w.end, true);
  }

  // Part [begin, end] of the window to the edge left or right of the apex.
  void CrossTo(const Window& w, bool to_right, double begin, double end, bool touches_apex) {
    const int face = w.edge / 3, corner = w.edge % 3;
    const int side = 3 * face + (to_right ? (corner + 1) % 3 : (corner + 2) % 3);
    const auto& edge = mesh_.halfedges_[w.edge];
    const auto& exit = mesh_.halfedges_[side];
    if (exit.twin < 0) return;
    const auto& ahead = mesh_.halfedges_[exit.twin];
    const Point apex(edge.opposite_x, edge.opposite_y);
    // Corners of the exit edge, in the order of the halfedge ahead.
    const Point foot = to_right ? Point(edge.length_mm, 0) : Point(0, 0);
    const bool foot_first = ahead.from == (to_right ? edge.to : edge.from);
    const Point a = foot_first ? foot : apex, b = foot_first ? apex : foot;
    const Point axis = (b - a) / exit.length_mm;

    const auto along = [&](double x) {  // where the ray through (x, 0) meets the exit edge
      const Point ray = Point(x, 0) - w.source;
      const double turn = Turn(ray, axis);
      if (turn == 0) return 0.0;
      return std::clamp(Turn(ray, w.source - a) / turn, 0.0, exit.length_mm);
    };
    const double at_apex = foot_first ? exit.length_mm : 0;
    const double left = to_right && touches_apex ? at_apex : along(begin);
    const double right = !to_right && touches_apex ? at_apex : along(end);
    Window out;
    out.edge = exit.twin;
    out.begin = std::min(left, right), out.end = std::max(left, right);
    const Point from_a = w.source - a;
    out.source = Point(from_a.dot(axis), -std::abs(Turn(axis, from_a)));
    out.before_mm = w.before_mm;
    // A path by way of the corner that the window leaves aside may be shorter.
    const int beside = to_right ? edge.from : edge.to;
    const double far_end = to_right ? right : left;
    const Point corner_beside = to_right ? Point(0, 0) : Point(edge.length_mm, 0);
    const double via_mm = distance_[beside] + (a + far_end * axis - corner_beside).norm();
    if (out.At(far_end) > via_mm + kTie * edge.length_mm) return;
    Add(out);
  }

  const GeodesicMesh& mesh_;
  std::vector<double> distance_;
  std::vector<Occupant> nearest_at_corner_;  // [halfedges]
  std::vector<Window> windows_;
  std::vector<int> free_;
  std::priority_queue<Event> queue_;
};

std::vector<double> GeodesicMesh::DistancesFrom(int source) const {
  return WindowPropagation(*this, source).Run();
}

}  // namespace weft

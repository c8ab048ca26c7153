#include "alignment/mesh_texture.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

using Gradient = Eigen::Matrix<double, 2, 3>;  // of the place on the print, along the surface at rest

constexpr double kLongestOnPrint = 3;  // of an edge within a panel, against its length at rest
constexpr double kFurthestStep = 2;    // beyond a panel, in edges of the print

// Distinct neighbours of every vertex, in the order of their numbers.
std::vector<std::vector<int>> Neighbors(const TriangleMesh& mesh) {
  std::vector<std::vector<int>> neighbors(mesh.vertices_mm.size());
  for (const Face& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      neighbors[face[k]].push_back(face[(k + 1) % 3]);
      neighbors[face[k]].push_back(face[(k + 2) % 3]);
    }
  }
  for (std::vector<int>& list : neighbors) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbors;
}

class Spreading {
 public:
  Spreading(const Template& garment, const std::vector<Eigen::Vector2d>& places, const Eigen::Vector2d& size)
      : mesh_(garment.rest), size_(size), neighbors_(Neighbors(mesh_)), place_(places) {
    for (const VertexNode& node : garment.node_of_vertex) on_print_.push_back(node.row >= 0);
    placed_ = on_print_;
    Measure();
    FindGradients();
    PlaceOthers();
  }

  MeshTexture Result() const {
    MeshTexture texture;
    for (const Eigen::Vector2d& place : place_) texture.of_vertex.push_back(Scaled(place));
    bool differ = false;
    texture.of_corner.reserve(mesh_.faces.size());
    for (const Face& face : mesh_.faces) {
      std::array<Eigen::Vector2f, 3> corners;
      const int anchor = AnchorOf(face);
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector2f& own = texture.of_vertex[face[k]];
        corners[k] = Agree(anchor, face[k]) ? own : Scaled(Continued(anchor, face[k]));
        differ |= corners[k] != own;
      }
      texture.of_corner.push_back(corners);
    }
    if (!differ) texture.of_corner.clear();
    return texture;
  }

 private:
  double RestLength(int a, int b) const { return (mesh_.vertices_mm[b] - mesh_.vertices_mm[a]).norm(); }
  double PrintLength(int a, int b) const { return (place_[b] - place_[a]).norm(); }
  Eigen::Vector2f Scaled(const Eigen::Vector2d& place) const {
    return place.cwiseQuotient(size_).cwiseMax(0).cwiseMin(1).cast<float>();
  }
  // Whether two vertices are about as far apart on the print as at rest: no seam between them.
  bool Agree(int a, int b) const { return a == b || PrintLength(a, b) <= longest_ * RestLength(a, b); }

  // The scale of the print against the mesh at rest.
  void Measure() {
    std::vector<double> scales, lengths;
    for (const Face& face : mesh_.faces) {
      for (int k = 0; k < 3; ++k) {
        const int a = face[k], b = face[(k + 1) % 3];
        if (!on_print_[a] || !on_print_[b] || !(RestLength(a, b) > 0)) continue;
        scales.push_back(PrintLength(a, b) / RestLength(a, b));
        lengths.push_back(PrintLength(a, b));
      }
    }
    if (scales.empty()) return;
    longest_ = kLongestOnPrint * Median(std::move(scales));
    furthest_ = kFurthestStep * Median(std::move(lengths));
  }

  // Of vertices on the print, least squares over the edges to those around them; nothing of it off the
  // surface.
  void FindGradients() {
    gradient_.assign(place_.size(), Gradient::Zero());
    for (size_t i = 0; i < place_.size(); ++i) {
      const int v = static_cast<int>(i);
      if (!on_print_[v]) continue;
      Eigen::Matrix3d rest = Eigen::Matrix3d::Zero();
      Gradient both = Gradient::Zero();
      for (const int n : neighbors_[v]) {
        if (!on_print_[n] || !Agree(v, n)) continue;
        const Eigen::Vector3d edge = mesh_.vertices_mm[n] - mesh_.vertices_mm[v];
        rest += edge * edge.transpose();
        both += (place_[n] - place_[v]) * edge.transpose();
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(rest);
      for (int axis = 1; axis < 3; ++axis) {  // the smallest is the normal's
        const double value = solver.eigenvalues()[axis];
        if (!(value > 1e-6 * solver.eigenvalues()[2])) continue;
        const Eigen::Vector3d direction = solver.eigenvectors().col(axis);
        gradient_[v] += both * direction * direction.transpose() / value;
      }
    }
  }

  // Where `v` would be if there were no seam between it and `anchor`: the panel is continued from those of
  // the neighbours of `v` that lie on the anchor's side.
  Eigen::Vector2d Continued(int anchor, int v) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (const int n : neighbors_[v]) {
      if (!placed_[n] || !Agree(anchor, n)) continue;
      Eigen::Vector2d step = gradient_[n] * (mesh_.vertices_mm[v] - mesh_.vertices_mm[n]);
      if (step.norm() > furthest_) step *= furthest_ / step.norm();
      sum += place_[n] + step;
      ++count;
    }
    return count > 0 ? Eigen::Vector2d(sum / count) : place_[anchor];
  }

  // Vertices that are nothing of the board: ring by ring, each on the side that most of its neighbours are
  // on.
  void PlaceOthers() {
    for (size_t v = 0; v < placed_.size(); ++v) {
      if (!placed_[v]) place_[v] = Eigen::Vector2d::Zero();
    }
    for (;;) {
      std::vector<std::pair<int, int>> ring;  // vertex, anchor
      for (size_t i = 0; i < placed_.size(); ++i) {
        const int v = static_cast<int>(i), anchor = placed_[v] ? -1 : BestNeighbor(v);
        if (anchor >= 0) ring.emplace_back(v, anchor);
      }
      if (ring.empty()) return;
      for (const auto& [v, anchor] : ring) {
        place_[v] = Continued(anchor, v);
        gradient_[v] = gradient_[anchor];
      }
      for (const auto& [v, anchor] : ring) placed_[v] = true;
    }
  }

  // The placed neighbour that most of them agree with, the first among equals; -1 where none is placed.
  int BestNeighbor(int v) const {
    int best = -1;
    long most = 0;
    for (const int n : neighbors_[v]) {
      if (!placed_[n]) continue;
      const auto agrees = [&](int other) { return placed_[other] && Agree(n, other); };
      const long count = std::count_if(neighbors_[v].begin(), neighbors_[v].end(), agrees);
      if (count > most) most = count, best = n;
    }
    return best;
  }

  // The corner whose side of the seam the face takes: that of most of its cells, the first among equals.
  int AnchorOf(const Face& face) const {
    int anchor = face[0], most = -1;
    for (const int v : face) {
      int weight = 0;
      for (const int w : face) weight += Agree(v, w) ? (on_print_[w] ? 4 : 1) : 0;
      if (weight > most) most = weight, anchor = v;
    }
    return anchor;
  }

  const TriangleMesh& mesh_;
  const Eigen::Vector2d size_;
  const std::vector<std::vector<int>> neighbors_;
  std::vector<bool> on_print_, placed_;  // [vertices]
  std::vector<Eigen::Vector2d> place_;   // [vertices], on one of the sides of seams
  std::vector<Gradient> gradient_;       // [vertices]
  double longest_ = std::numeric_limits<double>::infinity();
  double furthest_ = 0;
};

}  // namespace

MeshTexture SpreadTexture(const Template& garment, const std::vector<Eigen::Vector2d>& places,
                          const Eigen::Vector2d& size) {
  if (places.empty()) return {};
  return Spreading(garment, places, size).Result();
}

MeshTexture BoardTexture(const Template& garment, int rows, int cols) {
  std::vector<Eigen::Vector2d> places;
  for (const VertexNode& node : garment.node_of_vertex) {
    const Eigen::Vector2d place = node.PlaceInCells();
    places.emplace_back(place.x(), rows - place.y());
  }
  return SpreadTexture(garment, places, {cols, rows});
}

MeshTexture TextureOf(const Template& garment, const GarmentParts& parts) {
  if (!parts.texture_mm.empty())
    return SpreadTexture(garment, parts.texture_mm, Eigen::Vector2d::Constant(parts.texture_side_mm));
  if (parts.board_rows <= 0 || parts.board_cols <= 0) return {};
  return BoardTexture(garment, parts.board_rows, parts.board_cols);
}

}  // namespace weft

#include "animation/atlas/cloth_charts.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "base/median.h"

namespace weft {
namespace {

// Cells along a chart. More are no cloth: a face that is far longer in the texture than at rest.
constexpr double kLongestChartCells = 4096;
// Cells on the board between neighbours, along the axis along which they are further apart.
constexpr double kNeighborCells = 1.01;
// Of a face in the texture, its area against the square of its longest side: less has no direction.
constexpr double kLeastFaceShare = 1e-6;

class Groups {
 public:
  explicit Groups(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  int RootOf(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int i, int k) {
    const int a = RootOf(i), b = RootOf(k);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

// Joins faces across the edges at which the texture goes on, and counts those at which it does not.
void JoinFaces(const GarmentMesh& garment, Groups& groups, ClothCharts& out) {
  const std::vector<Face>& faces = garment.rest.faces;
  std::map<std::pair<int, int>, std::pair<size_t, size_t>>
      first;  // edge: face, its corner at the lower vertex
  for (size_t f = 0; f < faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const size_t next = (k + 1) % 3;
      const int a = faces[f][k], b = faces[f][next];
      const size_t low = a < b ? k : next, high = a < b ? next : k;
      const auto [found, is_new] = first.try_emplace(std::minmax(a, b), f, low);
      if (is_new) continue;
      const auto [other, other_low] = found->second;
      const size_t other_high =
          faces[other][(other_low + 1) % 3] == std::max(a, b) ? (other_low + 1) % 3 : (other_low + 2) % 3;
      const MeshTexture& texture = garment.texture;
      if (texture.At(faces, f, low) == texture.At(faces, other, other_low) &&
          texture.At(faces, f, high) == texture.At(faces, other, other_high)) {
        groups.Join(static_cast<int>(f), static_cast<int>(other));
      } else {
        ++out.seam_edges;
        out.seam_mm += (garment.rest.vertices_mm[a] - garment.rest.vertices_mm[b]).norm();
      }
    }
  }
}

void NumberFaces(Groups& groups, ClothCharts& out) {
  std::vector<int> number(out.of_face.size(), -1);
  for (size_t f = 0; f < out.of_face.size(); ++f) {
    int& n = number[groups.RootOf(static_cast<int>(f))];
    if (n < 0) n = out.charts++;
    out.of_face[f] = n;
  }
}

// How far the cloth of each chart reaches along u and along v, in mm for the whole texture: medians over its
// faces. 0 where none has an area in it.
std::vector<Eigen::Vector2d> ScalesOf(const GarmentMesh& garment, const ClothCharts& charts) {
  std::vector<std::array<std::vector<double>, 2>> lengths(charts.charts);
  for (size_t f = 0; f < charts.of_face.size(); ++f) {
    const Face& face = garment.rest.faces[f];
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Matrix2d in_texture;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = garment.rest.vertices_mm[face[k + 1]] - garment.rest.vertices_mm[face[0]];
      const Eigen::Vector2f way = garment.texture.At(garment.rest.faces, f, static_cast<size_t>(k) + 1) -
                                  garment.texture.At(garment.rest.faces, f, 0);
      in_texture.col(k) = way.cast<double>();
    }
    const double longest = in_texture.colwise().squaredNorm().maxCoeff();
    if (!(std::abs(in_texture.determinant()) > kLeastFaceShare * longest)) continue;
    const Eigen::Matrix<double, 3, 2> per_texture = edges * in_texture.inverse();
    for (int axis = 0; axis < 2; ++axis)
      lengths[charts.of_face[f]][axis].push_back(per_texture.col(axis).norm());
  }
  std::vector<Eigen::Vector2d> out;
  for (auto& [along_u, along_v] : lengths)
    out.emplace_back(Median(std::move(along_u)), Median(std::move(along_v)));
  return out;
}

absl::Status PlaceCorners(const GarmentMesh& garment, ClothCharts& out) {
  const std::vector<Eigen::Vector2d> scale_mm = ScalesOf(garment, out);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Vector2d> low(out.charts, {kFar, kFar}), high(out.charts, {-kFar, -kFar});
  out.corner_cells.resize(out.of_face.size());
  for (size_t f = 0; f < out.of_face.size(); ++f) {
    const int chart = out.of_face[f];
    if (!(scale_mm[chart].minCoeff() > 0) || !scale_mm[chart].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("face ", f,
                                                     ": its chart has no area in the texture; unwrap the "
                                                     "mesh again"));
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d uv = garment.texture.At(garment.rest.faces, f, k).cast<double>();
      // Rows go down.
      const Eigen::Vector2d cells =
          Eigen::Vector2d(uv.x(), -uv.y()).cwiseProduct(scale_mm[chart]) / out.cell_mm;
      out.corner_cells[f][k] = cells;
      low[chart] = low[chart].cwiseMin(cells), high[chart] = high[chart].cwiseMax(cells);
    }
  }
  for (size_t f = 0; f < out.of_face.size(); ++f) {
    const int chart = out.of_face[f];
    if (!((high[chart] - low[chart]).maxCoeff() <= kLongestChartCells))
      return absl::InvalidArgumentError(
          absl::StrCat("face ", f, ": its chart is more than ", kLongestChartCells,
                       " edges long in the texture, so parts of it are stretched; unwrap the mesh again"));
    // The middle of a cell, where a regular mesh has its vertices then.
    for (Eigen::Vector2d& cells : out.corner_cells[f]) cells += Eigen::Vector2d(0.5, 0.5) - low[chart];
  }
  return absl::OkStatus();
}

double MedianEdgeMm(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  for (const Face& face : mesh.faces)
    for (int k = 0; k < 3; ++k)
      lengths.push_back((mesh.vertices_mm[face[(k + 1) % 3]] - mesh.vertices_mm[face[k]]).norm());
  return Median(std::move(lengths));
}

}  // namespace

absl::StatusOr<ClothCharts> ChartsOfTexture(const GarmentMesh& garment) {
  if (garment.texture.empty())
    return absl::InvalidArgumentError(
        "the mesh has no texture coordinates; unwrap it, and export it with them");
  ClothCharts out;
  out.cell_mm = MedianEdgeMm(garment.rest);
  if (!(out.cell_mm > 0))
    return absl::InvalidArgumentError("most edges of the mesh have no length; merge vertices by distance");
  out.of_face.assign(garment.rest.faces.size(), -1);
  Groups groups(garment.rest.faces.size());
  JoinFaces(garment, groups, out);
  NumberFaces(groups, out);
  if (absl::Status status = PlaceCorners(garment, out); !status.ok()) return status;
  out.of_vertex.assign(garment.rest.vertices_mm.size(), -1);
  out.vertex_cells.assign(garment.rest.vertices_mm.size(), Eigen::Vector2d::Zero());
  for (size_t f = 0; f < out.of_face.size(); ++f)
    for (size_t k = 0; k < 3; ++k)
      if (const int v = garment.rest.faces[f][k]; out.of_vertex[v] < 0)
        out.of_vertex[v] = out.of_face[f], out.vertex_cells[v] = out.corner_cells[f][k];
  return out;
}

ClothCharts ChartsOnBoard(const Template& garment) {
  const MeshGraph graph = BuildMeshGraph(garment.rest);
  const std::vector<VertexNode>& nodes = garment.node_of_vertex;
  Groups groups(nodes.size());
  for (const MeshEdge& edge : graph.edges) {
    if (nodes[edge.a].row < 0 || nodes[edge.b].row < 0) continue;
    const Eigen::Vector2d way = nodes[edge.a].PlaceInCells() - nodes[edge.b].PlaceInCells();
    if (way.cwiseAbs().maxCoeff() > kNeighborCells) continue;
    groups.Join(edge.a, edge.b);
  }
  ClothCharts out;
  out.of_vertex.assign(nodes.size(), -1);
  std::vector<int> number(nodes.size(), -1);
  for (int v = 0; v < static_cast<int>(nodes.size()); ++v) {
    out.vertex_cells.push_back(nodes[v].PlaceInCells());
    if (nodes[v].row < 0) continue;
    int& n = number[groups.RootOf(v)];
    if (n < 0) n = out.charts++;
    out.of_vertex[v] = n;
  }
  return out;
}

}  // namespace weft

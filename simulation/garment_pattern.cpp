#include "simulation/garment_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "simulation/panel_mesh.h"

namespace weft {
namespace {

using Vec2 = Eigen::Vector2d;

// `intervals` + 1 points at equal distances along a path.
std::vector<Vec2> Resample(const std::vector<Vec2>& path, int intervals) {
  const double total = LengthMm(path);
  std::vector<Vec2> out = {path.front()};
  size_t segment = 0;
  double before = 0;
  for (int k = 1; k < intervals; ++k) {
    const double at = total * k / intervals;
    double length = (path[segment + 1] - path[segment]).norm();
    while (before + length < at && segment + 2 < path.size()) {
      before += length;
      ++segment;
      length = (path[segment + 1] - path[segment]).norm();
    }
    out.push_back(path[segment] + (at - before) / length * (path[segment + 1] - path[segment]));
  }
  out.push_back(path.back());
  return out;
}

// Numbers the vertices of seams as the panels come along.
class SeamVertices {
 public:
  explicit SeamVertices(SewnPanels& sewn) : sewn_(sewn) {}

  // The vertices of an edge in its own direction, `points` being its samples in panel `panel`.
  absl::StatusOr<std::vector<int>> Of(const PanelEdge& edge, int panel, const std::vector<Vec2>& points) {
    const auto [known, is_new] = seams_.try_emplace(edge.seam, Seam{edge.from, edge.to, 1});
    if (is_new) {
      std::vector<int> out = {Corner(edge.from, panel, points.front())};
      for (size_t k = 1; k + 1 < points.size(); ++k) out.push_back(Add(panel, points[k]));
      out.push_back(Corner(edge.to, panel, points.back()));
      sewn_.of_seam[edge.seam] = out;
      return out;
    }
    Seam& seam = known->second;
    std::vector<int> out = sewn_.of_seam[edge.seam];
    const bool same = seam.from == edge.from && seam.to == edge.to;
    const bool reversed = seam.from == edge.to && seam.to == edge.from;
    if ((!same && !reversed) || ++seam.uses > 2)
      return absl::InvalidArgumentError(
          absl::StrCat("pattern: seam \"", edge.seam, "\" does not join two edges between the same corners"));
    if (!same) std::reverse(out.begin(), out.end());
    return out;
  }

 private:
  struct Seam {
    std::string from, to;
    int uses;
  };

  int Add(int panel, const Vec2& at) {
    sewn_.place_of_vertex.push_back({panel, at});
    sewn_.garment.cell_of_vertex.push_back({});
    return static_cast<int>(sewn_.place_of_vertex.size()) - 1;
  }
  int Corner(const std::string& name, int panel, const Vec2& at) {
    const auto [known, is_new] = corners_.try_emplace(name, 0);
    if (is_new) known->second = Add(panel, at);
    return known->second;
  }

  SewnPanels& sewn_;
  std::map<std::string, Seam> seams_;
  std::map<std::string, int> corners_;
};

// Where a panel lies: board = origin + p / cell, or turned by a quarter.
struct BoardPlace {
  Vec2 origin;
  bool turned;
  double cell_mm;

  Vec2 BoardOf(const Vec2& p) const {
    const Vec2 q = turned ? Vec2(-p.y(), p.x()) : p;
    return origin + q / cell_mm;
  }
  Vec2 PanelOf(const Vec2& board) const {
    const Vec2 q = (board - origin) * cell_mm;
    return turned ? Vec2(q.y(), -q.x()) : q;
  }
};

// Places the panels from left to right in one row of the board.
class Layout {
 public:
  BoardPlace Place(const Panel& panel, double cell_mm) {
    BoardPlace place = {Vec2::Zero(), panel.turned, cell_mm};
    Vec2 low = Vec2::Constant(1e9), high = -low;
    for (const PanelEdge& edge : panel.outline)
      for (const Vec2& p : edge.path_mm) {
        low = low.cwiseMin(place.BoardOf(p));
        high = high.cwiseMax(place.BoardOf(p));
      }
    place.origin = Vec2(next_col_, 0) - low;
    const int cols = static_cast<int>(std::ceil(high.x() - low.x() - 1e-9));
    rows_ = std::max(rows_, static_cast<int>(std::ceil(high.y() - low.y() - 1e-9)));
    cols_ = next_col_ + cols;
    next_col_ = cols_ + 1;
    return place;
  }
  int rows() const { return rows_; }
  int cols() const { return cols_; }

 private:
  int next_col_ = 0, rows_ = 0, cols_ = 0;
};

absl::Status AddPanel(const Panel& panel, int index, const BoardPlace& place,
                      const std::map<std::string, int>& intervals, SeamVertices& seams, SewnPanels& sewn) {
  std::vector<Vec2> outline;  // on the board
  std::vector<int> vertex_of_outline;
  for (const PanelEdge& edge : panel.outline) {
    const std::vector<Vec2> points = Resample(edge.path_mm, intervals.at(edge.seam));
    WEFT_ASSIGN_OR_RETURN(std::vector<int> vertices, seams.Of(edge, index, points));
    for (size_t k = 0; k + 1 < points.size(); ++k) {
      outline.push_back(place.BoardOf(points[k]));
      vertex_of_outline.push_back(vertices[k]);
    }
  }
  absl::StatusOr<PanelMesh> mesh = MeshPanel(outline);
  if (!mesh.ok())
    return absl::InvalidArgumentError(absl::StrCat("pattern: panel \"", panel.name, "\" with cells of ",
                                                   place.cell_mm, " mm: ", mesh.status().message()));
  std::vector<int> vertex_of_node = vertex_of_outline;
  for (const VertexNode& cell : mesh->cells) {
    vertex_of_node.push_back(static_cast<int>(sewn.place_of_vertex.size()));
    sewn.place_of_vertex.push_back({index, place.PanelOf(Vec2(cell.col + 0.5, cell.row + 0.5))});
    sewn.garment.cell_of_vertex.push_back(cell);
  }
  for (const Face& face : mesh->faces) {
    Face sewn_face;
    std::array<BoardPoint, 3> print;
    std::array<Vec2, 3> places;
    for (int k = 0; k < 3; ++k) {
      sewn_face[k] = vertex_of_node[face[k]];
      print[k] = mesh->NodeAt(outline, face[k]);
      places[k] = place.PanelOf(print[k]);
    }
    sewn.garment.rest.faces.push_back(sewn_face);
    sewn.garment.print.of_face.push_back(print);
    sewn.panel_of_face.push_back(index);
    sewn.place_of_face.push_back(places);
  }
  return absl::OkStatus();
}

// A panel of a sewn garment, to find the face at a place of it.
class PanelFaces {
 public:
  PanelFaces(const SewnPanels& sewn, int panel)
      : cell_mm_(sewn.garment.cell_mm), locator_(PrintOf(sewn, panel)) {}

  // A place that just misses the panel, beside a curved border, belongs to the face next to it.
  SurfacePoint At(const Vec2& place_mm) const {
    const Vec2 place = place_mm / cell_mm_;
    for (const double far : {0.0, 0.02, 0.1, 0.3, 1.0})
      for (int k = 0; k < 8; ++k) {
        const double angle = k * std::numbers::pi / 4;
        if (const auto near = locator_.Find(place + far * Vec2(std::cos(angle), std::sin(angle))))
          return locator_.Beyond(near->face, place);
      }
    return {};
  }

 private:
  static ClothPrint PrintOf(const SewnPanels& sewn, int panel) {
    ClothPrint out;
    for (size_t f = 0; f < sewn.place_of_face.size(); ++f) {
      std::array<BoardPoint, 3> corners;
      for (int k = 0; k < 3; ++k) corners[k] = sewn.place_of_face[f][k] / sewn.garment.cell_mm;
      if (sewn.panel_of_face[f] != panel) corners.fill(BoardPoint::Constant(std::nan("")));
      out.of_face.push_back(corners);
    }
    return out;
  }

  double cell_mm_;
  PrintLocator locator_;
};

}  // namespace

std::vector<Eigen::Vector3d> PositionsOn(const SewnPanels& coarse,
                                         const std::vector<Eigen::Vector3d>& coarse_mm,
                                         const SewnPanels& fine) {
  std::vector<PanelFaces> panels;
  for (int p = 0; p <= coarse.panel_of_face.back(); ++p) panels.emplace_back(coarse, p);
  std::vector<Eigen::Vector3d> out;
  for (const auto& [panel, at_mm] : fine.place_of_vertex)
    out.push_back(PositionOf(panels[panel].At(at_mm), coarse_mm, coarse.garment.rest.faces));
  for (const auto& [name, vertices] : fine.of_seam) {
    const std::vector<int>& on = coarse.of_seam.at(name);
    for (size_t k = 0; k < vertices.size(); ++k) {
      const double at = static_cast<double>(k * (on.size() - 1)) / static_cast<double>(vertices.size() - 1);
      const size_t i = std::min(static_cast<size_t>(at), on.size() - 2);
      const double t = at - static_cast<double>(i);
      out[vertices[k]] = (1 - t) * coarse_mm[on[i]] + t * coarse_mm[on[i + 1]];
    }
  }
  return out;
}

double LengthMm(const std::vector<Vec2>& path_mm) {
  double sum = 0;
  for (size_t i = 0; i + 1 < path_mm.size(); ++i) sum += (path_mm[i + 1] - path_mm[i]).norm();
  return sum;
}

std::vector<Vec2> BezierPath(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  constexpr int kIntervals = 64;
  std::vector<Vec2> out;
  for (int i = 0; i <= kIntervals; ++i) {
    const double t = static_cast<double>(i) / kIntervals, s = 1 - t;
    out.push_back(s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
  }
  return out;
}

absl::StatusOr<SewnPanels> SewPanels(const std::vector<Panel>& panels, double cell_mm) {
  if (!(cell_mm > 0) || !std::isfinite(cell_mm))
    return absl::InvalidArgumentError(absl::StrCat("pattern: cell_mm is ", cell_mm, ", must be positive"));
  std::map<std::string, int> intervals;
  for (const Panel& panel : panels)
    for (const PanelEdge& edge : panel.outline)
      intervals.try_emplace(edge.seam,
                            std::max(2, static_cast<int>(std::lround(LengthMm(edge.path_mm) / cell_mm))));
  SewnPanels sewn;
  SeamVertices seams(sewn);
  Layout layout;
  for (size_t i = 0; i < panels.size(); ++i) {
    const BoardPlace place = layout.Place(panels[i], cell_mm);
    WEFT_RETURN_IF_ERROR(AddPanel(panels[i], static_cast<int>(i), place, intervals, seams, sewn));
  }
  sewn.garment.board_rows = layout.rows();
  sewn.garment.board_cols = layout.cols();
  sewn.garment.cell_mm = cell_mm;
  sewn.garment.rest.vertices_mm.assign(sewn.place_of_vertex.size(), Eigen::Vector3d::Zero());
  return sewn;
}

}  // namespace weft

#include "animation/atlas/atlas.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "animation/atlas/chart_layout.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Vertices without a node that a seam is at most wide.
constexpr int kWidestSeam = 3;
// A partner on the same panel is at least this many cells away on the board.
constexpr double kOtherSideCells = 3.5;
// Texels around a border that say which way the panel lies.
constexpr double kInwardTexels = 2.5;

// Weights of the vertices around another that give it what is linear in space, as well as they can; of those
// the smallest, in which near vertices may be larger.
std::vector<double> LinearWeights(const std::vector<Eigen::Vector3d>& at_mm, int v,
                                  const std::vector<int>& around) {
  constexpr double kSoft = 1e-6;
  Eigen::Matrix4d normal = kSoft * Eigen::Matrix4d::Identity();
  std::vector<Eigen::Vector4d> columns;
  double scale = 1e-9;
  for (const int other : around) scale = std::max(scale, (at_mm[other] - at_mm[v]).norm());
  for (const int other : around) {
    const Eigen::Vector3d way = (at_mm[other] - at_mm[v]) / scale;
    Eigen::Vector4d column;
    column << way, 1;
    columns.push_back(column / std::max(way.norm(), 1e-3));
    normal += columns.back() * columns.back().transpose();
  }
  const Eigen::Vector4d dual = normal.ldlt().solve(Eigen::Vector4d(0, 0, 0, 1));
  std::vector<double> out;
  double sum = 0;
  for (size_t k = 0; k < around.size(); ++k) {
    const double distance = (at_mm[around[k]] - at_mm[v]).norm() / scale;
    out.push_back(columns[k].dot(dual) / std::max(distance, 1e-3));
    sum += out.back();
  }
  for (double& w : out) w /= sum;
  return out;
}

// The vertex beyond the seam at a seat: the nearest one of a chart that is reached without crossing the
// panel; -1: none.
int VertexBeyondSeam(const GarmentMesh& garment, const MeshGraph& graph, const ClothCharts& charts,
                     const ChartSeat& seat) {
  const int v = seat.vertex;
  std::vector<int> ring = {v}, visited = {v};
  int best = -1;
  double best_mm = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kWidestSeam && best < 0; ++step) {
    std::vector<int> next;
    for (const int at : ring)
      for (int i = graph.first[at]; i < graph.first[at + 1]; ++i) {
        const int other = graph.neighbor[i];
        if (std::find(visited.begin(), visited.end(), other) != visited.end()) continue;
        if (charts.of_vertex[other] < 0) {
          visited.push_back(other), next.push_back(other);
          continue;
        }
        const double cells = (charts.vertex_cells[other] - seat.cells).norm();
        if (charts.of_vertex[other] == seat.panel && cells < kOtherSideCells) continue;
        const double mm = (garment.rest.vertices_mm[other] - garment.rest.vertices_mm[v]).norm();
        if (mm < best_mm) best = other, best_mm = mm;
      }
    ring = std::move(next);
  }
  return best;
}

struct TexelGrid {
  int width = 0, height = 0;

  // -1: outside of the image.
  int At(int col, int row) const {
    return col < 0 || row < 0 || col >= width || row >= height ? -1 : row * width + col;
  }
  int Beside(int texel, int cols, int rows) const { return At(texel % width + cols, texel / width + rows); }
  Eigen::Vector2d PlaceOf(int texel) const { return Eigen::Vector2d(texel % width, texel / width); }
};

// The way from a texel of a panel into its panel, of length 1; zero where no side has more of it.
Eigen::Vector2d InwardAt(const TexelGrid& grid, const std::vector<int>& panel_of_texel, int texel) {
  Eigen::Vector2d inward = Eigen::Vector2d::Zero();
  const Eigen::Vector2d at = grid.PlaceOf(texel);
  const int reach = static_cast<int>(kInwardTexels);
  for (int dr = -reach; dr <= reach; ++dr)
    for (int dc = -reach; dc <= reach; ++dc) {
      const int t = grid.Beside(texel, dc, dr);
      if (t < 0 || panel_of_texel[t] != panel_of_texel[texel]) continue;
      if (std::hypot(dr, dc) <= kInwardTexels) inward += grid.PlaceOf(t) - at;
    }
  if (inward.norm() > 1e-9) inward.normalize();
  return inward;
}

// The texel of a panel that is nearest to another within `gutter`, and how far it is; -1: none.
std::pair<int, double> NearestPanelTexel(const TexelGrid& grid, const std::vector<int>& panel_of_texel,
                                         int texel, int gutter) {
  int nearest = -1;
  double distance = gutter + 0.5;
  for (int dr = -gutter; dr <= gutter; ++dr)
    for (int dc = -gutter; dc <= gutter; ++dc) {
      const int t = grid.Beside(texel, dc, dr);
      if (t < 0 || panel_of_texel[t] < 0 || std::hypot(dr, dc) >= distance) continue;
      nearest = t, distance = std::hypot(dr, dc);
    }
  return {nearest, distance};
}

int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

}  // namespace

absl::Status AtlasOptions::Validate() const {
  if (level < 0 || level > 6) return absl::InvalidArgumentError("atlas: level must be 0 to 6");
  if (gutter < 0 || gutter > 16) return absl::InvalidArgumentError("atlas: gutter must be 0 to 16");
  if (multiple < 1 || multiple > 256) return absl::InvalidArgumentError("atlas: multiple must be 1 to 256");
  return absl::OkStatus();
}

// Where vertices lie in the image.
struct Atlas::Layout {
  const ClothCharts& charts;
  const MeshGraph graph;
  const ChartLayout packed;
  std::vector<int> panel_of_texel = {};                            // -1: none
  std::vector<std::vector<const ChartSeat*>> seats_of_texel = {};  // in packed.seats
};

absl::StatusOr<Atlas> Atlas::Build(const GarmentMesh& garment, const ClothCharts& charts,
                                   const AtlasOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  Atlas out;
  Layout layout = {charts, BuildMeshGraph(garment.rest),
                   LayOutCharts(garment, charts, 1 << options.level, options.gutter)};
  out.panels_ = charts.charts;
  out.width_ = RoundUp(layout.packed.cols, options.multiple);
  out.height_ = RoundUp(layout.packed.rows, options.multiple);
  if (int64_t{out.width_} * out.height_ > kMostTexels)
    return absl::InvalidArgumentError(
        absl::StrCat("atlas: is ", out.width_, " x ", out.height_, " texels large; choose a higher level"));
  out.kinds_.assign(static_cast<size_t>(out.width_) * static_cast<size_t>(out.height_), TexelKind::kEmpty);
  layout.panel_of_texel.assign(out.kinds_.size(), -1);
  layout.seats_of_texel.resize(out.kinds_.size());
  out.texel_of_vertex_.assign(layout.graph.vertices, -1);
  const auto take = [&](int panel, const Eigen::Vector2i& texel) {
    const int at = texel.y() * out.width_ + texel.x();
    out.kinds_[at] = TexelKind::kPanel;
    layout.panel_of_texel[at] = panel;
    return at;
  };
  for (const ChartSeat& seat : layout.packed.seats) {
    const int at = take(seat.panel, seat.texel);
    if (int& own = out.texel_of_vertex_[seat.vertex]; own < 0) own = at;
    if (!seat.is_in_fill) out.seats_.emplace_back(seat.vertex, at);
    layout.seats_of_texel[at].push_back(&seat);
  }
  for (const ChartFill& fill : layout.packed.fills)
    out.fills_.emplace_back(take(fill.panel, fill.texel), fill.weights);
  out.FindGutter(garment, layout, options);
  out.FindSources(garment, layout);
  return out;
}

void Atlas::FindSources(const GarmentMesh& garment, const Layout& layout) {
  const MeshGraph& graph = layout.graph;
  of_vertex_.resize(graph.vertices);
  std::vector<int> ring;
  for (const ChartSeat& seat : layout.packed.seats) {
    const int v = seat.vertex, p = seat.panel;
    if (!of_vertex_[v].empty()) continue;  // it is beyond a seam, too
    const Eigen::Vector2d& at = seat.place;
    const int col = static_cast<int>(std::floor(at.x() + 1e-9)),
              row = static_cast<int>(std::floor(at.y() + 1e-9));
    float sum = 0;
    for (int corner = 0; corner < 4; ++corner) {
      const int c = col + corner % 2, r = row + corner / 2;
      const auto weight = static_cast<float>((1 - std::abs(at.x() - c)) * (1 - std::abs(at.y() - r)));
      if (c < 0 || r < 0 || c >= width_ || r >= height_ || weight < 1e-6f) continue;
      const int texel = r * width_ + c;
      if (layout.panel_of_texel[texel] != p && kinds_[texel] != TexelKind::kSeam) continue;
      of_vertex_[v].push_back({texel, weight});
      sum += weight;
    }
    for (Weighted& w : of_vertex_[v]) w.weight /= sum;
    ring.push_back(v);
  }
  // Vertices without a node, from those beside nodes on.
  while (!ring.empty()) {
    std::map<int, std::vector<int>> next;  // vertex, those around it that are known
    for (const int v : ring)
      for (int i = graph.first[v]; i < graph.first[v + 1]; ++i)
        if (const int other = graph.neighbor[i]; of_vertex_[other].empty()) next[other].push_back(v);
    ring.clear();
    for (const auto& [v, around] : next) {
      const std::vector<double> weights = LinearWeights(garment.rest.vertices_mm, v, around);
      std::map<int, double> texels;
      for (size_t k = 0; k < around.size(); ++k)
        for (const Weighted& w : of_vertex_[around[k]]) texels[w.texel] += weights[k] * w.weight;
      for (const auto& [texel, weight] : texels) of_vertex_[v].push_back({texel, static_cast<float>(weight)});
      ring.push_back(v);
    }
  }
}

void Atlas::FindGutter(const GarmentMesh& garment, const Layout& layout, const AtlasOptions& options) {
  const TexelGrid grid = {width_, height_};
  // The texel beyond the seam at a panel's texel, and the way from it into its panel.
  struct Partner {
    int texel = -1;
    Eigen::Vector2d inward = Eigen::Vector2d::Zero();
  };
  const auto partner_of = [&](int texel) {
    Partner out;
    for (const ChartSeat* const seat : layout.seats_of_texel[texel]) {
      const int other = VertexBeyondSeam(garment, layout.graph, layout.charts, *seat);
      if (other < 0) continue;
      out.texel = texel_of_vertex_[other];
      break;
    }
    if (out.texel < 0) return out;
    out.inward = InwardAt(grid, layout.panel_of_texel, out.texel);
    return out;
  };
  std::map<int, Partner> partners;
  for (int texel = 0; texel < static_cast<int>(kinds_.size()); ++texel) {
    if (layout.panel_of_texel[texel] >= 0) continue;
    const auto [nearest, distance] = NearestPanelTexel(grid, layout.panel_of_texel, texel, options.gutter);
    if (nearest < 0) continue;
    auto found = partners.find(nearest);
    if (found == partners.end()) found = partners.emplace(nearest, partner_of(nearest)).first;
    const Partner& partner = found->second;
    if (partner.texel < 0) {
      kinds_[texel] = TexelKind::kBorder;
      gutter_.push_back({texel, {{nearest, 1.0f}}});
      continue;
    }
    kinds_[texel] = TexelKind::kSeam;
    const Eigen::Vector2d at = grid.PlaceOf(partner.texel) + (distance - 1) * partner.inward;
    std::vector<Weighted> sources;
    float sum = 0;
    const int col = static_cast<int>(std::floor(at.x())), row = static_cast<int>(std::floor(at.y()));
    for (int corner = 0; corner < 4; ++corner) {
      const int t = grid.At(col + corner % 2, row + corner / 2);
      if (t < 0 || layout.panel_of_texel[t] != layout.panel_of_texel[partner.texel]) continue;
      const Eigen::Vector2d off = (grid.PlaceOf(t) - at).cwiseAbs();
      const auto weight = static_cast<float>((1 - off.x()) * (1 - off.y()));
      if (weight > 1e-6f) sources.push_back({t, weight}), sum += weight;
    }
    if (sources.empty()) sources = {{partner.texel, 1.0f}}, sum = 1;
    for (Weighted& w : sources) w.weight /= sum;
    gutter_.push_back({texel, std::move(sources)});
  }
}

AtlasImage Atlas::Gather(std::span<const float> per_vertex, int channels) const {
  AtlasImage out{channels, height_, width_, {}};
  const size_t plane = out.PlaneSize();
  out.values.assign(plane * static_cast<size_t>(channels), 0);
  std::vector<int> count(plane, 0);
  for (const auto& [vertex, texel] : seats_) {
    const auto v = static_cast<size_t>(vertex);
    ++count[texel];
    for (int c = 0; c < channels; ++c) out.values[c * plane + texel] += per_vertex[v * channels + c];
  }
  for (int c = 0; c < channels; ++c)
    for (size_t t = 0; t < plane; ++t)
      if (count[t] > 1) out.values[c * plane + t] /= static_cast<float>(count[t]);
  for (const auto& [texel, weights] : fills_)
    for (int c = 0; c < channels; ++c)
      for (const auto& [v, weight] : weights)
        out.values[c * plane + texel] += weight * per_vertex[static_cast<size_t>(v) * channels + c];
  FillGutter(&out);
  return out;
}

void Atlas::FillGutter(AtlasImage* image) const {
  const size_t plane = image->PlaneSize();
  for (int c = 0; c < image->channels; ++c) {
    float* values = &image->values[c * plane];
    for (const auto& [texel, sources] : gutter_) {
      values[texel] = 0;
      for (const Weighted& w : sources) values[texel] += w.weight * values[w.texel];
    }
  }
}

std::vector<float> Atlas::Scatter(AtlasImage image) const {
  FillGutter(&image);
  const size_t plane = image.PlaneSize(), channels = image.channels;
  std::vector<float> out(of_vertex_.size() * channels, 0);
  for (size_t v = 0; v < of_vertex_.size(); ++v)
    for (const Weighted& w : of_vertex_[v])
      for (size_t c = 0; c < channels; ++c)
        out[v * channels + c] += w.weight * image.values[c * plane + w.texel];
  return out;
}

}  // namespace weft

#include "alignment/print_scale.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"

namespace weft {
namespace {

constexpr size_t kMostFaces = 4000;
constexpr double kNearCells = 2;
constexpr double kApart = 0.5;            // length of an edge against the distance of its ends on the board
constexpr size_t kLeastEdges = 60;        // that tell axes
constexpr double kLeastAxisShare = 0.01;  // of squared lengths along an axis, else the mesh is flat across it
constexpr double kUnitSlack = 0.1;

// The quadratic form Q that gives edges e the length e'Qe = 1, by least squares. Edges that it explains badly
// count less from round to round: seams, creases, cloth that is stretched in places.
Eigen::Matrix3d FitMetric(const std::vector<Eigen::Vector3d>& edges) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  constexpr int kRounds = 3;
  Vector6 form;
  form << 1, 1, 1, 0, 0, 0;
  double scatter = 0;
  for (int round = 0; round < kRounds; ++round) {
    Matrix6 normal = 1e-6 * static_cast<double>(edges.size()) * Matrix6::Identity();
    Vector6 right = Vector6::Zero();
    std::vector<double> residuals;
    for (const Eigen::Vector3d& e : edges) {
      Vector6 row;
      row << e.cwiseAbs2(), 2 * e.x() * e.y(), 2 * e.x() * e.z(), 2 * e.y() * e.z();
      const double residual = row.dot(form) - 1;
      residuals.push_back(std::abs(residual));
      const double weight = round == 0 ? 1 : 1 / (1 + std::pow(residual / scatter, 2));
      normal.noalias() += weight * row * row.transpose();
      right += weight * row;
    }
    form = normal.ldlt().solve(right);
    for (size_t i = 0; i < edges.size(); ++i) {
      const Eigen::Vector3d& e = edges[i];
      residuals[i] =
          std::abs(e.cwiseAbs2().dot(form.head<3>()) +
                   2 * (e.x() * e.y() * form[3] + e.x() * e.z() * form[4] + e.y() * e.z() * form[5]) - 1);
    }
    scatter = std::max(1e-3, 3 * Median(std::move(residuals)));
  }
  Eigen::Matrix3d metric;
  metric << form[0], form[3], form[4], form[3], form[1], form[5], form[4], form[5], form[2];
  return metric;
}

void AddAxis(const std::vector<Eigen::Vector3d>& edges, PrintScale* scale) {
  if (edges.size() < kLeastEdges) return;
  std::vector<Eigen::Vector3d> unit = edges;  // so that the fit is as good in metres
  for (Eigen::Vector3d& e : unit) e /= scale->median;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const Eigen::Vector3d& e : unit) scatter += e * e.transpose(), squares += e.squaredNorm();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(FitMetric(unit));
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = axes.eigenvectors().col(i);
    if (axis.dot(scatter * axis) < kLeastAxisShare * squares || !(axes.eigenvalues()[i] > 0)) continue;
    const double along = scale->median / std::sqrt(axes.eigenvalues()[i]);
    if (scale->along_axis > 0 && std::abs(std::log(along)) <= std::abs(std::log(scale->along_axis))) continue;
    scale->axis = axis;
    scale->along_axis = along;
  }
}

// "x", or the direction in numbers where it is none of the mesh's axes.
std::string AxisName(const Eigen::Vector3d& axis) {
  constexpr double kAlong = 0.97;
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > kAlong) return absl::StrCat("its ", std::string(1, static_cast<char>('x' + i)));
  return absl::StrFormat("(%.2f, %.2f, %.2f)", axis.x(), axis.y(), axis.z());
}

bool TellsAxis(const PrintScale& scale) {
  return scale.along_axis > 0 && std::abs(scale.along_axis / scale.median - 1) > kScaleSaid;
}

std::string Words(const PrintScale& scale) {
  std::string text =
      absl::StrFormat("edges of the mesh are %.4g times as long as on the print", scale.median);
  if (TellsAxis(scale))
    absl::StrAppendFormat(&text, ", %.4g times along %s", scale.along_axis, AxisName(scale.axis));
  return text;
}

}  // namespace

double PrintScale::Worst() const {
  if (!(median > 0) || !(along_axis > 0)) return median;
  return std::abs(std::log(along_axis)) > std::abs(std::log(median)) ? along_axis : median;
}

double CellMmAt(const Board& board, int row) {
  const int part = board.PartAt(row);
  return part >= 0 && board.parts[static_cast<size_t>(part)].cell_mm > 0
             ? board.parts[static_cast<size_t>(part)].cell_mm
             : board.cell_mm;
}

std::vector<NodeEdge> SampleNodeEdges(const std::vector<Eigen::Vector3d>& vertices_mm,
                                      std::span<const Face> faces, const std::vector<VertexNode>& nodes) {
  std::vector<NodeEdge> edges;
  const size_t step = std::max<size_t>(1, faces.size() / kMostFaces);
  for (size_t f = 0; f < faces.size(); f += step) {
    for (size_t i = 0; i < 3; ++i) {
      const auto a = static_cast<size_t>(faces[f][i]), b = static_cast<size_t>(faces[f][(i + 1) % 3]);
      if (nodes[a].row < 0 || nodes[b].row < 0) continue;
      edges.push_back({vertices_mm[b] - vertices_mm[a], nodes[b].PlaceInCells() - nodes[a].PlaceInCells()});
    }
  }
  return edges;
}

bool IsApart(const NodeEdge& edge, double mm_per_cell) {
  return edge.board_cells.lpNorm<Eigen::Infinity>() > kNearCells &&
         edge.LengthPerCell() < kApart * mm_per_cell;
}

double MedianLengthPerCell(const std::vector<NodeEdge>& edges) {
  std::vector<double> lengths;
  lengths.reserve(edges.size());
  for (const NodeEdge& edge : edges) lengths.push_back(edge.LengthPerCell());
  return Median(std::move(lengths));
}

PrintScale MeasurePrintScale(const std::vector<NodeEdge>& edges, double cell_mm) {
  PrintScale scale;
  if (!(cell_mm > 0)) return scale;
  const double mm_per_cell = MedianLengthPerCell(edges);
  std::vector<Eigen::Vector3d> in_print;
  std::vector<double> lengths;
  for (const NodeEdge& edge : edges) {
    if (IsApart(edge, mm_per_cell)) continue;
    in_print.push_back(edge.mesh_mm / (cell_mm * edge.board_cells.norm()));
    lengths.push_back(in_print.back().norm());
  }
  scale.median = Median(std::move(lengths));
  if (scale.median > 0) AddAxis(in_print, &scale);
  return scale;
}

std::optional<UnitOfLength> UnitOfScale(double scale) {
  for (const UnitOfLength& unit : UnitsOfLength().subspan(1))
    if (std::abs(scale * unit.mm - 1) < kUnitSlack) return unit;
  return std::nullopt;
}

std::string PrintScaleWords(const PrintScale& scale) {
  const double worst = scale.Worst();
  return worst > 0 && std::abs(worst - 1) > kScaleSaid ? Words(scale) : "";
}

absl::Status CheckPrintScale(const PrintScale& scale) {
  const double worst = scale.Worst();
  if (!(worst > 0) || std::abs(worst - 1) <= kScaleRefused) return absl::OkStatus();
  if (const auto unit = UnitOfScale(scale.median)) {
    return absl::InvalidArgumentError(absl::StrCat("the mesh is in ", unit->plural, ": ", Words(scale),
                                                   "; import it with --unit ", unit->name));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the mesh is of another size than the print: ", Words(scale),
                   "; give the board that was printed and the mesh in its own size, or --allow-scale"));
}

}  // namespace weft

#include "services/formats/files/cloud_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/ply.h"

namespace weft {
namespace {

struct CovarianceColumn {
  const char* name;
  const char* fold_name;
  int row, col;
};
constexpr std::array<CovarianceColumn, 6> kCovariance = {{
    {"cov_xx_mm2", "fold_cov_xx_mm2", 0, 0},
    {"cov_xy_mm2", "fold_cov_xy_mm2", 0, 1},
    {"cov_xz_mm2", "fold_cov_xz_mm2", 0, 2},
    {"cov_yy_mm2", "fold_cov_yy_mm2", 1, 1},
    {"cov_yz_mm2", "fold_cov_yz_mm2", 1, 2},
    {"cov_zz_mm2", "fold_cov_zz_mm2", 2, 2},
}};

// Rounding may make the part that folds cause a little larger than the whole.
void KeepFoldsWithinWhole(CloudPoint& point) {
  const double whole = 3 * point.sigma_mm * point.sigma_mm, folds = point.fold_covariance_mm2.trace();
  if (folds > whole) point.fold_covariance_mm2 *= (1 - 1e-6) * whole / folds;
}

// Not inlined: gcc 12 drops the rounding where it does two of them at once (-O2, no fast-math).
[[gnu::noinline]] double InSinglePrecision(double value) { return static_cast<float>(value); }

bool HasScalar(const PlyElement& element, const char* name) {
  const PlyProperty* column = element.Find(name);
  return column && !column->is_list;
}

// A symmetric matrix of each point from six columns; they are left as they are where a column is missing.
template <typename MatrixOf>
void ReadMatrices(const PlyElement& element, const char* CovarianceColumn::*name, const MatrixOf& matrix_of,
                  Cloud& cloud) {
  for (const CovarianceColumn& c : kCovariance) {
    if (!HasScalar(element, c.*name)) continue;
    const std::vector<double>& values = element.Find(c.*name)->values;
    for (size_t i = 0; i < element.rows; ++i) {
      matrix_of(cloud.points[i])(c.row, c.col) = values[i];
      matrix_of(cloud.points[i])(c.col, c.row) = values[i];
    }
  }
}

// One value per row of an element, checked for its range.
class Rows {
 public:
  Rows(const PlyElement& element, const std::string& source_name)
      : element_(element), source_name_(source_name) {}

  // All values of a property; `fallback` where the element lacks it, an error when there is no fallback.
  absl::StatusOr<std::vector<double>> Values(const char* property, double least, double most,
                                             std::optional<double> fallback = std::nullopt) const {
    if (fallback && !element_.Find(property)) return std::vector<double>(element_.rows, *fallback);
    WEFT_ASSIGN_OR_RETURN(const auto column, ScalarColumn(element_, property, source_name_));
    for (size_t row = 0; row < element_.rows; ++row) {
      const double value = column->values[row];
      if (value >= least && value <= most) continue;
      return absl::InvalidArgumentError(absl::StrCat(source_name_, ": element ", element_.name, ", row ", row,
                                                     ", property ", property, ": ", value, " is outside ",
                                                     least, " to ", most));
    }
    return column->values;
  }

 private:
  const PlyElement& element_;
  const std::string& source_name_;
};

constexpr double kMaxCell = 1 << 20;
constexpr double kMaxViews = 1 << 20;
constexpr double kMaxSigmaMm = 1e9;

absl::StatusOr<Cloud> CloudFromElement(const PlyElement& element, const std::string& source_name) {
  const Rows rows(element, source_name);
  const auto positions = PositionsFromPly(element, source_name);
  const auto board_row = rows.Values("board_row", 0, kMaxCell);
  const auto board_col = rows.Values("board_col", 0, kMaxCell);
  const auto kind = rows.Values("kind", 0, 1, 0);
  const auto views = rows.Values("views", 0, kMaxViews, 0);
  const auto sigma_mm = rows.Values("sigma_mm", 0, kMaxSigmaMm, 0);
  const auto fold_sigma_mm = rows.Values("fold_sigma_mm", 0, kMaxSigmaMm, 0);
  absl::Status status;
  for (const absl::Status& s : {positions.status(), board_row.status(), board_col.status(), kind.status(),
                                views.status(), sigma_mm.status(), fold_sigma_mm.status()}) {
    status.Update(s);
  }
  if (!status.ok()) return status;
  Cloud cloud;
  cloud.points.resize(element.rows);
  for (size_t i = 0; i < element.rows; ++i) {
    CloudPoint& point = cloud.points[i];
    point.position_mm = (*positions)[i];
    point.node = {static_cast<int>((*board_row)[i]), static_cast<int>((*board_col)[i]),
                  (*kind)[i] == 1 ? NodeKind::kCorner : NodeKind::kCenter};
    point.views = static_cast<int>((*views)[i]);
    point.sigma_mm = (*sigma_mm)[i];
  }
  ReadMatrices(
      element, &CovarianceColumn::name, [](CloudPoint & p) -> auto& { return p.covariance_mm2; }, cloud);
  if (HasScalar(element, kCovariance[0].fold_name)) {
    ReadMatrices(
        element, &CovarianceColumn::fold_name, [](CloudPoint & p) -> auto& { return p.fold_covariance_mm2; },
        cloud);
    for (CloudPoint& point : cloud.points) KeepFoldsWithinWhole(point);
    return cloud;
  }
  for (size_t i = 0; i < element.rows; ++i) {
    CloudPoint& point = cloud.points[i];
    if (!((*fold_sigma_mm)[i] < point.sigma_mm)) continue;
    const double share = std::pow((*fold_sigma_mm)[i] / point.sigma_mm, 2);
    point.fold_covariance_mm2 = share * point.covariance_mm2;
    if (point.covariance_mm2.isZero()) {
      point.fold_covariance_mm2.diagonal().setConstant(share * point.sigma_mm * point.sigma_mm);
    }
  }
  return cloud;
}

absl::StatusOr<CloudTargets> TargetsByVertex(const PlyElement& element, const std::string& source_name,
                                             const Template& garment) {
  const Rows rows(element, source_name);
  const auto positions = PositionsFromPly(element, source_name);
  const auto vertices = static_cast<int>(garment.rest.vertices_mm.size());
  const auto vertex = rows.Values("template_vertex", -1, vertices - 1);
  const auto views = rows.Values("views", 0, kMaxViews, 0);
  const auto sigma_mm = rows.Values("sigma_mm", 0, kMaxSigmaMm, 0);
  absl::Status status;
  for (const absl::Status& s : {positions.status(), vertex.status(), views.status(), sigma_mm.status()})
    status.Update(s);
  if (!status.ok()) return status;
  CloudTargets out;
  for (size_t i = 0; i < element.rows; ++i) {
    const auto index = static_cast<int>((*vertex)[i]);
    if (index < 0) {
      ++out.unclaimed;
      continue;
    }
    out.targets.push_back({index, (*positions)[i], (*sigma_mm)[i], static_cast<int>((*views)[i])});
  }
  std::ranges::stable_sort(out.targets,
                           [](const VertexTarget& a, const VertexTarget& b) { return a.vertex < b.vertex; });
  for (size_t i = 1; i < out.targets.size(); ++i) {
    if (out.targets[i].vertex != out.targets[i - 1].vertex) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": template vertex ", out.targets[i].vertex, " occurs twice"));
  }
  return out;
}

bool NodeLess(const CloudPoint& a, const CloudPoint& b) {
  return std::tuple(a.node.kind, a.node.row, a.node.col) < std::tuple(b.node.kind, b.node.row, b.node.col);
}

absl::Status SortByNode(Cloud& cloud, const std::string& source_name) {
  std::ranges::stable_sort(cloud.points, NodeLess);
  for (size_t i = 1; i < cloud.points.size(); ++i) {
    const BoardNode& node = cloud.points[i].node;
    if (node != cloud.points[i - 1].node) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": the ", node.kind == NodeKind::kCenter ? "centre" : "corner", " at row ",
                     node.row, ", column ", node.col, " occurs twice"));
  }
  return absl::OkStatus();
}

constexpr std::array<const char*, 3> kOrigin = {"x", "y", "z"}, kDirection = {"dx", "dy", "dz"};

PlyElement RaysAsElement(const std::vector<CloudRay>& rays) {
  PlyElement element{"ray", rays.size(), {}};
  const auto add = [&](const char* name, PlyType type, const auto& value_of) {
    element.properties.push_back(PlyColumn(name, type, rays, value_of));
  };
  for (int k = 0; k < 3; ++k)
    add(kOrigin[k], PlyType::kFloat32, [k](const CloudRay& ray) { return ray.origin_mm[k]; });
  for (int k = 0; k < 3; ++k)
    add(kDirection[k], PlyType::kFloat32, [k](const CloudRay& ray) { return ray.direction[k]; });
  add("board_row", PlyType::kInt32, [](const CloudRay& ray) { return ray.node.row; });
  add("board_col", PlyType::kInt32, [](const CloudRay& ray) { return ray.node.col; });
  add("kind", PlyType::kUint8, [](const CloudRay& ray) { return ray.node.kind; });
  add("sigma_rad", PlyType::kFloat32, [](const CloudRay& ray) { return ray.sigma_rad; });
  return element;
}

// None where the file has no rays.
absl::StatusOr<std::vector<CloudRay>> RaysFromPly(const Ply& ply, const std::string& source_name) {
  const PlyElement* element = ply.Find("ray");
  if (element == nullptr) return std::vector<CloudRay>();
  const Rows rows(*element, source_name);
  std::vector<CloudRay> rays(element->rows);
  const auto read = [&](const char* property, double least, double most, const auto& set) {
    const auto values = rows.Values(property, least, most);
    for (size_t i = 0; values.ok() && i < rays.size(); ++i) set(rays[i], (*values)[i]);
    return values.status();
  };
  constexpr double kMostMm = 1e9, kRoundingOfLength = 1e-5, kRightAngle = 1.58;
  absl::Status status;
  for (int k = 0; k < 3; ++k) {
    status.Update(read(kOrigin[k], -kMostMm, kMostMm, [k](CloudRay& r, double v) { r.origin_mm[k] = v; }));
    status.Update(read(kDirection[k], -1 - kRoundingOfLength, 1 + kRoundingOfLength,
                       [k](CloudRay& r, double v) { r.direction[k] = v; }));
  }
  status.Update(
      read("board_row", 0, kMaxCell, [](CloudRay& r, double v) { r.node.row = static_cast<int>(v); }));
  status.Update(
      read("board_col", 0, kMaxCell, [](CloudRay& r, double v) { r.node.col = static_cast<int>(v); }));
  status.Update(read("kind", 0, 1, [](CloudRay& r, double v) {
    r.node.kind = v == 1 ? NodeKind::kCorner : NodeKind::kCenter;
  }));
  status.Update(read("sigma_rad", 0, kRightAngle, [](CloudRay& r, double v) { r.sigma_rad = v; }));
  if (!status.ok()) return status;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (std::abs(rays[i].direction.norm() - 1) < kRoundingOfLength) continue;
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": element ray, row ", i,
                                                   ": dx, dy, dz have the length ", rays[i].direction.norm(),
                                                   ", which must be 1"));
  }
  return rays;
}

}  // namespace

Ply CloudAsPly(const Cloud& cloud, CloudColumns columns) {
  PlyElement vertex{"vertex", cloud.points.size(), {}};
  const auto add = [&](const char* name, PlyType type, const auto& value_of) {
    vertex.properties.push_back(PlyColumn(name, type, cloud.points, value_of));
  };
  add("x", PlyType::kFloat32, [](const CloudPoint& p) { return p.position_mm.x(); });
  add("y", PlyType::kFloat32, [](const CloudPoint& p) { return p.position_mm.y(); });
  add("z", PlyType::kFloat32, [](const CloudPoint& p) { return p.position_mm.z(); });
  add("board_row", PlyType::kInt32, [](const CloudPoint& p) { return p.node.row; });
  add("board_col", PlyType::kInt32, [](const CloudPoint& p) { return p.node.col; });
  add("kind", PlyType::kUint8, [](const CloudPoint& p) { return p.node.kind; });
  add("views", PlyType::kInt32, [](const CloudPoint& p) { return p.views; });
  add("sigma_mm", PlyType::kFloat32, [](const CloudPoint& p) { return p.sigma_mm; });
  add("fold_sigma_mm", PlyType::kFloat32,
      [](const CloudPoint& p) { return std::sqrt(p.fold_covariance_mm2.trace() / 3); });
  if (columns == CloudColumns::kWithCovariance) {
    for (const CovarianceColumn& c : kCovariance) {
      add(c.name, PlyType::kFloat32, [&](const CloudPoint& p) { return p.covariance_mm2(c.row, c.col); });
    }
    for (const CovarianceColumn& c : kCovariance) {
      add(c.fold_name, PlyType::kFloat32,
          [&](const CloudPoint& p) { return p.fold_covariance_mm2(c.row, c.col); });
    }
  }
  Ply ply;
  ply.comments.push_back("positions in mm; kind 0 center, 1 corner");
  ply.elements.push_back(std::move(vertex));
  if (!cloud.rays.empty()) ply.elements.push_back(RaysAsElement(cloud.rays));
  return ply;
}

absl::Status WriteCloud(const std::string& path, const Cloud& cloud, CloudColumns columns) {
  return WritePly(path, CloudAsPly(cloud, columns));
}

absl::StatusOr<Cloud> ReadCloud(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(path));
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(ply, "vertex", path));
  WEFT_ASSIGN_OR_RETURN(Cloud cloud, CloudFromElement(*vertex, path));
  WEFT_RETURN_IF_ERROR(SortByNode(cloud, path));
  WEFT_ASSIGN_OR_RETURN(cloud.rays, RaysFromPly(ply, path));
  return cloud;
}

Cloud AsInFile(Cloud cloud) {
  const auto single = [](double value) { return InSinglePrecision(value); };
  for (CloudPoint& point : cloud.points) {
    point.position_mm = point.position_mm.unaryExpr(single).eval();
    point.sigma_mm = single(point.sigma_mm);
    point.covariance_mm2 = point.covariance_mm2.unaryExpr(single).eval();
    point.fold_covariance_mm2 = point.fold_covariance_mm2.unaryExpr(single).eval();
    KeepFoldsWithinWhole(point);
  }
  for (CloudRay& ray : cloud.rays) {
    ray.origin_mm = ray.origin_mm.unaryExpr(single).eval();
    ray.direction = ray.direction.unaryExpr(single).eval();
    ray.sigma_rad = single(ray.sigma_rad);
  }
  return cloud;
}

absl::StatusOr<CloudTargets> TargetsFromPly(const Ply& ply, const std::string& path,
                                            const Template& garment) {
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(ply, "vertex", path));
  if (vertex->Find("template_vertex")) return TargetsByVertex(*vertex, path, garment);
  if (!vertex->Find("board_row")) {
    return absl::InvalidArgumentError(
        absl::StrCat(path,
                     ": its points have neither board_row and board_col nor template_vertex; is it the "
                     "cloud.ply of a registration?"));
  }
  WEFT_ASSIGN_OR_RETURN(Cloud cloud, CloudFromElement(*vertex, path));
  WEFT_RETURN_IF_ERROR(SortByNode(cloud, path));
  WEFT_ASSIGN_OR_RETURN(cloud.rays, RaysFromPly(ply, path));
  return TargetsFromCloud(garment, cloud);
}

}  // namespace weft

#include "services/formats/pcd/pcl_convert.h"

#include <pcl/PCLPointCloud2.h>
#include <pcl/common/io.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

using PclType = pcl::PCLPointField;

constexpr std::array<std::pair<PlyType, uint8_t>, 8> kTypes = {{
    {PlyType::kInt8, PclType::INT8},
    {PlyType::kUint8, PclType::UINT8},
    {PlyType::kInt16, PclType::INT16},
    {PlyType::kUint16, PclType::UINT16},
    {PlyType::kInt32, PclType::INT32},
    {PlyType::kUint32, PclType::UINT32},
    {PlyType::kFloat32, PclType::FLOAT32},
    {PlyType::kFloat64, PclType::FLOAT64},
}};

constexpr std::array<std::pair<const char*, const char*>, 3> kNormals = {
    {{"nx", "normal_x"}, {"ny", "normal_y"}, {"nz", "normal_z"}}};

std::string PlyNameOf(const std::string& field) {
  for (const auto& [ply, pcd] : kNormals) {
    if (field == pcd) return ply;
  }
  return field;
}

std::string PcdNameOf(const std::string& property) {
  for (const auto& [ply, pcd] : kNormals) {
    if (property == ply) return pcd;
  }
  return property;
}

// None for types that PLY lacks.
std::optional<PlyType> PlyTypeOf(uint8_t type) {
  for (const auto& [ply, pcd] : kTypes) {
    if (type == pcd) return ply;
  }
  return std::nullopt;
}

uint8_t PclTypeOf(PlyType type) {
  for (const auto& [ply, pcd] : kTypes) {
    if (type == ply) return pcd;
  }
  return PclType::FLOAT64;
}

// Calls `with` with a number of the type.
template <typename With>
void WithType(PlyType type, const With& with) {
  switch (type) {
    case PlyType::kInt8:
      return with(int8_t{});
    case PlyType::kUint8:
      return with(uint8_t{});
    case PlyType::kInt16:
      return with(int16_t{});
    case PlyType::kUint16:
      return with(uint16_t{});
    case PlyType::kInt32:
      return with(int32_t{});
    case PlyType::kUint32:
      return with(uint32_t{});
    case PlyType::kFloat32:
      return with(float{});
    case PlyType::kFloat64:
      return with(double{});
  }
}

// The numbers of one field, of all points.
std::vector<double> ValuesOf(const pcl::PCLPointCloud2& cloud, const PclType& field, PlyType type) {
  std::vector<double> values;
  const size_t points = static_cast<size_t>(cloud.width) * cloud.height;
  values.reserve(points);
  WithType(type, [&]<typename Number>(Number value) {
    for (size_t i = 0; i < points; ++i) {
      std::memcpy(&value, cloud.data.data() + i * cloud.point_step + field.offset, sizeof(value));
      values.push_back(static_cast<double>(value));
    }
  });
  return values;
}

// What PCL read fits together: its readers do not check all of it.
absl::Status CheckLayout(const pcl::PCLPointCloud2& cloud) {
  const size_t points = static_cast<size_t>(cloud.width) * cloud.height;
  bool fits = cloud.data.size() / std::max<size_t>(1, cloud.point_step) >= points;
  for (const PclType& field : cloud.fields) {
    const auto bytes = static_cast<size_t>(std::max(0, pcl::getFieldSize(field.datatype))) * field.count;
    fits = fits && field.offset + bytes <= cloud.point_step;
  }
  if (fits) return absl::OkStatus();
  return absl::InvalidArgumentError("its fields do not fit its points; is the file damaged?");
}

}  // namespace

absl::StatusOr<Ply> PlyFromPcdFile(const std::string& path) {
  pcl::PCLPointCloud2 cloud;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  if (pcl::PCDReader().read(path, cloud, origin, orientation, version) < 0) {
    return absl::InvalidArgumentError("");
  }
  WEFT_RETURN_IF_ERROR(CheckLayout(cloud));
  PlyElement vertex;
  vertex.name = "vertex";
  vertex.rows = static_cast<size_t>(cloud.width) * cloud.height;
  for (const PclType& field : cloud.fields) {
    const std::optional<PlyType> type = PlyTypeOf(field.datatype);
    const std::string name = PlyNameOf(field.name);
    if (!type || field.count != 1 || vertex.Find(name)) continue;
    vertex.properties.push_back(PlyColumn(name, *type, ValuesOf(cloud, field, *type)));
  }
  for (const char* axis : {"x", "y", "z"}) {
    if (!vertex.Find(axis)) return absl::InvalidArgumentError(absl::StrCat("has no field ", axis));
  }
  Ply ply;
  ply.elements.push_back(std::move(vertex));
  return ply;
}

absl::StatusOr<std::string> PcdFromPly(const Ply& ply) {
  const PlyElement* vertex = ply.Find("vertex");
  if (!vertex) return absl::InvalidArgumentError("has no element vertex");
  pcl::PCLPointCloud2 cloud;
  cloud.width = static_cast<uint32_t>(vertex->rows);
  cloud.height = 1;
  std::vector<const PlyProperty*> columns;
  for (const PlyProperty& property : vertex->properties) {
    if (property.is_list) continue;
    pcl::PCLPointField& field = cloud.fields.emplace_back();
    field.name = PcdNameOf(property.name);
    field.offset = cloud.point_step;
    field.datatype = PclTypeOf(property.type);
    field.count = 1;
    cloud.point_step += static_cast<uint32_t>(pcl::getFieldSize(field.datatype));
    columns.push_back(&property);
  }
  cloud.row_step = cloud.point_step * cloud.width;
  std::string bytes =
      pcl::PCDWriter().generateHeaderBinary(cloud, Eigen::Vector4f::Zero(), Eigen::Quaternionf::Identity());
  bytes += "DATA binary\n";
  const size_t data_at = bytes.size();
  bytes.resize(data_at + vertex->rows * cloud.point_step);
  for (size_t c = 0; c < columns.size(); ++c) {
    WithType(columns[c]->type, [&]<typename Number>(Number value) {
      char* at = bytes.data() + data_at + cloud.fields[c].offset;
      for (const double number : columns[c]->values) {
        value = static_cast<Number>(number);
        std::memcpy(at, &value, sizeof(value));
        at += cloud.point_step;
      }
    });
  }
  return bytes;
}

}  // namespace weft

#include "services/server/console/quantized_mesh.h"

#include <meshoptimizer.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "alignment/mesh.h"
#include "base/status_macros.h"
#include "services/formats/files/little_endian.h"
#include "services/formats/files/ply_header.h"
#include "services/formats/files/ply_value.h"

namespace weft {
namespace {

constexpr char kMagic[] = "weftmsh1";
constexpr bool kSwap = std::endian::native != std::endian::little;  // files are little-endian
constexpr double kSteps = 65535;
constexpr double kLeastStep_mm = 0.005;           // less would only carry noise
constexpr double kMostState = 3;                  // that its two bits hold
constexpr int kVertexCodec = 0, kIndexCodec = 1;  // those that every decoder of the last years reads
constexpr uint32_t kMostRows = 1u << 28;
constexpr double kLeastSigma_mm = 0.001, kStepsOfAnOctave = 16;

struct Quantized {
  uint16_t position[3];
  uint8_t state_and_views;
  uint8_t sigma;
};
static_assert(sizeof(Quantized) == 8);

// Where a value is within the rows of the vertices.
struct Column {
  size_t offset = 0;
  PlyType type = PlyType::kUint8;
};

// What is read of a vertex.
enum Part : uint8_t { kX, kY, kZ, kState, kSigma, kViews, kParts };
constexpr std::array<const char*, kParts> kNames = {"x", "y", "z", "state", "sigma_mm", "views"};

// Where the parts of a mesh.ply are in its bytes.
struct Layout {
  PlyHeader header;
  size_t rows = 0, row_bytes = 0;
  std::array<Column, kParts> columns;

  size_t vertices_end() const { return header.body_begin + rows * row_bytes; }
};

absl::Status Wrong(const std::string& source_name, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
}

absl::Status FindColumns(const PlyElement& vertex, const std::string& source_name, Layout& layout) {
  std::array<bool, kParts> found = {};
  for (const PlyProperty& property : vertex.properties) {
    if (property.is_list) return Wrong(source_name, "a vertex has a list; write the mesh with weft");
    for (size_t part = 0; part < kParts; ++part) {
      if (property.name != kNames[part]) continue;
      layout.columns[part] = {layout.row_bytes, property.type};
      found[part] = true;
    }
    layout.row_bytes += static_cast<size_t>(PlyTypeSize(property.type));
  }
  for (size_t part = 0; part < kParts; ++part)
    if (!found[part]) return Wrong(source_name, absl::StrCat("vertices have no ", kNames[part]));
  return absl::OkStatus();
}

absl::StatusOr<Layout> LayoutOf(std::string_view ply, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(PlyHeader header, ParsePlyHeader(ply, source_name));
  Layout layout;
  layout.header = std::move(header);
  const std::vector<PlyElement>& elements = layout.header.layout.elements;
  if (layout.header.format != PlyFormat::kLittleEndian || elements.empty() || elements[0].name != "vertex")
    return Wrong(source_name, "not a mesh of a job: binary little-endian with vertices first is asked for");
  layout.rows = elements[0].rows;
  if (layout.rows == 0 || layout.rows > kMostRows)
    return Wrong(source_name, absl::StrCat(layout.rows, " vertices cannot be shown"));
  WEFT_RETURN_IF_ERROR(FindColumns(elements[0], source_name, layout));
  return layout;
}

uint8_t SigmaByte(double sigma_mm) {
  if (!std::isfinite(sigma_mm)) return 255;
  const double steps = kStepsOfAnOctave * std::log2(std::max(sigma_mm, kLeastSigma_mm) / kLeastSigma_mm);
  return static_cast<uint8_t>(std::lround(std::clamp(steps, 0.0, 254.0)));
}

// What is no number counts as 0.
uint8_t SmallNumber(double value, double most) {
  return static_cast<uint8_t>(value > 0 ? std::min(value, most) : 0);
}

// The frame of the quantised positions.
struct Grid {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), step_mm = Eigen::Vector3d::Ones();
  double coordinate_error_mm = 0, distance_mm = 0;
};

class VertexReader {
 public:
  VertexReader(std::string_view ply, const Layout& layout)
      : layout_(layout), rows_(ply.data() + layout.header.body_begin) {}

  double Value(size_t row, Part part) const {
    const Column& column = layout_.columns[part];
    return LoadPlyValue(column.type, rows_ + row * layout_.row_bytes + column.offset, kSwap);
  }
  Eigen::Vector3d Position(size_t row) const { return {Value(row, kX), Value(row, kY), Value(row, kZ)}; }

 private:
  const Layout& layout_;
  const char* rows_;
};

absl::StatusOr<Grid> GridOf(const VertexReader& reader, size_t rows, const std::string& source_name) {
  Eigen::Vector3d low = reader.Position(0), high = low;
  for (size_t row = 0; row < rows; ++row) {
    const Eigen::Vector3d p = reader.Position(row);
    // Far beyond any studio, and still exact enough in single precision.
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e9)
      return Wrong(source_name, absl::StrCat("vertex ", row, " is nowhere"));
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  return Grid{low, ((high - low) / kSteps).cwiseMax(kLeastStep_mm), 0, 0};
}

Quantized QuantizedVertex(const VertexReader& reader, size_t row, Grid& grid) {
  Quantized vertex = {};
  const Eigen::Vector3d p = reader.Position(row);
  Eigen::Vector3d shown;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = std::clamp((p[axis] - grid.low[axis]) / grid.step_mm[axis], 0.0, kSteps);
    vertex.position[axis] = static_cast<uint16_t>(std::lround(steps));
    shown[axis] = grid.low[axis] + grid.step_mm[axis] * vertex.position[axis];
  }
  grid.coordinate_error_mm = std::max(grid.coordinate_error_mm, (shown - p).cwiseAbs().maxCoeff());
  grid.distance_mm = std::max(grid.distance_mm, (shown - p).norm());
  const bool is_driven = reader.Value(row, kState) > static_cast<double>(VertexState::kBridged);
  const uint8_t state = SmallNumber(reader.Value(row, kState), kMostState);
  const uint8_t views = SmallNumber(reader.Value(row, kViews) + (is_driven ? 1 : 0), 63);
  vertex.state_and_views = static_cast<uint8_t>(state | views << 2);
  vertex.sigma = SigmaByte(reader.Value(row, kSigma));
  return vertex;
}

// Reads the lists of the faces one after another, whatever else their rows have.
class FaceReader {
 public:
  FaceReader(std::string_view bytes, const PlyElement& face, size_t vertices)
      : bytes_(bytes), face_(face), vertices_(vertices) {}

  absl::StatusOr<std::vector<uint32_t>> Read(const std::string& source_name) {
    std::vector<uint32_t> indices;
    for (size_t row = 0; row < face_.rows; ++row) {
      const size_t before = indices.size();
      for (const PlyProperty& property : face_.properties) {
        const bool fits = ReadProperty(property, indices);
        if (!fits) return Wrong(source_name, absl::StrCat("face ", row, " is cut off or names no vertex"));
      }
      if (indices.size() != before + 3)
        return Wrong(source_name, absl::StrCat("face ", row, " is no triangle"));
    }
    return indices;
  }

 private:
  // False: the bytes end before, or an index is none.
  bool ReadProperty(const PlyProperty& property, std::vector<uint32_t>& indices) {
    double count = 1;
    if (property.is_list && !TakeValue(property.count_type, count)) return false;
    const auto size = static_cast<size_t>(PlyTypeSize(property.type));
    if (count < 0 || count * static_cast<double>(size) > static_cast<double>(bytes_.size())) return false;
    const bool is_index =
        property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
    if (!is_index) {
      bytes_.remove_prefix(static_cast<size_t>(count) * size);
      return true;
    }
    for (double i = 0; i < count; ++i) {
      double index = 0;
      if (!TakeValue(property.type, index) || !(index >= 0) || index >= static_cast<double>(vertices_))
        return false;
      indices.push_back(static_cast<uint32_t>(index));
    }
    return true;
  }
  bool TakeValue(PlyType type, double& value) {
    const auto size = static_cast<size_t>(PlyTypeSize(type));
    if (bytes_.size() < size) return false;
    value = LoadPlyValue(type, bytes_.data(), kSwap);
    bytes_.remove_prefix(size);
    return true;
  }

  std::string_view bytes_;
  const PlyElement& face_;
  const size_t vertices_;
};

std::string EncodedVertices(const std::vector<Quantized>& vertices) {
  meshopt_encodeVertexVersion(kVertexCodec);
  std::string out(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(Quantized)), '\0');
  out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(),
                                        vertices.data(), vertices.size(), sizeof(Quantized)));
  return out;
}

std::string EncodedFaces(const std::vector<uint32_t>& indices, size_t vertices) {
  if (indices.empty()) return "";
  meshopt_encodeIndexVersion(kIndexCodec);
  std::string out(meshopt_encodeIndexBufferBound(indices.size(), vertices), '\0');
  out.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(),
                                       indices.data(), indices.size()));
  return out;
}

absl::StatusOr<std::vector<uint32_t>> FacesOf(std::string_view ply, const Layout& layout,
                                              const std::string& source_name) {
  const std::vector<PlyElement>& elements = layout.header.layout.elements;
  if (elements.size() < 2 || elements[1].name != "face")
    return Wrong(source_name, "no faces after the vertices");
  return FaceReader(ply.substr(layout.vertices_end()), elements[1], layout.rows).Read(source_name);
}

}  // namespace

absl::StatusOr<std::optional<size_t>> EndOfVertices(std::string_view ply, const std::string& source_name) {
  constexpr size_t kLongestHeader = 64 << 10;
  const bool is_whole = ply.substr(0, kLongestHeader).find("end_header\n") != std::string_view::npos;
  if (!is_whole && ply.size() < kLongestHeader) return std::nullopt;
  WEFT_ASSIGN_OR_RETURN(const Layout layout, LayoutOf(ply, source_name));
  return layout.vertices_end();
}

absl::StatusOr<std::string> QuantizedMesh(std::string_view ply, bool with_faces,
                                          const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const Layout layout, LayoutOf(ply, source_name));
  if (ply.size() < layout.vertices_end()) return Wrong(source_name, "the vertices are cut off");
  const VertexReader reader(ply, layout);
  WEFT_ASSIGN_OR_RETURN(Grid grid, GridOf(reader, layout.rows, source_name));
  std::vector<Quantized> vertices(layout.rows);
  for (size_t row = 0; row < layout.rows; ++row) vertices[row] = QuantizedVertex(reader, row, grid);
  absl::StatusOr<std::vector<uint32_t>> indices = std::vector<uint32_t>();
  if (with_faces) indices = FacesOf(ply, layout, source_name);
  if (!indices.ok()) return indices.status();
  const std::string points = EncodedVertices(vertices), faces = EncodedFaces(*indices, vertices.size());

  std::string out = kMagic;
  for (const size_t count : {vertices.size(), indices->size() / 3, points.size(), faces.size()})
    PutLittleEndian(static_cast<uint32_t>(count), out);
  for (const double step : grid.step_mm) PutLittleEndian(step, out);
  for (const double low : grid.low) PutLittleEndian(low, out);
  PutLittleEndian(grid.coordinate_error_mm, out);
  PutLittleEndian(grid.distance_mm, out);
  return out + points + faces;
}

}  // namespace weft

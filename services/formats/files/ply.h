// PLY files with any elements and properties. Written here because no Debian library reads big-endian files
// with arbitrary scalar and list properties and says what is wrong with a broken one.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

enum class PlyType : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
std::string_view PlyTypeName(PlyType type);  // "char" ... "double"

// One column of an element. Every PLY number is exact as a double.
struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of lists
  std::vector<double> values;            // scalars: [rows]; lists: the lists of all rows, one after another
  std::vector<size_t> list_start;        // of lists: [rows + 1], row r is values[start[r] .. start[r + 1])
};

// A table: `rows` rows of every property.
struct PlyElement {
  std::string name;
  size_t rows = 0;
  std::vector<PlyProperty> properties;

  // In other case where none is of that name and one alone differs so. Null where there is none.
  const PlyProperty* Find(std::string_view property) const;
};

struct Ply {
  std::vector<std::string> comments;
  std::vector<PlyElement> elements;

  // As PlyElement::Find.
  const PlyElement* Find(std::string_view element) const;
};

// Parses ascii, binary little-endian and binary big-endian PLY. Memory is bounded by the size of `bytes`:
// what a header announces and the data do not hold is an error before anything is allocated for it.
// InvalidArgument names source_name and, where it applies, element, row and property.
absl::StatusOr<Ply> ParsePly(std::string_view bytes, const std::string& source_name);
absl::StatusOr<Ply> ReadPly(const std::string& path, uint64_t max_bytes = uint64_t{4} << 30);

// Binary little-endian. InvalidArgument names the property whose column has another length than the element,
// or a value that its type cannot hold.
absl::StatusOr<std::string> SerializePly(const Ply& ply);
absl::Status WritePly(const std::string& path, const Ply& ply);

// Columns for writing.
PlyProperty PlyColumn(std::string name, PlyType type, std::vector<double> values);

// One of what `value_of` says of each row.
template <typename Rows, typename ValueOf>
PlyProperty PlyColumn(std::string name, PlyType type, const Rows& rows, const ValueOf& value_of) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const auto& row : rows) values.push_back(static_cast<double>(value_of(row)));
  return PlyColumn(std::move(name), type, std::move(values));
}

// One for each axis of vectors.
template <typename Vectors>
void AddPlyColumns(std::initializer_list<const char*> names, PlyType type, const Vectors& vectors,
                   PlyElement& element) {
  for (int axis = 0; const char* name : names) {
    element.properties.push_back(
        PlyColumn(name, type, vectors, [axis](const auto& vector) { return vector[axis]; }));
    ++axis;
  }
}

}  // namespace weft

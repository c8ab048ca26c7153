#include "services/files/ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/ply_header.h"
#include "services/files/ply_value.h"

namespace weft {
namespace {

// A value of type T from bytes of the other or of this machine's order.
template <typename T>
bool Store(double value, std::string& out) {
  if constexpr (std::is_integral_v<T>) {
    if (!(value >= std::numeric_limits<T>::lowest() && value <= std::numeric_limits<T>::max())) return false;
    if (value != std::floor(value)) return false;
  } else if constexpr (std::is_same_v<T, float>) {
    if (std::isfinite(value) && std::abs(value) > std::numeric_limits<float>::max()) return false;
  }
  const T typed = static_cast<T>(value);
  char raw[sizeof(T)];
  std::memcpy(raw, &typed, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw, raw + sizeof(T));
  out.append(raw, sizeof(T));
  return true;
}

bool StoreValue(PlyType type, double value, std::string& out) {
  switch (type) {
    case PlyType::kInt8:
      return Store<int8_t>(value, out);
    case PlyType::kUint8:
      return Store<uint8_t>(value, out);
    case PlyType::kInt16:
      return Store<int16_t>(value, out);
    case PlyType::kUint16:
      return Store<uint16_t>(value, out);
    case PlyType::kInt32:
      return Store<int32_t>(value, out);
    case PlyType::kUint32:
      return Store<uint32_t>(value, out);
    case PlyType::kFloat32:
      return Store<float>(value, out);
    case PlyType::kFloat64:
      return Store<double>(value, out);
  }
  return false;
}

// Takes one value after another from the body.
class BodyReader {
 public:
  BodyReader(std::string_view body, PlyFormat format)
      : rest_(body),
        ascii_(format == PlyFormat::kAscii),
        swap_((format == PlyFormat::kBigEndian) != (std::endian::native == std::endian::big)) {}

  // The least bytes that a row of the element takes.
  size_t LeastRowBytes(const PlyElement& element) const {
    size_t bytes = 0;
    for (const PlyProperty& p : element.properties) {
      bytes += ascii_ ? 2 : PlyTypeSize(p.is_list ? p.count_type : p.type);
    }
    return bytes;
  }
  // The most values of a type that the rest can hold; the last ascii value may lack its separator.
  size_t MostValues(PlyType type) const {
    return ascii_ ? rest_.size() / 2 + 1 : rest_.size() / PlyTypeSize(type);
  }
  // The most rows of that size that the rest can hold.
  size_t MostRows(size_t row_bytes) const { return (rest_.size() + (ascii_ ? 1 : 0)) / row_bytes; }
  size_t rest_bytes() const { return rest_.size(); }

  // Empty when done, otherwise what is wrong.
  std::string Take(PlyType type, double& value) {
    return ascii_ ? TakeWord(type, value) : TakeBinary(type, value);
  }

 private:
  std::string TakeBinary(PlyType type, double& value) {
    const size_t bytes = static_cast<size_t>(PlyTypeSize(type));
    if (rest_.size() < bytes) return "the file ends here, it is truncated";
    value = LoadPlyValue(type, rest_.data(), swap_);
    rest_.remove_prefix(bytes);
    return "";
  }

  std::string TakeWord(PlyType type, double& value) {
    const auto space = [](char c) { return absl::ascii_isspace(static_cast<unsigned char>(c)); };
    const size_t begin = std::find_if_not(rest_.begin(), rest_.end(), space) - rest_.begin();
    rest_.remove_prefix(begin);
    const size_t length = std::find_if(rest_.begin(), rest_.end(), space) - rest_.begin();
    if (length == 0) return "the file ends here, it is truncated";
    const absl::string_view word(rest_.data(), length);
    rest_.remove_prefix(length);
    if (!absl::SimpleAtod(word, &value)) return absl::StrCat("\"", word.substr(0, 40), "\" is not a number");
    std::string ignored;
    if (!StoreValue(type, value, ignored)) {
      return absl::StrCat("\"", word.substr(0, 40), "\" is no ", std::string(PlyTypeName(type)));
    }
    return "";
  }

  std::string_view rest_;
  bool ascii_;
  bool swap_;
};

std::string TakeRow(BodyReader& reader, PlyProperty& property) {
  double value = 0;
  if (!property.is_list) {
    const std::string problem = reader.Take(property.type, value);
    if (problem.empty()) property.values.push_back(value);
    return problem;
  }
  if (std::string problem = reader.Take(property.count_type, value); !problem.empty()) return problem;
  if (value < 0) return absl::StrCat("list length ", value, " is negative");
  if (value > static_cast<double>(reader.MostValues(property.type))) {
    return absl::StrCat("list length ", static_cast<uint64_t>(value),
                        " is more than the rest of the file holds");
  }
  for (auto left = static_cast<size_t>(value); left > 0; --left) {
    double item = 0;
    if (std::string problem = reader.Take(property.type, item); !problem.empty()) return problem;
    property.values.push_back(item);
  }
  property.list_start.push_back(property.values.size());
  return "";
}

absl::Status ReadElement(BodyReader& reader, const std::string& source_name, PlyElement& element) {
  const size_t row_bytes = reader.LeastRowBytes(element);
  if (row_bytes == 0 && element.rows == 0) return absl::OkStatus();
  if (row_bytes == 0) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": element ", element.name,
                                                   ": the header announces ", element.rows,
                                                   " rows, but no property of them; the file is damaged"));
  }
  if (element.rows > reader.MostRows(row_bytes)) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": element ", element.name, ": the header announces ", element.rows,
                     " rows, but only ", reader.rest_bytes(), " bytes follow; the file is truncated"));
  }
  for (PlyProperty& property : element.properties) {
    property.values.reserve(element.rows);
    if (property.is_list) {
      property.list_start.reserve(element.rows + 1);
      property.list_start.push_back(0);
    }
  }
  for (size_t row = 0; row < element.rows; ++row) {
    for (PlyProperty& property : element.properties) {
      const std::string problem = TakeRow(reader, property);
      if (problem.empty()) continue;
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": element ", element.name, ", row ", row,
                                                     ", property ", property.name, ": ", problem));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckColumn(const PlyElement& element, const PlyProperty& property) {
  const bool scalar_ok = !property.is_list && property.values.size() == element.rows;
  const bool list_ok = property.is_list && property.list_start.size() == element.rows + 1 &&
                       std::is_sorted(property.list_start.begin(), property.list_start.end()) &&
                       property.list_start.front() == 0 &&
                       property.list_start.back() == property.values.size();
  if (scalar_ok || list_ok) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("element ", element.name, ", property ", property.name, ": ",
                                                 property.values.size(), " values do not make ", element.rows,
                                                 " rows"));
}

bool StoreRow(const PlyProperty& property, size_t row, std::string& out) {
  if (!property.is_list) return StoreValue(property.type, property.values[row], out);
  const size_t begin = property.list_start[row], end = property.list_start[row + 1];
  bool ok = StoreValue(property.count_type, static_cast<double>(end - begin), out);
  for (size_t i = begin; i < end; ++i) ok = ok && StoreValue(property.type, property.values[i], out);
  return ok;
}

}  // namespace

const PlyProperty* PlyElement::Find(std::string_view property) const {
  for (const PlyProperty& p : properties) {
    if (p.name == property) return &p;
  }
  return nullptr;
}

const PlyElement* Ply::Find(std::string_view element) const {
  for (const PlyElement& e : elements) {
    if (e.name == element) return &e;
  }
  return nullptr;
}

absl::StatusOr<Ply> ParsePly(std::string_view bytes, const std::string& source_name) {
  absl::StatusOr<PlyHeader> header = ParsePlyHeader(bytes, source_name);
  if (!header.ok()) return header.status();
  BodyReader reader(bytes.substr(header->body_begin), header->format);
  for (PlyElement& element : header->layout.elements) {
    if (absl::Status status = ReadElement(reader, source_name, element); !status.ok()) return status;
  }
  return std::move(header->layout);
}

absl::StatusOr<Ply> ReadPly(const std::string& path) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(path);
  if (!bytes.ok()) return bytes.status();
  return ParsePly(*bytes, path);
}

absl::StatusOr<std::string> SerializePly(const Ply& ply) {
  std::string out = WritePlyHeader(ply);
  for (const PlyElement& element : ply.elements) {
    for (const PlyProperty& property : element.properties) {
      if (absl::Status status = CheckColumn(element, property); !status.ok()) return status;
    }
    const size_t rows = element.properties.empty() ? 0 : element.rows;
    for (size_t row = 0; row < rows; ++row) {
      for (const PlyProperty& property : element.properties) {
        if (StoreRow(property, row, out)) continue;
        return absl::InvalidArgumentError(absl::StrCat("element ", element.name, ", row ", row, ", property ",
                                                       property.name, ": the value does not fit into ",
                                                       std::string(PlyTypeName(property.type))));
      }
    }
  }
  return out;
}

absl::Status WritePly(const std::string& path, const Ply& ply) {
  const absl::StatusOr<std::string> bytes = SerializePly(ply);
  if (!bytes.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", bytes.status().message()));
  return WriteFileAtomically(path, *bytes);
}

PlyProperty PlyColumn(std::string name, PlyType type, std::vector<double> values) {
  PlyProperty property;
  property.name = std::move(name);
  property.type = type;
  property.values = std::move(values);
  return property;
}

}  // namespace weft

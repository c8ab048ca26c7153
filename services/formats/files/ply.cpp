#include "services/formats/files/ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/ply_header.h"
#include "services/formats/files/ply_value.h"

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

  // Numbers on the rest of this line; of text only.
  size_t WordsOnLine() const {
    const std::string_view line = rest_.substr(0, rest_.find_first_of("\r\n"));
    size_t words = 0;
    for (size_t i = 0; i < line.size(); ++i) words += !IsSpace(line[i]) && (i == 0 || IsSpace(line[i - 1]));
    return words;
  }
  // Goes to the next line that is not blank; of text only.
  void SkipBlank() { rest_.remove_prefix(std::ranges::find_if_not(rest_, IsSpace) - rest_.begin()); }
  bool is_text() const { return ascii_; }

  // Whether nothing follows but what programs put at the end of a file.
  bool IsAtEnd() const {
    return std::ranges::all_of(rest_, [](char c) { return IsSpace(c) || c == '\0'; });
  }

  // Empty when done, otherwise what is wrong.
  std::string Take(PlyType type, double& value) {
    return ascii_ ? TakeWord(type, value) : TakeBinary(type, value);
  }

 private:
  static bool IsSpace(char c) { return absl::ascii_isspace(static_cast<unsigned char>(c)); }

  std::string TakeBinary(PlyType type, double& value) {
    const size_t bytes = static_cast<size_t>(PlyTypeSize(type));
    if (rest_.size() < bytes) return "the file ends here, it is truncated";
    value = LoadPlyValue(type, rest_.data(), swap_);
    rest_.remove_prefix(bytes);
    return "";
  }

  std::string TakeWord(PlyType type, double& value) {
    SkipBlank();
    const size_t length = std::ranges::find_if(rest_, IsSpace) - rest_.begin();
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

// Text has a row a line. Where the first row is a line, every one is: a number too many or too few would
// shift all that follow. Some programs put several rows on a line, or break rows, from the first on.
class RowLines {
 public:
  RowLines(BodyReader& reader, const PlyElement& element)
      : reader_(reader), element_(element), columns_(element.properties.size()) {
    for (const PlyProperty& property : element.properties) has_list_ |= property.is_list;
  }

  void BeginRow(size_t row) {
    if (!reader_.is_text() || (row > 0 && !is_line_)) return;
    reader_.SkipBlank();
    words_ = reader_.WordsOnLine();
  }
  // Empty, or what is wrong with the row that was read and has so many numbers.
  std::string EndRow(size_t row, size_t numbers) {
    if (!reader_.is_text()) return "";
    if (row == 0) {
      shares_line_ = !has_list_ && words_ > numbers && words_ % columns_ == 0;
      is_line_ = words_ >= numbers && !shares_line_;
    }
    if (is_line_ && words_ != numbers) return Problem(words_, numbers);
    if (!shares_line_ || row + 1 < element_.rows) return "";
    // Lines that go on in the same way have columns that the header leaves out, not several rows.
    if (reader_.WordsOnLine() > 0) return Problem(words_, numbers);
    reader_.SkipBlank();
    return reader_.WordsOnLine() == words_ ? Problem(words_, numbers) : "";
  }

 private:
  static std::string Problem(size_t words, size_t numbers) {
    return absl::StrCat("has ", words, " numbers on its line, the properties of the header make ", numbers,
                        words > numbers ? "; declare all columns in the header, or remove them" : "");
  }

  BodyReader& reader_;
  const PlyElement& element_;
  const size_t columns_;
  bool has_list_ = false, is_line_ = false, shares_line_ = false;
  size_t words_ = 0;  // on the line of this row, or of the first one
};

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
  RowLines lines(reader, element);
  for (size_t row = 0; row < element.rows; ++row) {
    lines.BeginRow(row);
    const auto where = [&] { return absl::StrCat(source_name, ": element ", element.name, ", row ", row); };
    size_t numbers = 0;
    for (PlyProperty& property : element.properties) {
      const size_t before = property.values.size();
      const std::string problem = TakeRow(reader, property);
      if (!problem.empty())
        return absl::InvalidArgumentError(absl::StrCat(where(), ", property ", property.name, ": ", problem));
      numbers += property.values.size() - before + property.is_list;
    }
    if (const std::string problem = lines.EndRow(row, numbers); !problem.empty())
      return absl::InvalidArgumentError(absl::StrCat(where(), ": ", problem));
  }
  return absl::OkStatus();
}

absl::Status CheckColumn(const PlyElement& element, const PlyProperty& property) {
  const bool scalar_ok = !property.is_list && property.values.size() == element.rows;
  const bool list_ok = property.is_list && property.list_start.size() == element.rows + 1 &&
                       std::ranges::is_sorted(property.list_start) && property.list_start.front() == 0 &&
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

// Some programs write names in capitals.
template <typename T>
const T* Named(const std::vector<T>& all, std::string_view name) {
  const T* found = nullptr;
  int in_other_case = 0;
  for (const T& one : all) {
    if (one.name == name) return &one;
    if (!absl::EqualsIgnoreCase(one.name, absl::string_view(name.data(), name.size()))) continue;
    found = &one;
    ++in_other_case;
  }
  return in_other_case == 1 ? found : nullptr;
}

}  // namespace

const PlyProperty* PlyElement::Find(std::string_view property) const { return Named(properties, property); }

const PlyElement* Ply::Find(std::string_view element) const { return Named(elements, element); }

absl::StatusOr<Ply> ParsePly(std::string_view bytes, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(PlyHeader header, ParsePlyHeader(bytes, source_name));
  BodyReader reader(bytes.substr(header.body_begin), header.format);
  for (PlyElement& element : header.layout.elements) {
    WEFT_RETURN_IF_ERROR(ReadElement(reader, source_name, element));
  }
  if (!reader.IsAtEnd()) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", reader.rest_bytes(),
                                                   " bytes follow the last row that the header announces; ",
                                                   "it counts too few rows, or leaves out a property"));
  }
  return std::move(header.layout);
}

absl::StatusOr<Ply> ReadPly(const std::string& path, uint64_t max_bytes) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path, max_bytes));
  return ParsePly(bytes, path);
}

absl::StatusOr<std::string> SerializePly(const Ply& ply) {
  std::string out = WritePlyHeader(ply);
  for (const PlyElement& element : ply.elements) {
    for (const PlyProperty& property : element.properties) {
      WEFT_RETURN_IF_ERROR(CheckColumn(element, property));
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

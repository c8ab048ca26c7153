#include "services/formats/files/ply_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/formats/files/text_file.h"

namespace weft {
namespace {

struct TypeInfo {
  PlyType type;
  int bytes;
  std::string_view name, alias;
};

constexpr std::array<TypeInfo, 8> kTypes = {{
    {PlyType::kInt8, 1, "char", "int8"},
    {PlyType::kUint8, 1, "uchar", "uint8"},
    {PlyType::kInt16, 2, "short", "int16"},
    {PlyType::kUint16, 2, "ushort", "uint16"},
    {PlyType::kInt32, 4, "int", "int32"},
    {PlyType::kUint32, 4, "uint", "uint32"},
    {PlyType::kFloat32, 4, "float", "float32"},
    {PlyType::kFloat64, 8, "double", "float64"},
}};

constexpr size_t kMaxHeaderBytes = 1 << 20;
constexpr size_t kMaxElements = 64;
constexpr size_t kMaxProperties = 256;  // of an element

std::optional<PlyType> TypeFromName(std::string_view name) {
  for (const TypeInfo& info : kTypes) {
    if (name == info.name || name == info.alias) return info.type;
  }
  return std::nullopt;
}

template <typename T>
bool IsIn(const std::vector<T>& all, const std::string& name) {
  return std::ranges::any_of(all, [&](const T& one) { return one.name == name; });
}

// Reads the header line by line.
class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::string& source_name)
      : bytes_(bytes.substr(0, kMaxHeaderBytes)),
        source_name_(source_name),
        at_(bytes.size() - WithoutByteOrderMark(bytes).size()) {}

  absl::StatusOr<PlyHeader> Read() {
    if (!NextLine() || line_ != "ply") return Error("not a PLY file, it does not begin with \"ply\"");
    while (NextLine()) {
      if (line_ == "end_header") {
        if (!has_format_) return Error("the header has no format line");
        header_.body_begin = at_;
        return std::move(header_);
      }
      WEFT_RETURN_IF_ERROR(ReadLine());
    }
    return Error("the header has no end_header line; the file is truncated or not a PLY file");
  }

 private:
  // The first line says how lines end. A binary body may begin with the byte \n, so that a \r which ends the
  // first line alone ends the last one alone, too.
  bool NextLine() {
    if (number_ == 0) {
      const size_t end = bytes_.find_first_of("\r\n", at_);
      const bool is_cr = end != std::string_view::npos && bytes_[end] == '\r';
      if (is_cr && end + 1 < bytes_.size() && bytes_[end + 1] != '\n') line_end_ = '\r';
    }
    const size_t end = bytes_.find(line_end_, at_);
    if (end == std::string_view::npos) return false;
    const absl::string_view line(bytes_.data() + at_, end - at_);
    const absl::string_view stripped = absl::StripTrailingAsciiWhitespace(line);
    line_ = std::string_view(stripped.data(), stripped.size());
    at_ = end + 1;
    ++number_;
    return true;
  }

  absl::Status Error(const std::string& what) const {
    return absl::InvalidArgumentError(absl::StrCat(source_name_, ": header line ", number_, ": ", what));
  }

  absl::Status ReadLine() {
    const std::vector<std::string> words = absl::StrSplit(absl::string_view(line_.data(), line_.size()),
                                                          absl::ByAnyChar(" \t"), absl::SkipEmpty());
    if (words.empty()) return absl::OkStatus();
    // A line end of another kind than the first one, for instance.
    if (words[0] != "comment" &&
        std::ranges::any_of(line_, [](char c) { return absl::ascii_iscntrl(c) && c != '\t'; }))
      return Error("has a control character; do its lines end in one way?");
    if (words[0] == "comment") {
      const std::string_view text = line_.substr(line_.find("comment") + 7);
      header_.layout.comments.emplace_back(text.substr(text.empty() ? 0 : 1));
      return absl::OkStatus();
    }
    if (words[0] == "obj_info") return absl::OkStatus();
    if (words[0] == "format") return ReadFormat(words);
    if (words[0] == "element") return ReadElement(words);
    if (words[0] == "property") return ReadProperty(words);
    return Error(absl::StrCat("unknown keyword \"", words[0].substr(0, 40), "\""));
  }

  absl::Status ReadFormat(const std::vector<std::string>& words) {
    if (words.size() < 2) return Error("format names no encoding");
    if (words[1] == "ascii") {
      header_.format = PlyFormat::kAscii;
    } else if (words[1] == "binary_little_endian") {
      header_.format = PlyFormat::kLittleEndian;
    } else if (words[1] == "binary_big_endian") {
      header_.format = PlyFormat::kBigEndian;
    } else {
      return Error(absl::StrCat("unknown format \"", words[1].substr(0, 40),
                                "\"; expected ascii, binary_little_endian or binary_big_endian"));
    }
    has_format_ = true;
    return absl::OkStatus();
  }

  absl::Status ReadElement(const std::vector<std::string>& words) {
    uint64_t rows = 0;
    if (words.size() != 3 || !absl::SimpleAtoi(words[2], &rows))
      return Error("expected `element NAME COUNT`");
    if (header_.layout.elements.size() >= kMaxElements) return Error("too many elements");
    if (IsIn(header_.layout.elements, words[1]))
      return Error(absl::StrCat("element ", words[1], " occurs twice"));
    PlyElement element;
    element.name = words[1];
    element.rows = rows;
    header_.layout.elements.push_back(std::move(element));
    return absl::OkStatus();
  }

  absl::Status ReadProperty(const std::vector<std::string>& words) {
    if (header_.layout.elements.empty()) return Error("a property precedes the first element");
    PlyElement& element = header_.layout.elements.back();
    PlyProperty property;
    property.is_list = words.size() > 1 && words[1] == "list";
    if (words.size() != (property.is_list ? 5 : 3)) {
      return Error("expected `property TYPE NAME` or `property list COUNT_TYPE TYPE NAME`");
    }
    const std::optional<PlyType> type = TypeFromName(words[words.size() - 2]);
    const std::optional<PlyType> count = property.is_list ? TypeFromName(words[2]) : PlyType::kUint8;
    if (!type || !count || count == PlyType::kFloat32 || count == PlyType::kFloat64) {
      return Error(absl::StrCat("element ", element.name, ", property ", words.back(), ": unknown type"));
    }
    property.name = words.back();
    property.type = *type;
    property.count_type = *count;
    if (element.properties.size() >= kMaxProperties) return Error("too many properties");
    if (IsIn(element.properties, property.name)) {
      return Error(absl::StrCat("element ", element.name, ": property ", property.name, " occurs twice"));
    }
    element.properties.push_back(std::move(property));
    return absl::OkStatus();
  }

  std::string_view bytes_;
  std::string source_name_;
  std::string_view line_;
  size_t at_;
  char line_end_ = '\n';
  int number_ = 0;
  bool has_format_ = false;
  PlyHeader header_;
};

}  // namespace

std::string_view PlyTypeName(PlyType type) { return kTypes[static_cast<size_t>(type)].name; }

int PlyTypeSize(PlyType type) { return kTypes[static_cast<size_t>(type)].bytes; }

absl::StatusOr<PlyHeader> ParsePlyHeader(std::string_view bytes, const std::string& source_name) {
  return HeaderReader(bytes, source_name).Read();
}

std::string WritePlyHeader(const Ply& ply) {
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : ply.comments) absl::StrAppend(&out, "comment ", comment, "\n");
  for (const PlyElement& element : ply.elements) {
    absl::StrAppend(&out, "element ", element.name, " ", element.rows, "\n");
    for (const PlyProperty& property : element.properties) {
      absl::StrAppend(&out, "property ");
      if (property.is_list)
        absl::StrAppend(&out, "list ", std::string(PlyTypeName(property.count_type)), " ");
      absl::StrAppend(&out, std::string(PlyTypeName(property.type)), " ", property.name, "\n");
    }
  }
  return out + "end_header\n";
}

}  // namespace weft

#include "services/formats/files/observations_file.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/text_file.h"

namespace weft {
namespace {

constexpr std::string_view kHeader = "image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px";
constexpr size_t kColumns = 8;
// Of files up to version 0.1.2, without sigma_px.
constexpr std::string_view kOldHeader = kHeader.substr(0, kHeader.rfind(','));
constexpr size_t kOldColumns = kColumns - 1;

std::string Quoted(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  return absl::StrCat("\"", absl::StrReplaceAll(field, {{"\"", "\"\""}}), "\"");
}

// As std::to_chars writes it. That finds exact decimals, which takes several times as long; an integer has
// the same digits, except where the next one is near 5.
void AppendFixed(double value, int digits, std::string& out) {
  constexpr double kScales[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5};
  constexpr double kLargest = 1e9, kNear = 1e-6;  // so that products are far more precise than kNear
  const double scaled = std::abs(value) * kScales[digits], whole = std::floor(scaled);
  if (scaled < kLargest && std::abs(scaled - whole - 0.5) > kNear) {
    char text[16];
    char* first = text + sizeof(text);
    auto rest = static_cast<uint32_t>(whole) + (scaled - whole > 0.5 ? 1 : 0);
    for (int k = 0; k <= digits || rest > 0; ++k) {
      if (k == digits && digits > 0) *--first = '.';
      *--first = static_cast<char>('0' + rest % 10);
      rest /= 10;
    }
    if (std::signbit(value)) *--first = '-';
    out.append(first, text + sizeof(text));
    return;
  }
  char buffer[400];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::fixed, digits);
  out.append(buffer, end.ptr);
}

// Takes the next line with its quoted fields; a quoted field may hold line breaks.
bool NextFields(std::string_view& rest, std::vector<std::string>& fields, int& line) {
  fields.assign(1, "");
  if (rest.empty()) return false;
  ++line;
  bool quoted = false;
  size_t i = 0;
  for (; i < rest.size(); ++i) {
    const char c = rest[i];
    if (c == '"') {
      if (quoted && i + 1 < rest.size() && rest[i + 1] == '"') {
        fields.back() += '"';
        ++i;
      } else {
        quoted = !quoted;
      }
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c == '\n' && !quoted) {
      break;
    } else if (c != '\r' || quoted) {
      if (c == '\n') ++line;
      fields.back() += c;
    }
  }
  rest.remove_prefix(std::min(i + 1, rest.size()));
  return true;
}

// Empty when the fields make an observation, otherwise what is wrong.
std::string ParseFields(const std::vector<std::string>& fields, size_t columns, Observation& observation) {
  if (fields.size() != columns) return absl::StrCat("has ", fields.size(), " columns, expected ", columns);
  double confidence = 0, sigma_px = 0;
  if (!absl::SimpleAtod(fields[1], &observation.x_px) || !std::isfinite(observation.x_px))
    return absl::StrCat("x_px \"", fields[1], "\" is not a number");
  if (!absl::SimpleAtod(fields[2], &observation.y_px) || !std::isfinite(observation.y_px))
    return absl::StrCat("y_px \"", fields[2], "\" is not a number");
  if (!absl::SimpleAtoi(fields[3], &observation.node.row) || observation.node.row < 0)
    return absl::StrCat("board_row \"", fields[3], "\" is not a row");
  if (!absl::SimpleAtoi(fields[4], &observation.node.col) || observation.node.col < 0)
    return absl::StrCat("board_col \"", fields[4], "\" is not a column");
  if (fields[5] != "center" && fields[5] != "corner")
    return absl::StrCat("kind \"", fields[5], "\" is neither center nor corner");
  if (!absl::SimpleAtod(fields[6], &confidence) || !(confidence >= 0 && confidence <= 1))
    return absl::StrCat("confidence \"", fields[6], "\" is not between 0 and 1");
  if (columns == kColumns &&
      (!absl::SimpleAtod(fields[7], &sigma_px) || !(sigma_px >= 0) || !std::isfinite(sigma_px)))
    return absl::StrCat("sigma_px \"", fields[7], "\" is not a standard deviation");
  observation.sigma_px = static_cast<float>(sigma_px);
  observation.node.kind = fields[5] == "center" ? NodeKind::kCenter : NodeKind::kCorner;
  observation.confidence = static_cast<float>(confidence);
  return "";
}

}  // namespace

std::string ObservationLines(const ImageObservations& image) {
  std::string out;
  const std::string name = Quoted(image.image);
  for (const Observation& o : image.observations) {
    out += name;
    out += ',';
    AppendFixed(o.x_px, 4, out);
    out += ',';
    AppendFixed(o.y_px, 4, out);
    absl::StrAppend(&out, ",", o.node.row, ",", o.node.col,
                    o.node.kind == NodeKind::kCenter ? ",center," : ",corner,");
    AppendFixed(o.confidence, 5, out);
    out += ',';
    AppendFixed(o.sigma_px, 5, out);
    out += '\n';
  }
  return out;
}

std::string ObservationsCsv(const std::vector<std::string>& lines_of_images) {
  std::string out(kHeader);
  out += '\n';
  for (const std::string& lines : lines_of_images) out += lines;
  return out;
}

std::string ObservationsToCsv(const std::vector<ImageObservations>& images) {
  std::vector<std::string> lines;
  for (const ImageObservations& image : images) lines.push_back(ObservationLines(image));
  return ObservationsCsv(lines);
}

absl::Status WriteObservations(const std::string& path, const std::vector<ImageObservations>& images) {
  return WriteFileAtomically(path, ObservationsToCsv(images));
}

absl::StatusOr<std::vector<ImageObservations>> ParseObservations(std::string_view csv,
                                                                 const std::string& source_name) {
  std::vector<ImageObservations> images;
  std::unordered_map<std::string, size_t> index_of;
  std::vector<std::string> fields;
  int line = 0;
  std::string_view rest = csv;
  const std::string_view header = rest.substr(0, rest.find_first_of("\r\n"));
  const bool is_old = header == kOldHeader;
  if (header != kHeader && !is_old) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": line 1: expected the columns ", std::string(kHeader)));
  }
  NextFields(rest, fields, line);
  while (NextFields(rest, fields, line)) {
    if (fields.size() == 1 && fields[0].empty()) continue;
    Observation observation;
    if (const std::string problem = ParseFields(fields, is_old ? kOldColumns : kColumns, observation);
        !problem.empty()) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": line ", line, ": ", problem));
    }
    const auto [at, is_new] = index_of.try_emplace(fields[0], images.size());
    if (is_new) images.push_back({fields[0], {}});
    images[at->second].observations.push_back(observation);
  }
  return images;
}

absl::StatusOr<std::vector<ImageObservations>> ReadObservations(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string csv, ReadTextFile(path));
  return ParseObservations(csv, path);
}

}  // namespace weft

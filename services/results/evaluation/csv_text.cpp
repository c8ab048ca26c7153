#include "services/results/evaluation/csv_text.h"

#include <cmath>

#include "absl/strings/str_format.h"

namespace weft {

std::string CsvName(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

void AppendCsvNumber(const std::optional<double>& value, std::string& csv) {
  csv += ',';
  if (value && std::isfinite(*value)) absl::StrAppendFormat(&csv, "%.6g", *value);
}

}  // namespace weft

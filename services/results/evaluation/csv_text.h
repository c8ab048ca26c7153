// Fields of tables of comma-separated values.
#pragma once

#include <optional>
#include <string>

namespace weft {

// Quoted where a name would break the line.
std::string CsvName(const std::string& name);
// A comma and the number to six digits; the comma alone where there is none, or none that is finite.
void AppendCsvNumber(const std::optional<double>& value, std::string& csv);

}  // namespace weft

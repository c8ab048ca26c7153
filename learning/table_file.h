// Files of named tables, as avatars have them (space.bin; layout: docs/file-formats.md).
#pragma once

#include <map>
#include <string>
#include <vector>

namespace weft::learning {

struct NumberTable {
  size_t rows = 0, columns = 0;
  std::vector<float> values;  // [rows][columns]
};

// Throws std::runtime_error, naming the file, for what is no file of tables, ends within one, does not match
// its checksum or keeps a table in 16 bits.
std::map<std::string, NumberTable> ReadTables(const std::string& path);

// The bytes of such a file, in the order of the names.
std::string EncodeTables(const std::map<std::string, NumberTable>& tables);

}  // namespace weft::learning

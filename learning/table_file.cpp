#include "learning/table_file.h"

#include <xxhash.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>

namespace weft::learning {
namespace {

constexpr std::string_view kTablesMagic = "weftspc1";
constexpr uint8_t kFullBits = 32;

template <class T>
void PutNumber(T value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

std::map<std::string, NumberTable> ReadTables(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const auto bad = [&](const char* what) { return std::runtime_error(path + ": " + what); };
  if (!file || !bytes.starts_with(kTablesMagic)) throw bad("is no file of tables");
  if (bytes.size() < kTablesMagic.size() + sizeof(uint32_t) + sizeof(uint64_t))
    throw bad("ends within its head");
  std::string_view rest(bytes);
  rest.remove_suffix(sizeof(uint64_t));
  uint64_t told = 0;
  std::memcpy(&told, bytes.data() + rest.size(), sizeof(told));
  if (told != XXH3_64bits(rest.data(), rest.size())) throw bad("does not match its checksum");
  rest.remove_prefix(kTablesMagic.size());
  const auto take = [&](void* to, size_t size) {
    if (rest.size() < size) throw bad("ends within a table");
    std::memcpy(to, rest.data(), size);
    rest.remove_prefix(size);
  };
  uint32_t count = 0;
  take(&count, sizeof(count));
  std::map<std::string, NumberTable> out;
  for (uint32_t k = 0; k < count; ++k) {
    uint8_t length = 0, bits = 0;
    uint32_t rows = 0, columns = 0;
    take(&length, sizeof(length));
    std::string name(length, ' ');
    take(name.data(), length);
    take(&rows, sizeof(rows)), take(&columns, sizeof(columns)), take(&bits, sizeof(bits));
    if (bits != kFullBits) throw bad("has a table that is not of 32 bits");
    NumberTable table{rows, columns, {}};
    if (columns > 0 && rows > rest.size() / sizeof(float) / columns) throw bad("ends within a table");
    table.values.resize(table.rows * table.columns);
    take(table.values.data(), sizeof(float) * table.values.size());
    out.emplace(std::move(name), std::move(table));
  }
  return out;
}

std::string EncodeTables(const std::map<std::string, NumberTable>& tables) {
  std::string out(kTablesMagic);
  PutNumber(static_cast<uint32_t>(tables.size()), out);
  for (const auto& [name, table] : tables) {
    PutNumber(static_cast<uint8_t>(name.size()), out);
    out += name;
    PutNumber(static_cast<uint32_t>(table.rows), out);
    PutNumber(static_cast<uint32_t>(table.columns), out);
    PutNumber(kFullBits, out);
    out.append(reinterpret_cast<const char*>(table.values.data()), sizeof(float) * table.values.size());
  }
  PutNumber(static_cast<uint64_t>(XXH3_64bits(out.data(), out.size())), out);
  return out;
}

}  // namespace weft::learning

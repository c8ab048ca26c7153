// Several files in one input of a fuzz target, each after a line "=== NAME".
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

namespace weft {

inline std::map<std::string, std::string> SplitFiles(std::string_view bytes) {
  constexpr std::string_view kMark = "=== ";
  std::map<std::string, std::string> files;
  while (bytes.substr(0, kMark.size()) == kMark) {
    const size_t line_end = bytes.find('\n');
    if (line_end == std::string_view::npos) break;
    const std::string name(bytes.substr(kMark.size(), line_end - kMark.size()));
    bytes.remove_prefix(line_end + 1);
    const size_t next = bytes.find(std::string("\n").append(kMark));
    const size_t size = next == std::string_view::npos ? bytes.size() : next;
    files[name] = std::string(bytes.substr(0, size));
    bytes.remove_prefix(next == std::string_view::npos ? size : size + 1);
  }
  return files;
}

inline std::string JoinFiles(const std::map<std::string, std::string>& files) {
  std::string bytes;
  for (const auto& [name, text] : files) bytes += "=== " + name + "\n" + text + "\n";
  return bytes;
}

// Those with plain names alone; the folder is emptied before.
inline void WriteFiles(const std::map<std::string, std::string>& files, const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  for (const auto& [name, text] : files) {
    if (name.empty() || name.size() > 100 || name[0] == '.' ||
        name.find_first_of(std::string("/\0", 2)) != std::string::npos)
      continue;
    std::ofstream(folder / name, std::ios::binary) << text;
  }
}

inline std::map<std::string, std::string> ReadFiles(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path(), std::ios::binary);
    files[entry.path().filename()] = std::string(std::istreambuf_iterator<char>(file), {});
  }
  return files;
}

}  // namespace weft

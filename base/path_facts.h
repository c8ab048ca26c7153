// What a file system says of a path, and taking paths away, where it does not matter why it cannot: what
// cannot be looked at counts as not there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <system_error>

namespace weft {

// Of what a link leads to.
inline bool PathExists(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

inline bool IsFolder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

inline bool IsRegularFile(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

// 0 where there is no such file.
inline uint64_t FileBytes(const std::filesystem::path& path) {
  std::error_code error;
  const uintmax_t bytes = std::filesystem::file_size(path, error);
  return error ? 0 : bytes;
}

// A file, a link or an empty folder. Whether it was there and is gone.
inline bool RemoveFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::remove(path, ignored);
}

// A folder with all that is in it.
inline void RemoveTree(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove_all(path, ignored);
}

}  // namespace weft

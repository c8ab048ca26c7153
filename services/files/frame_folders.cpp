#include "services/files/frame_folders.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "absl/strings/str_cat.h"

namespace weft {

namespace fs = std::filesystem;

bool NaturallyBefore(std::string_view a, std::string_view b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    size_t i_end = i, j_end = j;
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    for (i_end = i; i_end < a.size() && digit(a[i_end]);) ++i_end;
    for (j_end = j; j_end < b.size() && digit(b[j_end]);) ++j_end;
    if (i_end - i != j_end - j) return i_end - i < j_end - j;
    if (const int order = a.compare(i, i_end - i, b, j, j_end - j); order != 0) return order < 0;
    i = i_end, j = j_end;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

absl::StatusOr<std::vector<std::string>> ListFrameFolders(const std::string& result, FrameFile file) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(result, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code no_file;
    if (fs::is_regular_file(entry->path() / FileName(file), no_file))
      names.push_back(entry->path().filename().string());
  }
  if (error == std::errc::no_such_file_or_directory) {
    return absl::NotFoundError(absl::StrCat(result, ": no such folder"));
  }
  if (error) {
    return absl::PermissionDeniedError(absl::StrCat(result, ": cannot be listed (", error.message(), ")"));
  }
  std::sort(names.begin(), names.end(), &NaturallyBefore);
  return names;
}

}  // namespace weft

#include "services/studio/video/chapters.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool AreDigits(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); });
}

std::string JoiningRemedy(const std::string& first) {
  return absl::StrCat(
      "join the chapters without loss: ffmpeg -f concat -safe 0 -i LIST -map 0:v -c copy FILE.mov, where "
      "LIST has "
      "a line \"file '...'\" for each, the first one ",
      first);
}

}  // namespace

std::optional<Chapter> ChapterOf(const std::string& name) {
  const std::string upper = absl::AsciiStrToUpper(name);
  const std::string stem = fs::path(upper).stem().string(), ending = fs::path(upper).extension().string();
  if (stem.size() != 8 || !AreDigits(stem.substr(4))) return std::nullopt;
  const std::string recording = stem.substr(4) + ending;
  if (absl::StartsWith(stem, "GOPR")) return Chapter{absl::StrCat("GP", recording), 0};
  int number = 0;
  if (!AreDigits(stem.substr(2, 2)) || !absl::SimpleAtoi(stem.substr(2, 2), &number)) return std::nullopt;
  for (const char* kind : {"GX", "GH", "GS", "GL", "GP"})
    if (absl::StartsWith(stem, kind)) return Chapter{absl::StrCat(kind, recording), number};
  return std::nullopt;
}

std::vector<std::string> ChaptersAfter(const std::string& path) {
  const std::optional<Chapter> own = ChapterOf(fs::path(path).filename().string());
  if (!own) return {};
  std::vector<std::pair<int, std::string>> after;
  std::error_code error;
  for (fs::directory_iterator entry(fs::path(path).parent_path(), error), end; !error && entry != end;
       entry.increment(error)) {
    std::string name = entry->path().filename().string();
    const std::optional<Chapter> other = ChapterOf(name);
    if (other && other->recording == own->recording && other->number > own->number)
      after.emplace_back(other->number, std::move(name));
  }
  std::ranges::sort(after);
  std::vector<std::string> names;
  for (auto& [number, name] : after) names.push_back(std::move(name));
  return names;
}

absl::Status CheckChapters(const std::vector<std::string>& paths) {
  std::map<std::string, std::string> recordings;
  for (const std::string& path : paths) {
    const std::optional<Chapter> chapter = ChapterOf(fs::path(path).filename().string());
    if (!chapter) continue;
    const auto [first, is_new] =
        recordings.emplace((fs::path(path).parent_path() / chapter->recording).string(), path);
    if (!is_new)
      return absl::InvalidArgumentError(absl::StrCat(path, ": is a chapter of the same recording as ",
                                                     first->second, ", not of another camera; ",
                                                     JoiningRemedy(std::min(path, first->second))));
  }
  return absl::OkStatus();
}

std::string ChaptersText(const std::string& path) {
  const std::vector<std::string> after = ChaptersAfter(path);
  if (after.empty()) return "";
  return absl::StrCat("its recording goes on in ", absl::StrJoin(after, ", "),
                      after.size() == 1 ? ", which is" : ", which are", " not in the take; ",
                      JoiningRemedy(path));
}

}  // namespace weft

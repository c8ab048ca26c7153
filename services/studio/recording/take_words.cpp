#include "services/studio/recording/take_words.h"

#include <algorithm>
#include <map>
#include <regex>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace weft {
namespace {

constexpr size_t kNamesInFull = 4;
constexpr absl::string_view kNoFrame = "no camera delivered a frame";

const std::regex& Number() {
  static const std::regex number("[0-9]+([.][0-9]+)?");
  return number;
}

// One cause of the ledger, or several that differ in their numbers alone.
class Cause {
 public:
  void Add(const std::string& text, uint64_t count) {
    count_ += count;
    size_t place = 0;
    for (std::sregex_iterator it(text.begin(), text.end(), Number()), end; it != end; ++it, ++place) {
      if (place == ranges_.size()) ranges_.emplace_back(it->str(), it->str());
      auto& [low, high] = ranges_[place];
      if (Value(it->str()) < Value(low)) low = it->str();
      if (Value(it->str()) > Value(high)) high = it->str();
    }
    text_ = text;
  }
  uint64_t count() const { return count_; }
  std::string Text() const {
    std::string out;
    size_t place = 0, from = 0;
    for (std::sregex_iterator it(text_.begin(), text_.end(), Number()), end; it != end; ++it, ++place) {
      const auto& [low, high] = ranges_[place];
      absl::StrAppend(&out, text_.substr(from, static_cast<size_t>(it->position()) - from),
                      low == high ? low : absl::StrCat(low, " to ", high));
      from = static_cast<size_t>(it->position() + it->length());
    }
    return out + text_.substr(from);
  }

 private:
  static double Value(const std::string& number) {
    double value = 0;
    return absl::SimpleAtod(number, &value) ? value : 0;
  }

  std::string text_;
  uint64_t count_ = 0;
  std::vector<std::pair<std::string, std::string>> ranges_;
};

// "40 frames missing: the camera is disconnected", "40 frames missing, 2.4 to 25 ms late".
std::string MissingText(uint64_t count, const std::string& cause) {
  const char* between =
      !cause.empty() && absl::ascii_isdigit(static_cast<unsigned char>(cause[0])) ? ", " : ": ";
  return absl::StrCat(WithSeparators(count), count == 1 ? " frame missing" : " frames missing", between,
                      cause);
}

std::string DroppedText(uint64_t count, const std::string& cause) {
  if (absl::StartsWith(cause, kNoFrame))
    return absl::StrCat(kNoFrame, " at ", WithSeparators(count), count == 1 ? " trigger" : " triggers",
                        cause.substr(kNoFrame.size()));
  return absl::StrCat(WithSeparators(count), count == 1 ? " frame set" : " frame sets", " dropped: ", cause);
}

}  // namespace

std::string WithSeparators(uint64_t count) {
  std::string digits = std::to_string(count);
  for (size_t at = digits.size(); at > 3;) digits.insert(at -= 3, 1, ',');
  return digits;
}

std::string Duration(double seconds) {
  if (seconds < 120) return absl::StrFormat("%.0f s", seconds);
  return seconds < 7200 ? absl::StrFormat("%.0f min", seconds / 60)
                        : absl::StrFormat("%.1f h", seconds / 3600);
}

std::string RoomText(double free_bytes, double session_bytes_per_s, double disk_bytes_per_s,
                     double kept_bytes) {
  std::string text = absl::StrFormat("%.*f GB free", free_bytes < 10e9 ? 1 : 0, free_bytes / 1e9);
  if (kept_bytes > 0) absl::StrAppendFormat(&text, ", %.1f GB of it stay free", kept_bytes / 1e9);
  free_bytes = std::max(0.0, free_bytes - kept_bytes);
  const std::string full_speed = disk_bytes_per_s > 0 ? absl::StrCat(Duration(free_bytes / disk_bytes_per_s),
                                                                     " at the disk's full speed")
                                                      : "";
  if (session_bytes_per_s <= 0) return full_speed.empty() ? text : absl::StrCat(text, ": ", full_speed);
  absl::StrAppendFormat(&text, ": %s at this session's %.1f MB/s", Duration(free_bytes / session_bytes_per_s),
                        session_bytes_per_s / 1e6);
  return full_speed.empty() ? text : absl::StrCat(text, " (", full_speed, ")");
}

std::string NamesInShort(const std::vector<std::string>& names) {
  if (names.size() == 1) return names[0];
  if (names.size() <= kNamesInFull)
    return absl::StrCat(absl::StrJoin(names.begin(), names.end() - 1, ", "), " and ", names.back());
  return absl::StrCat(absl::StrJoin(names.begin(), names.begin() + kNamesInFull - 1, ", "), " and ",
                      names.size() - (kNamesInFull - 1), " more");
}

void DescribeCauses(const RecordedTake& take, v1::TakeInfo& info) {
  std::map<std::pair<std::string, std::string>, Cause> causes;
  const auto add = [&](const std::string& camera_id, const std::string& text, uint64_t count) {
    causes[{camera_id, std::regex_replace(text, Number(), "*")}].Add(text, count);
  };
  for (const LedgerEntry& entry : take.ledger()) {
    if (entry.event == LedgerEvent::kMissing) add(entry.camera_id, entry.cause, 1);
    if (entry.event == LedgerEvent::kDropped) add("", entry.cause, entry.last_set - entry.first_set + 1);
    if (entry.event == LedgerEvent::kNote)
      info.add_notes(entry.camera_id.empty() ? entry.cause
                                             : absl::StrCat("camera ", entry.camera_id, ": ", entry.cause));
  }
  for (const auto& [key, found] : causes) {
    v1::TakeCause& cause = *info.add_causes();
    cause.set_camera(key.first);
    cause.set_cause(found.Text());
    cause.set_count(found.count());
  }
}

std::vector<std::string> CauseLines(const google::protobuf::RepeatedPtrField<v1::TakeCause>& causes) {
  struct Shared {
    std::vector<std::string> cameras;
    uint64_t count = 0;
  };
  std::map<std::string, Shared> missing;  // by cause
  std::vector<std::pair<uint64_t, std::string>> lines;
  for (const v1::TakeCause& cause : causes) {
    if (cause.camera().empty()) {
      lines.emplace_back(cause.count(), DroppedText(cause.count(), cause.cause()));
    } else {
      missing[cause.cause()].cameras.push_back(cause.camera());
      missing[cause.cause()].count += cause.count();
    }
  }
  for (const auto& [cause, shared] : missing) {
    const std::string who = shared.cameras.size() == 1 ? shared.cameras[0]
                                                       : absl::StrCat(shared.cameras.size(), " cameras (",
                                                                      NamesInShort(shared.cameras), ")");
    lines.emplace_back(shared.count, absl::StrCat(who, ": ", MissingText(shared.count, cause)));
  }
  std::ranges::stable_sort(lines, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> text;
  for (auto& [_, line] : lines) text.push_back(std::move(line));
  return text;
}

std::vector<std::string> CameraLines(const std::vector<std::pair<std::string, std::string>>& said,
                                     size_t cameras) {
  std::vector<std::pair<std::string, std::vector<std::string>>> by_text;
  for (const auto& [camera, text] : said) {
    const auto same =
        std::ranges::find_if(by_text, [&text = text](const auto& one) { return one.first == text; });
    if (same == by_text.end()) {
      by_text.push_back({text, {camera}});
    } else {
      same->second.push_back(camera);
    }
  }
  std::vector<std::string> lines;
  for (const auto& [text, with] : by_text)
    lines.push_back(with.size() == 1 ? absl::StrCat("camera ", with[0], ": ", text)
                                     : absl::StrCat(with.size(), " of ", cameras, " cameras (",
                                                    NamesInShort(with), "): ", text));
  return lines;
}

}  // namespace weft

#include "services/tools/installation/redaction.h"

#include <regex>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr char kRedacted[] = "[redacted]";
constexpr size_t kLeastSecret = 8;
constexpr uint64_t kMaxSecretFileBytes = uint64_t{1} << 20;

// std::regex recurses over long matches, so that a key is found by hand.
std::string WithoutKeys(const std::string& text) {
  constexpr absl::string_view kBegin = "PRIVATE KEY-----", kEnd = "-----END";
  std::string kept;
  size_t at = 0;
  for (;;) {
    const size_t begin = text.find(kBegin.data(), at);
    if (begin == std::string::npos) return kept + text.substr(at);
    const size_t end = text.find(kEnd.data(), begin);
    absl::StrAppend(&kept, text.substr(at, begin + kBegin.size() - at), kRedacted);
    if (end == std::string::npos) return kept;
    // To behind the words "PRIVATE KEY" of the end, which would be taken for another beginning.
    const size_t line = text.find('\n', end);
    at = line == std::string::npos ? text.size() : line;
  }
}

bool IsWeb(absl::string_view before) {
  return absl::EndsWithIgnoreCase(before, "http") || absl::EndsWithIgnoreCase(before, "https");
}

// Of every URL the user; of those of the web what follows the host, too: addresses of hooks have their secret
// in the path.
std::string WithoutPartsOfUrls(absl::string_view line) {
  constexpr absl::string_view kMark = "://", kEnds = " \t\r\"'<>\\";
  std::string kept;
  for (size_t mark = line.find(kMark); mark != absl::string_view::npos; mark = line.find(kMark)) {
    const bool is_web = IsWeb(line.substr(0, mark));
    absl::StrAppend(&kept, line.substr(0, mark + kMark.size()));
    line.remove_prefix(mark + kMark.size());
    const absl::string_view url = line.substr(0, line.find_first_of(kEnds));
    absl::string_view authority = url.substr(0, url.find_first_of("/?#"));
    const absl::string_view rest = url.substr(authority.size());
    if (const size_t user = authority.rfind('@'); user != absl::string_view::npos) {
      absl::StrAppend(&kept, kRedacted);
      authority.remove_prefix(user);
    }
    absl::StrAppend(&kept, authority, is_web && rest.size() > 1 ? rest.substr(0, 1) : rest,
                    is_web && rest.size() > 1 ? kRedacted : "");
    line.remove_prefix(url.size());
  }
  return absl::StrCat(kept, line);
}

// By lines, since a log is long.
std::string WithoutPatterns(const std::string& text) {
  static const std::regex token("weft_[0-9a-f]{16,}");
  static const std::regex bearer("([Bb]earer )[^\\s\"]+");
  std::vector<std::string> lines = absl::StrSplit(text, '\n');
  for (std::string& line : lines) {
    if (absl::StrContains(line, "weft_")) line = std::regex_replace(line, token, kRedacted);
    if (absl::StrContains(line, "earer "))
      line = std::regex_replace(line, bearer, absl::StrCat("$1", kRedacted));
    if (absl::StrContains(line, "://")) line = WithoutPartsOfUrls(line);
  }
  std::string all;
  for (size_t i = 0; i < lines.size(); ++i) absl::StrAppend(&all, i == 0 ? "" : "\n", lines[i]);
  return all;
}

}  // namespace

void Redaction::AddSecret(const std::string& secret) {
  const std::string word(absl::StripAsciiWhitespace(secret));
  if (word.size() >= kLeastSecret) secrets_.push_back(word);
}

void Redaction::AddSecretFile(const std::string& path) {
  if (path.empty()) return;
  const absl::StatusOr<std::string> text = ReadWholeFile(path, kMaxSecretFileBytes);
  if (!text.ok()) return;
  for (const absl::string_view line : absl::StrSplit(*text, '\n')) {
    if (!absl::StartsWith(line, "-----")) AddSecret(std::string(line));
  }
}

void Redaction::AddSecretUrl(const std::string& url) {
  const std::vector<std::string> parts = absl::StrSplit(url, absl::ByAnyChar("/?#&=@"));
  // What precedes the path: "https:", "", and the host.
  for (size_t i = 3; i < parts.size(); ++i) AddSecret(parts[i]);
}

std::string Redaction::Apply(std::string text) const {
  for (const std::string& secret : secrets_) absl::StrReplaceAll({{secret, kRedacted}}, &text);
  return WithoutPatterns(WithoutKeys(text));
}

}  // namespace weft

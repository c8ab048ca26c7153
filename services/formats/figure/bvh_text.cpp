#include "services/formats/figure/bvh_text.h"

#include <charconv>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf";

bool IsBlank(char c) { return absl::ascii_isspace(static_cast<unsigned char>(c)) || c == '\0'; }
bool StandsAlone(char c) { return c == '{' || c == '}' || c == ':'; }
bool IsLineEnd(char c) { return c == '\n' || c == '\r'; }

}  // namespace

std::string LowerCase(std::string_view word) {
  std::string out;
  for (const char c : word) out += static_cast<char>(absl::ascii_tolower(static_cast<unsigned char>(c)));
  return out;
}

BvhText::BvhText(std::string_view text) : text_(text) {
  if (text_.starts_with(kUtf8Mark)) text_.remove_prefix(kUtf8Mark.size());
  SkipBlanks();
}

void BvhText::SkipBlanks() {
  for (; at_ < text_.size() && IsBlank(text_[at_]); ++at_) {
    // "\r\n" is one end of a line, "\r" alone is one as well.
    const bool is_first_of_two = text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
    if (IsLineEnd(text_[at_]) && !is_first_of_two) ++line_;
  }
}

std::string_view BvhText::WordAt(size_t at) const {
  size_t end = at;
  if (end < text_.size() && StandsAlone(text_[end])) return text_.substr(at, 1);
  while (end < text_.size() && !IsBlank(text_[end]) && !StandsAlone(text_[end])) ++end;
  return text_.substr(at, end - at);
}

std::string_view BvhText::Peek() const { return WordAt(at_); }

std::string_view BvhText::Next() {
  const std::string_view out = WordAt(at_);
  at_ += out.size();
  line_before_ = line_;
  SkipBlanks();
  return out;
}

std::string_view BvhText::RestOfLine() {
  const size_t from = at_;
  while (at_ < text_.size() && !IsLineEnd(text_[at_]) && text_[at_] != '{' && text_[at_] != '}') ++at_;
  size_t end = at_;
  while (end > from && IsBlank(text_[end - 1])) --end;
  const std::string_view out = text_.substr(from, end - from);
  line_before_ = line_;
  SkipBlanks();
  return out;
}

bool BvhText::Take(std::string_view lower_case) {
  if (LowerCase(Peek()) != lower_case) return false;
  Next();
  return true;
}

absl::Status BvhText::Expect(std::string_view lower_case) {
  if (Take(lower_case)) return absl::OkStatus();
  return Error(absl::StrCat("expected ", std::string(lower_case), AtEnd() ? ", found the end" : ", found \"",
                            std::string(Peek().substr(0, 40)), AtEnd() ? "" : "\""));
}

absl::StatusOr<double> BvhText::Number(std::string_view what) {
  if (AtEnd())
    return Error(absl::StrCat("ends where ", std::string(what), " is expected; was the file truncated?"));
  const std::string_view word = Peek();
  std::string_view digits = word;
  if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);  // from_chars takes none
  double out = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out);
  const std::string shown(word.substr(0, 40));
  if (word.find(',') != std::string_view::npos)
    return Error(
        absl::StrCat("\"", shown, "\" has a comma; numbers have a decimal point and blanks between them"));
  // Numbers too small for a double are zero.
  if (error == std::errc::result_out_of_range && end == digits.data() + digits.size() &&
      LowerCase(digits).find("e-") != std::string::npos)
    out = 0;
  else if (error != std::errc() || end != digits.data() + digits.size())
    return Error(absl::StrCat("\"", shown, "\" is no number, expected ", std::string(what)));
  if (!std::isfinite(out)) return Error(absl::StrCat("\"", shown, "\" is no finite number"));
  Next();
  return out;
}

bool BvhText::AtEnd() const { return at_ >= text_.size(); }

absl::Status BvhText::Error(std::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat("is damaged: line ", line_, ": ", std::string(what)));
}

absl::Status BvhText::ErrorBefore(std::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat("is damaged: line ", line_before_, ": ", std::string(what)));
}

}  // namespace weft

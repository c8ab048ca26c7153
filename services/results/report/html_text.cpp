#include "services/results/report/html_text.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
constexpr char kDash[] = "\xE2\x80\x93";
constexpr char kMinus[] = "\xE2\x88\x92";

std::string_view Entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

// Newlines and tabs are white space.
bool IsUnprintable(std::string_view character) {
  return character[0] != '\n' && character[0] != '\t' && IsControlCharacter(character);
}

// Digits in threes: "1,234,567".
std::string Grouped(const std::string& digits) {
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

}  // namespace

std::string EscapeHtml(std::string_view text) {
  std::string html;
  html.reserve(text.size() + text.size() / 8);
  while (!text.empty()) {
    const size_t length = Utf8CharacterBytes(text);
    if (length == 0 || IsUnprintable(text.substr(0, length))) {
      html += kReplacement;
    } else if (const std::string_view entity = Entity(text[0]); !entity.empty()) {
      html += entity;
    } else {
      html += text.substr(0, length);
    }
    text.remove_prefix(std::max<size_t>(length, 1));
  }
  return html;
}

std::string NameHtml(std::string_view name) { return absl::StrCat("<bdi>", EscapeHtml(name), "</bdi>"); }

std::string Shortened(std::string_view text, size_t characters) {
  size_t at = 0, count = 0;
  while (at < text.size()) {
    if (++count > characters) return std::string(text.substr(0, at)) + "\xE2\x80\xA6";
    at += std::max<size_t>(Utf8CharacterBytes(text.substr(at)), 1);
  }
  return std::string(text);
}

std::string Words(std::string_view identifier) {
  return absl::StrReplaceAll(std::string(identifier), {{"_", " "}});
}

std::string FormatCount(int64_t count) {
  const std::string digits = absl::StrCat(count);
  return count < 0 ? absl::StrCat(kMinus, Grouped(digits.substr(1))) : Grouped(digits);
}

std::string FormatNumber(double value, int decimals) {
  if (!std::isfinite(value)) return kDash;
  const std::string text = absl::StrFormat("%.*f", decimals, std::abs(value));
  const size_t point = std::min(text.find('.'), text.size());
  const bool is_zero = text.find_first_not_of("0.") == std::string::npos;
  return absl::StrCat(value < 0 && !is_zero ? kMinus : "", Grouped(text.substr(0, point)),
                      text.substr(point));
}

std::string FormatPercent(double share) {
  if (!std::isfinite(share)) return kDash;
  // 99.97 % must not read as 100 %.
  double percent = 100 * share;
  if (percent < 100 && percent > 99.9) percent = 99.9;
  return absl::StrCat(absl::StrFormat("%.1f", percent), "\xC2\xA0%");
}

std::string Counted(int64_t count, const std::string& singular, const std::string& plural) {
  return absl::StrCat(FormatCount(count), " ", count == 1 ? singular : plural);
}

std::string Base64(std::string_view bytes) {
  return absl::Base64Escape(absl::string_view(bytes.data(), bytes.size()));
}

}  // namespace weft

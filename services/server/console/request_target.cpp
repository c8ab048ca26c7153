#include "services/server/console/request_target.h"

#include <arpa/inet.h>

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace weft {
namespace {

constexpr size_t kLongestTarget = 2048;
constexpr size_t kLongestMethod = 100;

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }

int HexValue(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  const char low = absl::ascii_tolower(static_cast<unsigned char>(digit));
  return low >= 'a' && low <= 'f' ? low - 'a' + 10 : -1;
}

std::optional<std::string> Decoded(absl::string_view text, bool plus_is_space) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    char next = text[i];
    if (next == '+' && plus_is_space) next = ' ';
    if (next == '%') {
      const int high = i + 2 < text.size() ? HexValue(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? HexValue(text[i + 2]) : -1;
      if (high < 0 || low < 0) return std::nullopt;
      next = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (absl::ascii_iscntrl(static_cast<unsigned char>(next))) return std::nullopt;
    decoded.push_back(next);
  }
  return decoded;
}

bool IsAddress(const std::string& text) {
  in6_addr ignored = {};
  return inet_pton(AF_INET, text.c_str(), &ignored) == 1 || inet_pton(AF_INET6, text.c_str(), &ignored) == 1;
}

// The host of HOST or HOST:PORT, without brackets.
std::string WithoutPort(const std::string& host) {
  if (absl::StartsWith(host, "[")) {
    const size_t end = host.find(']');
    const bool has_end = end != std::string::npos && (end + 1 == host.size() || host[end + 1] == ':');
    return has_end ? host.substr(1, end - 1) : "";
  }
  return host.substr(0, host.find(':'));
}

bool IsPlainPath(std::string_view path) {
  if (path.empty() || path[0] != '/') return false;
  if (path == "/") return true;
  for (absl::string_view step : absl::StrSplit(View(path.substr(1)), '/')) {
    if (step.empty() || step == "." || step == "..") return false;
  }
  return path.find('\\') == std::string_view::npos;
}

}  // namespace

absl::StatusOr<RequestTarget> ParseTarget(std::string_view text) {
  const absl::Status bad = absl::InvalidArgumentError("this is no path of this server");
  if (text.size() > kLongestTarget) return bad;
  text = text.substr(0, text.find('#'));
  const size_t question = text.find('?');
  std::optional<std::string> path = Decoded(View(text.substr(0, question)), false);
  if (!path) return bad;
  RequestTarget target;
  target.path = *std::move(path);
  if (!IsPlainPath(target.path)) return bad;
  if (question == std::string_view::npos) return target;
  for (absl::string_view pair : absl::StrSplit(View(text.substr(question + 1)), '&', absl::SkipEmpty())) {
    const std::pair<std::string, std::string> parts = absl::StrSplit(pair, absl::MaxSplits('=', 1));
    std::optional<std::string> name = Decoded(parts.first, true);
    std::optional<std::string> value = Decoded(parts.second, true);
    if (!name || !value) return bad;
    target.query.emplace_back(*std::move(name), *std::move(value));
  }
  return target;
}

std::string CookieValue(std::string_view header, std::string_view name) {
  std::string found;
  for (absl::string_view pair : absl::StrSplit(View(header), ';')) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(absl::StripAsciiWhitespace(pair), absl::MaxSplits('=', 1));
    if (parts.first != View(name)) continue;
    if (!found.empty()) return "";  // somebody else set one of the same name
    found = std::string(parts.second);
  }
  return found;
}

std::string BearerOf(std::string_view header) {
  constexpr absl::string_view kScheme = "bearer ";
  const bool is_bearer = absl::StartsWithIgnoreCase(View(header), kScheme);
  return is_bearer ? std::string(header.substr(kScheme.size())) : "";
}

bool IsHostOfOurs(const std::string& host, const std::vector<std::string>& names) {
  const std::string name = absl::AsciiStrToLower(WithoutPort(host));
  const size_t dot = std::min(name.find('.'), name.size());
  const std::string any_step = dot == 0 || dot == name.size() ? name : "*" + name.substr(dot);
  return name == "localhost" || IsAddress(name) || std::ranges::any_of(names, [&](const std::string& ours) {
           const std::string lower = absl::AsciiStrToLower(ours);
           return lower == name || lower == any_step;
         });
}

std::optional<ByteRange> ParseRange(std::string_view text) {
  absl::string_view header = View(text);
  if (!absl::ConsumePrefix(&header, "bytes=")) return std::nullopt;
  const std::pair<absl::string_view, absl::string_view> ends =
      absl::StrSplit(header, absl::MaxSplits('-', 1));
  ByteRange range;
  int64_t last = 0;
  const auto is_number = [](absl::string_view digits) {
    return !digits.empty() && digits.find_first_not_of("0123456789") == absl::string_view::npos;
  };
  if (!is_number(ends.first) || !absl::SimpleAtoi(ends.first, &range.first)) return std::nullopt;
  if (header.find('-') == absl::string_view::npos) return std::nullopt;
  if (ends.second.empty()) return range;
  if (!is_number(ends.second) || !absl::SimpleAtoi(ends.second, &last) || last < range.first)
    return std::nullopt;
  range.last = last;
  return range;
}

absl::StatusOr<SocketOrder> ParseSocketOrder(std::string_view text) {
  const size_t line_end = text.find('\n');
  const std::string_view line = text.substr(0, line_end);
  const size_t space = line.find(' ');
  SocketOrder order;
  if (space == std::string_view::npos || space == 0 ||
      line.substr(0, space).find_first_not_of("0123456789") != std::string_view::npos ||
      !absl::SimpleAtoi(View(line.substr(0, space)), &order.id)) {
    return absl::InvalidArgumentError("an order begins with a number and a space");
  }
  const std::string_view method = line.substr(space + 1);
  if (method == "cancel") return order;
  if (method.empty() || method.size() > kLongestMethod || line_end == std::string_view::npos)
    return absl::InvalidArgumentError("an order names a method, and its request follows on the next line");
  order.method = std::string(method);
  order.json = text.substr(line_end + 1);
  return order;
}

}  // namespace weft

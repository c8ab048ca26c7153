// What a browser's request names, from its bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct RequestTarget {
  std::string path;  // decoded, begins with "/"; has no "..", no empty step, no control character
  std::vector<std::pair<std::string, std::string>> query;  // decoded, in the order of the request
};

// RFC 3986, of at most 2048 bytes. InvalidArgument: no path of this server, or percent signs without two hex
// digits.
absl::StatusOr<RequestTarget> ParseTarget(std::string_view text);

// The value of a cookie in a Cookie header (RFC 6265); empty: there is none, or there are several.
std::string CookieValue(std::string_view header, std::string_view name);

// The token of "Bearer TOKEN" in an Authorization header (RFC 6750); empty: there is none.
std::string BearerOf(std::string_view header);

// Whether a browser may ask under this Host: localhost, an address, or one of the names, with any port.
// "*.studio.example" stands for every name with one step more (RFC 6125, 6.4.3).
bool IsHostOfOurs(const std::string& host, const std::vector<std::string>& names);

struct ByteRange {
  int64_t first = 0;
  std::optional<int64_t> last;  // none: to the end
};

// "bytes=FIRST-" or "bytes=FIRST-LAST" (RFC 9110, 14.2). None: anything else, which a server may ignore.
std::optional<ByteRange> ParseRange(std::string_view header);

// What a page says on its socket: "ID METHOD\n" and the request as JSON, or "ID cancel".
struct SocketOrder {
  uint32_t id = 0;
  std::string method;  // "Takes.WatchTake"; empty: cancel
  std::string_view json;
};
absl::StatusOr<SocketOrder> ParseSocketOrder(std::string_view text);

}  // namespace weft

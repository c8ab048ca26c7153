// SHA-256, for contents that come from anywhere.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace weft {

// Thread safety: none.
class Sha256 {
 public:
  Sha256();
  Sha256& Add(std::string_view bytes);
  // 64 hex digits; ends the hash.
  std::string Hex();

 private:
  std::unique_ptr<void, void (*)(void*)> context_;
};

// Of a plain file; links are not followed. `read` is called with the bytes of each piece. Errors name the
// file.
absl::StatusOr<std::string> Sha256OfFile(const std::string& path,
                                         const std::function<void(size_t bytes)>& read = {});

}  // namespace weft

// The console's pages, as Vite built them.
#pragma once

#include <map>
#include <string>

#include "absl/status/statusor.h"

namespace weft {

struct PageFile {
  std::string type;  // of its content
  std::string bytes;
  std::string gzip;        // the same, compressed; empty: not worth it
  std::string tag;         // another one when the bytes are others
  bool is_hashed = false;  // its name changes with its bytes, so browsers may keep it
};

// By path: "/", "/assets/index-3f2a.js". All files of the folder, 32 MiB at most, in memory: what is served
// does not change while pages are open. NotFound: no index.html there; errors of ReadWholeFile.
absl::StatusOr<std::map<std::string, PageFile>> LoadPageFiles(const std::string& folder);

// By the ending of a name; "application/octet-stream" for what browsers need not show.
std::string ContentType(const std::string& name);

}  // namespace weft

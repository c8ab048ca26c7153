#include "services/server/console/page_files.h"

#include <zlib.h>

#include <filesystem>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

constexpr size_t kMostBytes = size_t{32} << 20;
constexpr size_t kWorthCompressing = 512;
constexpr size_t kTagDigits = 16;

std::string Compressed(const std::string& bytes) {
  z_stream stream = {};
  constexpr int kGzipWindow = 15 + 16;
  constexpr int kMemory = 9;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    return "";
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const bool done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return done && out.size() < bytes.size() ? out : "";
}

}  // namespace

std::string ContentType(const std::string& name) {
  static constexpr std::pair<const char*, const char*> kTypes[] = {{".html", "text/html; charset=utf-8"},
                                                                   {".js", "text/javascript; charset=utf-8"},
                                                                   {".css", "text/css; charset=utf-8"},
                                                                   {".json", "application/json"},
                                                                   {".svg", "image/svg+xml"},
                                                                   {".png", "image/png"},
                                                                   {".jpg", "image/jpeg"},
                                                                   {".wasm", "application/wasm"},
                                                                   {".csv", "text/csv; charset=utf-8"},
                                                                   {".txt", "text/plain; charset=utf-8"}};
  for (const auto& [ending, type] : kTypes) {
    if (absl::EndsWith(name, ending)) return type;
  }
  return "application/octet-stream";
}

absl::StatusOr<std::map<std::string, PageFile>> LoadPageFiles(const std::string& folder) {
  std::map<std::string, PageFile> files;
  size_t bytes = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error)) {
    if (!entry.is_regular_file()) continue;
    WEFT_ASSIGN_OR_RETURN(std::string content, ReadWholeFile(entry.path().string(), kMostBytes));
    bytes += content.size();
    if (bytes > kMostBytes)
      return absl::InvalidArgumentError(
          absl::StrCat(folder, ": more than 32 MiB are no pages of the console"));
    std::string path = absl::StrCat("/", entry.path().lexically_relative(folder).string());
    PageFile file;
    file.type = ContentType(path);
    file.is_hashed = absl::StartsWith(path, "/assets/");
    file.tag = absl::StrCat("\"", Sha256().Add(content).Hex().substr(0, kTagDigits), "\"");
    if (content.size() >= kWorthCompressing && !absl::StartsWith(file.type, "image/p"))
      file.gzip = Compressed(content);
    file.bytes = std::move(content);
    files[path == "/index.html" ? "/" : path] = std::move(file);
  }
  if (files.contains("/")) return files;
  return absl::NotFoundError(
      absl::StrCat("--console-files: ", folder, ": no index.html; build the console, or name its folder"));
}

}  // namespace weft

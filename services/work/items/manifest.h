// What an item consists of, and its id.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

inline constexpr int kMaxItemFiles = 100'000;
inline constexpr size_t kMaxManifestBytes = size_t{64} << 20;  // as a message

// InvalidArgument names the path: empty, absolute, "." or "..", control characters, too long or too deep,
// given twice, or a file and a folder at once. Also: no files, too many, sizes below 0, hashes that are none.
absl::Status CheckManifest(const v1::ItemManifest& manifest);
absl::Status CheckItemPath(const std::string& path);

// SHA-256 over "<sha256> <bytes> <path>\n" of each file, sorted by path.
std::string ItemIdOf(const v1::ItemManifest& manifest);

int64_t BytesOf(const v1::ItemManifest& manifest);

// Null: no such file.
const v1::ItemFile* FindFile(const v1::ItemManifest& manifest, const std::string& path);

}  // namespace weft

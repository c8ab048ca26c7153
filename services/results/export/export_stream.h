// A growing file that an interrupted export goes on with.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// The first error stays: what is appended after it is lost, and status() tells it. Thread safety: none.
class ExportStream {
 public:
  // Opens or makes the file, and cuts it after `keep_bytes`. Errors as WriteFileAtomically; DataLoss: it has
  // fewer bytes.
  static absl::StatusOr<ExportStream> Open(const std::string& path, uint64_t keep_bytes);

  void Append(std::string_view bytes);
  // Values in the machine's byte order, which is little-endian.
  template <typename Value>
  void AppendValues(const Value* values, size_t count) {
    Append({reinterpret_cast<const char*>(values), count * sizeof(Value)});
  }
  // Replaces bytes that were appended before.
  void Overwrite(uint64_t offset, std::string_view bytes);

  // Bytes so far.
  uint64_t size() const { return size_; }
  const absl::Status& status() const { return status_; }
  // Everything appended is on the disk. The error, if there was one.
  absl::Status Sync();

 private:
  ExportStream(UniqueFd file, std::string path, uint64_t size)
      : file_(std::move(file)), path_(std::move(path)), size_(size) {}
  void Flush();

  UniqueFd file_;
  std::string path_;
  uint64_t size_ = 0;
  std::string buffer_;  // the last bytes of the file
  absl::Status status_;
};

}  // namespace weft

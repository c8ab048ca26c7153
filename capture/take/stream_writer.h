// Writes one camera's stream of a take: append-only, checksummed, with an index beside it.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "capture/file/posix_file.h"
#include "capture/take/take_format.h"

namespace weft {

struct StreamWriterOptions {
  bool bypass_page_cache = true;  // O_DIRECT; where the file system has none, ordinary writes
  uint64_t preallocate_bytes = uint64_t{256} << 20;  // reserved ahead of the data, at a time; 0: nothing
  uint64_t keep_free_bytes = 0;  // of the disk; reserving takes a small part of the room above that
  uint64_t streams = 1;          // that share this room
  bool compress = false;         // split planes, predictor, zstd (capture/take/frame_codec.h)
  int zstd_level = 1;

  absl::Status Validate() const;
};

// A stream's life: Create, Append for every frame set in order, Commit and Keep from time to time, Close,
// WriteEnd. After an
// error of Append the stream is as before and may be closed; a file that is not closed is read after `weft
// take recover`. Thread safety: Commit may run beside Append, otherwise one thread at a time.
class StreamWriter {
 public:
  // Makes <folder>/<camera>.stream and .index, which must not exist. Errors of PosixFile; InvalidArgument:
  // camera id.
  static absl::StatusOr<std::unique_ptr<StreamWriter>> Create(const std::string& folder,
                                                              const StreamHeader& header,
                                                              const StreamWriterOptions& options);

  // Appends the frame of a set, or the reason why there is none. The write has reached the disk's queue when
  // it returns, and the disk after Commit. Preconditions: sets increase; the frame is valid.
  absl::Status Append(uint64_t set, const RawFrame& frame);
  absl::Status AppendMissing(uint64_t set, int64_t device_time_ns, const std::string& reason);

  // Flushes the data to the disk, then writes index records for the chunks of sets up to `last_set`. After a
  // flush that failed nobody knows what reached the disk, so every later Commit fails too.
  absl::Status Commit(uint64_t last_set);
  // What was committed stays, whatever comes later.
  void Keep() { committed_.clear(); }

  // Gives back what was reserved and not used.
  absl::Status Trim();
  // Cuts off the reserved room and the sets after `last_set` (all where there is none). Tries all of it and
  // answers the first error. Precondition: what was kept is not cut.
  absl::Status Close(std::optional<uint64_t> last_set);
  // The last block of a stream that was closed without an error; take, chunks and last_set are filled in.
  absl::Status WriteEnd(StreamEnd end);

  uint64_t bytes() const { return end_bytes_; }
  // Reserved and not used: the stream's own room. From any thread.
  uint64_t spare_bytes() const {
    const uint64_t reserved = reserved_bytes_, end = end_bytes_;
    return reserved > end ? reserved - end : 0;
  }

 private:
  StreamWriter(PosixFile stream, PosixFile index, const StreamHeader& header,
               const StreamWriterOptions& options);
  absl::Status Write(ChunkHeader& header, const uint8_t* payload);
  absl::Status Reserve(uint64_t end_bytes);
  uint64_t Ahead_bytes() const;

  PosixFile stream_;
  PosixFile index_;
  const StreamHeader header_;
  const StreamWriterOptions options_;
  AlignedBuffer header_block_{kBlockBytes};
  std::atomic<uint64_t> end_bytes_;
  std::atomic<uint64_t> reserved_bytes_ = 0;
  uint64_t sequence_ = 0;
  absl::Status flush_failure_;
  Mutex mutex_;
  std::vector<IndexRecord> pending_ ABSL_GUARDED_BY(mutex_);  // written, not yet in the index
  uint64_t index_bytes_ = 0;
  std::vector<IndexRecord> committed_;  // and not yet kept
  uint64_t committed_end_bytes_;
  uint64_t last_set_ = 0;  // of the committed chunks
};

}  // namespace weft

// Reads one camera's stream of a take.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/file/posix_file.h"
#include "capture/take/take_format.h"

namespace weft {

// A place in a stream that holds no valid chunk though chunks follow.
struct StreamDamage {
  uint64_t offset_bytes = 0;
  std::string what;
};

// What a stream really holds, found without its index.
struct StreamScan {
  std::vector<IndexRecord> records;  // of all chunks whose header and payload are intact
  std::vector<StreamDamage> damage;  // between and after them
  std::vector<uint64_t>
      stray_bytes;                   // the first byte that is not zero of every padding that is not: harmless
  uint64_t end_bytes = kBlockBytes;  // of the last intact chunk
  uint64_t file_bytes = kBlockBytes;
  std::optional<StreamEnd>
      end;  // the end record, where it is the file's last block and follows the last chunk
};

// Thread safety: const functions may be called from any number of threads.
class StreamReader {
 public:
  // Opens <folder>/<camera>.stream and reads its index; records are those of the index, which ends early
  // where the recorder did not close the take. Without an index there are none. Errors of PosixFile;
  // InvalidArgument: not a stream, or that of another camera or take.
  static absl::StatusOr<std::unique_ptr<StreamReader>> Open(const std::string& folder,
                                                            const std::string& camera_id);

  // The same for a damaged header or an empty file. header_damage() then describes the damage. The stream
  // counts as one of `take` or, at 0, of the take of its first intact chunk. Errors of PosixFile.
  static absl::StatusOr<std::unique_ptr<StreamReader>> OpenDamaged(const std::string& folder,
                                                                   const std::string& camera_id,
                                                                   uint64_t take);
  const std::string& header_damage() const { return header_damage_; }

  const StreamHeader& header() const { return header_; }
  // The end record, where the file ends with one. Version 1 has none.
  const std::optional<StreamEnd>& end() const { return end_; }
  const std::vector<IndexRecord>& records() const { return records_; }
  // What is wrong with the index, in words; empty where it is whole.
  const std::string& index_damage() const { return index_damage_; }

  // The frame of a chunk, byte by byte as recorded. NotFound: the camera had no frame, the message is the
  // reason. DataLoss: the chunk is damaged.
  absl::StatusOr<RawFrame> Read(const IndexRecord& record) const;
  // The same from a file that holds the bytes of the chunk alone, BytesOf(record).
  absl::StatusOr<RawFrame> ReadCopy(const IndexRecord& record, const std::string& copy) const;
  static uint64_t BytesOf(const IndexRecord& record) { return kBlockBytes + record.payload_bytes; }
  const std::string& path() const { return file_.path(); }
  // The header alone. DataLoss as above.
  absl::StatusOr<ChunkHeader> ReadHeader(const IndexRecord& record) const;

  // Reads everything and checks every checksum. Damaged places are skipped by looking for the next chunk.
  absl::StatusOr<StreamScan> Scan() const;

 private:
  absl::StatusOr<ChunkHeader> ReadHeaderAt(const IndexRecord& record, const PosixFile& file,
                                           uint64_t offset_bytes) const;
  absl::StatusOr<RawFrame> ReadAt(const IndexRecord& record, const PosixFile& file,
                                  uint64_t offset_bytes) const;
  StreamReader(PosixFile file, StreamHeader header) : file_(std::move(file)), header_(std::move(header)) {}
  static absl::StatusOr<StreamHeader> ReadHeaderOf(const PosixFile& file, const std::string& camera_id);
  void ReadIndex(const std::string& path);
  void ReadEnd();
  uint64_t TakeOfFirstChunk() const;
  // The chunk at this place, with its payload checked; false with the reason where there is none.
  bool CheckChunk(uint64_t offset_bytes, uint64_t file_bytes, AlignedBuffer& block, ChunkHeader& header,
                  StreamScan& scan, std::string& why) const;
  // Appends to `stray_bytes` where the description's last block does not end in zeros.
  absl::Status CheckDescriptionPadding(StreamScan& scan) const;
  // The next block after `offset_bytes` that begins like a chunk; `file_bytes` where there is none.
  absl::StatusOr<uint64_t> NextChunk(uint64_t offset_bytes, uint64_t file_bytes) const;

  PosixFile file_;
  StreamHeader header_;
  std::string header_damage_;
  std::optional<StreamEnd> end_;
  std::vector<IndexRecord> records_;
  std::string index_damage_;
};

}  // namespace weft

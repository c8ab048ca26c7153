// The bytes of a take's streams and indexes (docs/file-formats.md, "Recorded takes"). No I/O here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/aligned_buffer.h"
#include "capture/image/raw_frame.h"

namespace weft {

// Streams of version 1 have no description and no end record.
inline constexpr uint32_t kStreamVersion = 2;

// A file is of this take, this version and this camera.
struct StreamHeader {
  uint64_t take = 0;  // random, tells streams of different takes apart
  std::string camera_id;
  std::string description;  // of the take, as take.json says it when the stream begins; may be empty
  uint32_t version = kStreamVersion;

  // Bytes before the first chunk.
  uint64_t size_in_stream() const { return kBlockBytes + PaddedBytes(description.size()); }
};

// How a chunk's payload holds the bytes of the frame.
enum class PayloadCodec : uint32_t {
  kRaw = 0,         // as the camera delivered them
  kPlanesZstd = 1,  // capture/take/frame_codec.h
  kMissing = 2,     // no frame; the header says why
};

// What precedes the payload of one frame set's frame.
struct ChunkHeader {
  uint64_t take = 0;
  uint64_t sequence = 0;  // position in the stream
  uint64_t set = 0;       // number of the frame set
  int64_t device_time_ns = 0;
  int64_t host_time_ns = 0;
  uint64_t device_frame_id = 0;
  int width_px = 0;
  int height_px = 0;
  RawFormat format = RawFormat::kMono8;
  PayloadCodec codec = PayloadCodec::kRaw;
  uint64_t frame_bytes = 0;    // of the frame
  uint64_t payload_bytes = 0;  // as stored, without padding
  uint64_t checksum = 0;       // of the payload as stored
  std::string reason;          // kMissing only; at most kMaxReasonBytes

  // Bytes of header and padded payload in the stream.
  uint64_t size_in_stream() const { return kBlockBytes + PaddedBytes(payload_bytes); }
};

// The last block of a stream that was closed: until when was recorded, and how it went. A stream without it
// was cut, or its recorder crashed.
enum class TakeOutcome : uint32_t { kComplete = 1, kStopped = 2, kRecovered = 3 };
struct StreamEnd {
  uint64_t take = 0;
  uint64_t chunks = 0;             // of this stream
  uint64_t last_set = 0;           // of this stream; 0 where it has no chunk
  int64_t ended_host_time_ns = 0;  // when the take ended; 0 where that is not known
  TakeOutcome outcome = TakeOutcome::kComplete;
  uint64_t sets_recorded = 0;  // of the take, as the ledger accounts for them
  uint64_t sets_dropped = 0;
  uint64_t frames_missing = 0;
  std::string cause;  // why it stopped; at most kMaxReasonBytes

  bool operator==(const StreamEnd&) const = default;
};

inline constexpr size_t kMaxDescriptionBytes = size_t{16} << 20;
inline constexpr size_t kMaxCameraIdBytes = 128;
inline constexpr size_t kMaxReasonBytes = 1024;
inline constexpr uint64_t kMaxPayloadBytes = uint64_t{1} << 32;

// Where a chunk is, and what is asked of it most. Fixed size in the file, with its own checksum.
struct IndexRecord {
  uint64_t sequence = 0;
  uint64_t offset_bytes = 0;  // of the chunk's header in the stream
  uint64_t set = 0;
  int64_t device_time_ns = 0;
  int64_t host_time_ns = 0;
  uint64_t payload_bytes = 0;
  uint64_t checksum = 0;  // of the payload
  bool is_missing = false;

  bool operator==(const IndexRecord&) const = default;
};
inline constexpr size_t kIndexRecordBytes = 72;

// One block each.
using Block = std::array<uint8_t, kBlockBytes>;
void WriteBlock(const StreamHeader& header, uint8_t* block);
void WriteBlock(const ChunkHeader& header, uint8_t* block);
void WriteBlock(const StreamEnd& end, uint8_t* block);
// The block of the header, and the description's blocks.
std::string HeaderBytes(const StreamHeader& header);
// InvalidArgument: not such a block, of another version, or damaged; says what is wrong, without a file name.
// A chunk's header that is accepted has a known format and codec and sizes that fit each other.
absl::StatusOr<ChunkHeader> ReadChunkHeader(const uint8_t* block);
absl::StatusOr<StreamEnd> ReadStreamEnd(const uint8_t* block);
// The header without its description, whose size and checksum follow from the block too.
struct StreamHeaderBlock {
  StreamHeader header;
  uint64_t description_bytes = 0;
  uint64_t description_checksum = 0;
};
absl::StatusOr<StreamHeaderBlock> ReadStreamHeader(const uint8_t* block);
// True where a chunk's header or an end record may stand: cheap, without a check.
bool BeginsLikeChunk(const uint8_t* block);
bool BeginsLikeEnd(const uint8_t* block);

// The index starts with a header of a record's size. Parsing stops at the first record that is damaged,
// cut off or does not continue the one before it. A crash may leave such records at the end;
// `ignored_bytes` is their size.
std::string IndexHeader(uint64_t take);
void AppendTo(std::string& index, const IndexRecord& record);
struct ParsedIndex {
  uint64_t take = 0;
  std::vector<IndexRecord> records;
  uint64_t ignored_bytes = 0;
};
absl::StatusOr<ParsedIndex> ParseIndex(std::string_view bytes);

// The record of a chunk at this place.
IndexRecord RecordOf(const ChunkHeader& header, uint64_t offset_bytes);

// Camera ids become file names: letters, digits, '.', '_' and '-', not starting with a dot. InvalidArgument
// names the id.
absl::Status CheckCameraId(std::string_view id);

}  // namespace weft

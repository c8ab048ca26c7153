#include "capture/take/take_format.h"

#include <bit>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little, "the format is little-endian, and so is this code");

constexpr char kStreamMagic[9] = "WEFTSTRM";
constexpr char kChunkMagic[9] = "WEFTCHNK";
constexpr char kEndMagic[9] = "WEFTENDS";
constexpr char kIndexMagic[9] = "WEFTINDX";
constexpr uint32_t kVersion = 1;  // of chunks and indexes

class Writer {
 public:
  explicit Writer(uint8_t* at) : at_(at) {}
  Writer& Magic(const char* magic) { return Bytes(magic, 8); }
  template <typename T>
  Writer& Number(T value) {
    return Bytes(&value, sizeof value);
  }
  Writer& Text(std::string_view text, size_t limit) {
    text = text.substr(0, limit);
    Number(static_cast<uint32_t>(text.size()));
    return Bytes(text.data(), text.size());
  }

 private:
  Writer& Bytes(const void* bytes, size_t size) {
    std::memcpy(at_, bytes, size);
    at_ += size;
    return *this;
  }
  uint8_t* at_;
};

class Reader {
 public:
  explicit Reader(const uint8_t* at) : at_(at) {}
  template <typename T>
  T Number() {
    T value;
    std::memcpy(&value, at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  // False where the text is longer than the limit.
  bool Text(size_t limit, std::string& text) {
    const auto size = Number<uint32_t>();
    if (size > limit) return false;
    text.assign(reinterpret_cast<const char*>(at_), size);
    at_ += size;
    return true;
  }

 private:
  const uint8_t* at_;
};

constexpr size_t kSealedBytes = kBlockBytes - sizeof(uint64_t);

void Seal(uint8_t* block) {
  const uint64_t checksum = Checksum(block, kSealedBytes);
  std::memcpy(block + kSealedBytes, &checksum, sizeof checksum);
}

absl::Status CheckBlock(const uint8_t* block, const char* magic, const char* what, uint32_t first_version,
                        uint32_t last_version) {
  if (std::memcmp(block, magic, 8) != 0) return absl::InvalidArgumentError(absl::StrCat("no ", what));
  uint64_t checksum;
  std::memcpy(&checksum, block + kSealedBytes, sizeof checksum);
  if (checksum != Checksum(block, kSealedBytes))
    return absl::InvalidArgumentError(absl::StrCat("damaged ", what));
  uint32_t version;
  std::memcpy(&version, block + 8, sizeof version);
  if (version >= first_version && version <= last_version) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(what, " of version ", version, "; this program reads up to version ", last_version));
}

absl::Status CheckChunk(const ChunkHeader& header, uint32_t format) {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("chunk header with impossible ", what));
  };
  if (header.codec > PayloadCodec::kMissing) return bad("codec");
  if (header.codec == PayloadCodec::kMissing) {
    return header.payload_bytes == 0 && header.frame_bytes == 0 ? absl::OkStatus() : bad("size");
  }
  if (!IsRawFormat(format)) return bad("pixel format");
  if (header.width_px <= 0 || header.height_px <= 0 || header.width_px > 65536 || header.height_px > 65536) {
    return bad("image size");
  }
  if (header.frame_bytes > kMaxPayloadBytes || header.payload_bytes > kMaxPayloadBytes) return bad("size");
  const uint64_t expected = RawBytes(header.format, header.width_px, header.height_px);
  if (header.frame_bytes == 0 || (expected != 0 && header.frame_bytes != expected)) return bad("frame size");
  if (header.codec == PayloadCodec::kRaw && header.payload_bytes != header.frame_bytes)
    return bad("payload size");
  return absl::OkStatus();
}

}  // namespace

void WriteBlock(const StreamHeader& header, uint8_t* block) {
  std::memset(block, 0, kBlockBytes);
  Writer(block)
      .Magic(kStreamMagic)
      .Number(header.version)
      .Number(header.take)
      .Text(header.camera_id, kMaxCameraIdBytes)
      .Number(static_cast<uint64_t>(header.description.size()))
      .Number(Checksum(header.description.data(), header.description.size()));
  if (header.version == 1) std::memset(block + 24 + header.camera_id.size(), 0, 16);
  Seal(block);
}

std::string HeaderBytes(const StreamHeader& header) {
  std::string bytes(header.size_in_stream(), '\0');
  WriteBlock(header, reinterpret_cast<uint8_t*>(bytes.data()));
  return bytes.replace(kBlockBytes, header.description.size(), header.description);
}

void WriteBlock(const StreamEnd& end, uint8_t* block) {
  std::memset(block, 0, kBlockBytes);
  Writer(block)
      .Magic(kEndMagic)
      .Number(kStreamVersion)
      .Number(static_cast<uint32_t>(end.outcome))
      .Number(end.take)
      .Number(end.chunks)
      .Number(end.last_set)
      .Number(end.ended_host_time_ns)
      .Number(end.sets_recorded)
      .Number(end.sets_dropped)
      .Number(end.frames_missing)
      .Text(end.cause, kMaxReasonBytes);
  Seal(block);
}

void WriteBlock(const ChunkHeader& header, uint8_t* block) {
  std::memset(block, 0, kBlockBytes);
  Writer(block)
      .Magic(kChunkMagic)
      .Number(kVersion)
      .Number(static_cast<uint32_t>(header.codec))
      .Number(header.take)
      .Number(header.sequence)
      .Number(header.set)
      .Number(header.device_time_ns)
      .Number(header.host_time_ns)
      .Number(header.device_frame_id)
      .Number(static_cast<int32_t>(header.width_px))
      .Number(static_cast<int32_t>(header.height_px))
      .Number(static_cast<uint32_t>(header.format))
      .Number(uint32_t{0})
      .Number(header.frame_bytes)
      .Number(header.payload_bytes)
      .Number(header.checksum)
      .Text(header.reason, kMaxReasonBytes);
  Seal(block);
}

absl::StatusOr<StreamHeaderBlock> ReadStreamHeader(const uint8_t* block) {
  WEFT_RETURN_IF_ERROR(CheckBlock(block, kStreamMagic, "stream header", 1, kStreamVersion));
  StreamHeaderBlock read;
  StreamHeader& header = read.header;
  Reader reader(block + 8);
  header.version = reader.Number<uint32_t>();
  header.take = reader.Number<uint64_t>();
  if (!reader.Text(kMaxCameraIdBytes, header.camera_id)) {
    return absl::InvalidArgumentError("stream header with an impossible camera id");
  }
  WEFT_RETURN_IF_ERROR(CheckCameraId(header.camera_id));
  if (header.version == 1) return read;
  read.description_bytes = reader.Number<uint64_t>();
  read.description_checksum = reader.Number<uint64_t>();
  if (read.description_bytes <= kMaxDescriptionBytes) return read;
  return absl::InvalidArgumentError("stream header with an impossible description");
}

absl::StatusOr<StreamEnd> ReadStreamEnd(const uint8_t* block) {
  WEFT_RETURN_IF_ERROR(CheckBlock(block, kEndMagic, "end record", kStreamVersion, kStreamVersion));
  Reader reader(block + 12);
  StreamEnd end;
  const auto outcome = reader.Number<uint32_t>();
  end.outcome = static_cast<TakeOutcome>(outcome);
  end.take = reader.Number<uint64_t>();
  end.chunks = reader.Number<uint64_t>();
  end.last_set = reader.Number<uint64_t>();
  end.ended_host_time_ns = reader.Number<int64_t>();
  end.sets_recorded = reader.Number<uint64_t>();
  end.sets_dropped = reader.Number<uint64_t>();
  end.frames_missing = reader.Number<uint64_t>();
  if (outcome >= 1 && outcome <= 3 && reader.Text(kMaxReasonBytes, end.cause)) return end;
  return absl::InvalidArgumentError("end record with impossible content");
}

absl::StatusOr<ChunkHeader> ReadChunkHeader(const uint8_t* block) {
  WEFT_RETURN_IF_ERROR(CheckBlock(block, kChunkMagic, "chunk header", kVersion, kVersion));
  Reader reader(block + 12);
  ChunkHeader header;
  header.codec = static_cast<PayloadCodec>(reader.Number<uint32_t>());
  header.take = reader.Number<uint64_t>();
  header.sequence = reader.Number<uint64_t>();
  header.set = reader.Number<uint64_t>();
  header.device_time_ns = reader.Number<int64_t>();
  header.host_time_ns = reader.Number<int64_t>();
  header.device_frame_id = reader.Number<uint64_t>();
  header.width_px = reader.Number<int32_t>();
  header.height_px = reader.Number<int32_t>();
  const auto format = reader.Number<uint32_t>();
  header.format = static_cast<RawFormat>(format);
  reader.Number<uint32_t>();  // reserved
  header.frame_bytes = reader.Number<uint64_t>();
  header.payload_bytes = reader.Number<uint64_t>();
  header.checksum = reader.Number<uint64_t>();
  if (!reader.Text(kMaxReasonBytes, header.reason)) {
    return absl::InvalidArgumentError("chunk header with an impossible reason");
  }
  WEFT_RETURN_IF_ERROR(CheckChunk(header, format));
  return header;
}

bool BeginsLikeChunk(const uint8_t* block) { return std::memcmp(block, kChunkMagic, 8) == 0; }

bool BeginsLikeEnd(const uint8_t* block) { return std::memcmp(block, kEndMagic, 8) == 0; }

std::string IndexHeader(uint64_t take) {
  std::string bytes(kIndexRecordBytes, '\0');
  auto* at = reinterpret_cast<uint8_t*>(bytes.data());
  Writer(at).Magic(kIndexMagic).Number(kVersion).Number(take);
  Writer(at + kIndexRecordBytes - 8).Number(Checksum(at, kIndexRecordBytes - 8));
  return bytes;
}

void AppendTo(std::string& index, const IndexRecord& record) {
  std::array<uint8_t, kIndexRecordBytes> bytes{};
  Writer(bytes.data())
      .Number(record.sequence)
      .Number(record.offset_bytes)
      .Number(record.set)
      .Number(record.device_time_ns)
      .Number(record.host_time_ns)
      .Number(record.payload_bytes)
      .Number(record.checksum)
      .Number(static_cast<uint64_t>(record.is_missing));
  Writer(bytes.data() + kIndexRecordBytes - 8).Number(Checksum(bytes.data(), kIndexRecordBytes - 8));
  index.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

namespace {

bool IsSealedRecord(const uint8_t* at) {
  return Reader(at + kIndexRecordBytes - 8).Number<uint64_t>() == Checksum(at, kIndexRecordBytes - 8);
}

// The record at `at` where it continues `before`.
bool ReadRecord(const uint8_t* at, const IndexRecord* before, IndexRecord& record) {
  if (!IsSealedRecord(at)) return false;
  Reader reader(at);
  record.sequence = reader.Number<uint64_t>();
  record.offset_bytes = reader.Number<uint64_t>();
  record.set = reader.Number<uint64_t>();
  record.device_time_ns = reader.Number<int64_t>();
  record.host_time_ns = reader.Number<int64_t>();
  record.payload_bytes = reader.Number<uint64_t>();
  record.checksum = reader.Number<uint64_t>();
  record.is_missing = false;
  const auto missing = reader.Number<uint64_t>();
  if (missing > 1 || record.payload_bytes > kMaxPayloadBytes) return false;
  record.is_missing = missing == 1;
  if (record.offset_bytes % kBlockBytes != 0 || record.offset_bytes < kBlockBytes ||
      record.offset_bytes > uint64_t{1} << 62) {
    return false;
  }
  return before == nullptr ||
         (record.sequence > before->sequence && record.set > before->set &&
          record.offset_bytes >= before->offset_bytes + kBlockBytes + PaddedBytes(before->payload_bytes));
}

}  // namespace

absl::StatusOr<ParsedIndex> ParseIndex(std::string_view bytes) {
  const auto* at = reinterpret_cast<const uint8_t*>(bytes.data());
  if (bytes.size() < kIndexRecordBytes || std::memcmp(at, kIndexMagic, 8) != 0 || !IsSealedRecord(at)) {
    return absl::InvalidArgumentError("no index header");
  }
  Reader header(at + 8);
  if (const auto version = header.Number<uint32_t>(); version != kVersion) {
    return absl::InvalidArgumentError(
        absl::StrCat("index of version ", version, "; this program reads ", kVersion));
  }
  ParsedIndex index;
  index.take = header.Number<uint64_t>();
  size_t read = kIndexRecordBytes;
  for (; read + kIndexRecordBytes <= bytes.size(); read += kIndexRecordBytes) {
    IndexRecord record;
    const IndexRecord* before = index.records.empty() ? nullptr : &index.records.back();
    if (!ReadRecord(at + read, before, record)) break;
    index.records.push_back(record);
  }
  index.ignored_bytes = bytes.size() - read;
  return index;
}

IndexRecord RecordOf(const ChunkHeader& header, uint64_t offset_bytes) {
  return {header.sequence,     offset_bytes,         header.set,      header.device_time_ns,
          header.host_time_ns, header.payload_bytes, header.checksum, header.codec == PayloadCodec::kMissing};
}

absl::Status CheckCameraId(std::string_view id) {
  bool fits = !id.empty() && id.size() <= kMaxCameraIdBytes && id.front() != '.';
  for (const char c : id)
    fits = fits && (absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-');
  if (fits) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("camera id \"", std::string(id),
                   "\" cannot be the name of a stream; use letters, digits, '.', '_' and '-', at most ",
                   kMaxCameraIdBytes, " of them"));
}

}  // namespace weft

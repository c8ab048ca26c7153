#include "capture/take/stream_reader.h"

#include <fcntl.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "capture/take/frame_codec.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

constexpr uint64_t kMaxIndexBytes = uint64_t{1} << 32;
constexpr size_t kSearchBytes = size_t{256} * kBlockBytes;  // read at a time when looking for the next chunk

absl::Status DataLoss(const PosixFile& file, uint64_t offset_bytes, absl::string_view what) {
  return absl::DataLossError(absl::StrCat(file.path(), ": byte ", offset_bytes, ": ", what));
}

// Padding stands from `begin` to `end` of the bytes that were read at `offset_bytes` of the file.
void NoteStrayByte(const uint8_t* bytes, uint64_t begin, uint64_t end, uint64_t offset_bytes,
                   StreamScan& scan) {
  const uint8_t* stray = std::find_if(bytes + begin, bytes + end, [](uint8_t byte) { return byte != 0; });
  if (stray != bytes + end) scan.stray_bytes.push_back(offset_bytes + static_cast<uint64_t>(stray - bytes));
}

}  // namespace

absl::StatusOr<StreamHeader> StreamReader::ReadHeaderOf(const PosixFile& file, const std::string& camera_id) {
  const auto bad = [&](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat(file.path(), ": ", what));
  };
  AlignedBuffer block(kBlockBytes);
  const absl::Status read = file.ReadAt(block.data(), kBlockBytes, 0);
  if (absl::IsOutOfRange(read)) return bad("the file ends before its header does");
  if (!read.ok()) return read;
  absl::StatusOr<StreamHeaderBlock> parsed = ReadStreamHeader(block.data());
  if (!parsed.ok()) return bad(parsed.status().message());
  StreamHeader& header = parsed->header;
  if (header.camera_id != camera_id) return bad(absl::StrCat("is the stream of camera ", header.camera_id));
  WEFT_ASSIGN_OR_RETURN(const uint64_t size, file.Size());
  if (kBlockBytes + parsed->description_bytes > size) return bad("the file ends before its header does");
  header.description.resize(parsed->description_bytes);
  WEFT_RETURN_IF_ERROR(file.ReadAt(header.description.data(), header.description.size(), kBlockBytes));
  if (header.version > 1 &&
      Checksum(header.description.data(), header.description.size()) != parsed->description_checksum)
    return bad("damaged stream header");
  return header;
}

absl::StatusOr<std::unique_ptr<StreamReader>> StreamReader::Open(const std::string& folder,
                                                                 const std::string& camera_id) {
  WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(StreamFile(folder, camera_id), O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(StreamHeader header, ReadHeaderOf(file, camera_id));
  auto reader = std::unique_ptr<StreamReader>(new StreamReader(std::move(file), std::move(header)));
  reader->ReadIndex(IndexFile(folder, camera_id));
  reader->ReadEnd();
  return reader;
}

absl::StatusOr<std::unique_ptr<StreamReader>> StreamReader::OpenDamaged(const std::string& folder,
                                                                        const std::string& camera_id,
                                                                        uint64_t take) {
  absl::StatusOr<std::unique_ptr<StreamReader>> whole = Open(folder, camera_id);
  if (whole.ok() || !absl::IsInvalidArgument(whole.status())) return whole;
  WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(StreamFile(folder, camera_id), O_RDONLY));
  auto reader = std::unique_ptr<StreamReader>(
      new StreamReader(std::move(file), StreamHeader{take, camera_id, "", kStreamVersion}));
  reader->header_damage_ = std::string(whole.status().message());
  if (take == 0) reader->header_.take = reader->TakeOfFirstChunk();
  reader->ReadIndex(IndexFile(folder, camera_id));
  reader->ReadEnd();
  return reader;
}

uint64_t StreamReader::TakeOfFirstChunk() const {
  const uint64_t file_bytes = file_.Size().value_or(0);
  AlignedBuffer block(kBlockBytes);
  uint64_t at = 0;
  while (true) {
    const absl::StatusOr<uint64_t> next = NextChunk(at, file_bytes);
    if (!next.ok() || *next >= file_bytes) return 0;
    at = *next;
    if (!file_.ReadAt(block.data(), kBlockBytes, at).ok()) return 0;
    if (const absl::StatusOr<ChunkHeader> header = ReadChunkHeader(block.data()); header.ok())
      return header->take;
  }
}

void StreamReader::ReadEnd() {
  const absl::StatusOr<uint64_t> size = file_.Size();
  AlignedBuffer block(kBlockBytes);
  if (!size.ok() || *size < 2 * kBlockBytes || *size % kBlockBytes != 0 ||
      !file_.ReadAt(block.data(), kBlockBytes, *size - kBlockBytes).ok() || !BeginsLikeEnd(block.data()))
    return;
  absl::StatusOr<StreamEnd> end = ReadStreamEnd(block.data());
  if (end.ok() && end->take == header_.take) end_ = *std::move(end);
}

void StreamReader::ReadIndex(const std::string& path) {
  const absl::StatusOr<PosixFile> file = PosixFile::Open(path, O_RDONLY);
  const absl::StatusOr<uint64_t> size = file.ok() ? file->Size() : absl::StatusOr<uint64_t>(file.status());
  if (!size.ok()) {
    index_damage_ = std::string(size.status().message());
    return;
  }
  std::string bytes(std::min(*size, kMaxIndexBytes), '\0');
  absl::StatusOr<ParsedIndex> index = ParsedIndex{};
  if (const absl::Status read = file->ReadAt(bytes.data(), bytes.size(), 0); !read.ok()) {
    index = read;
  } else {
    index = ParseIndex(bytes);
  }
  if (index.ok() && index->take != header_.take)
    index = absl::InvalidArgumentError("belongs to another take");
  if (!index.ok()) {
    index_damage_ = absl::StrCat(path, ": ", index.status().message());
    return;
  }
  records_ = std::move(index->records);
  if (index->ignored_bytes > 0) {
    index_damage_ = absl::StrCat(path, ": the last ", index->ignored_bytes, " bytes are no records");
  }
}

absl::StatusOr<ChunkHeader> StreamReader::ReadHeader(const IndexRecord& record) const {
  return ReadHeaderAt(record, file_, record.offset_bytes);
}

absl::StatusOr<ChunkHeader> StreamReader::ReadHeaderAt(const IndexRecord& record, const PosixFile& file,
                                                       uint64_t offset_bytes) const {
  AlignedBuffer block(kBlockBytes);
  const absl::Status read = file.ReadAt(block.data(), kBlockBytes, offset_bytes);
  if (absl::IsOutOfRange(read))
    return DataLoss(file_, record.offset_bytes, "the stream is shorter than its index");
  if (!read.ok()) return read;
  absl::StatusOr<ChunkHeader> header = ReadChunkHeader(block.data());
  if (!header.ok()) return DataLoss(file_, record.offset_bytes, header.status().message());
  if (header->take != header_.take || RecordOf(*header, record.offset_bytes) != record) {
    return DataLoss(file_, record.offset_bytes, "the chunk is another one than the index says");
  }
  return header;
}

absl::StatusOr<RawFrame> StreamReader::Read(const IndexRecord& record) const {
  return ReadAt(record, file_, record.offset_bytes);
}

absl::StatusOr<RawFrame> StreamReader::ReadCopy(const IndexRecord& record, const std::string& copy) const {
  const absl::StatusOr<PosixFile> file = PosixFile::Open(copy, O_RDONLY);
  return file.ok() ? ReadAt(record, *file, 0) : file.status();
}

absl::StatusOr<RawFrame> StreamReader::ReadAt(const IndexRecord& record, const PosixFile& file,
                                              uint64_t offset_bytes) const {
  WEFT_ASSIGN_OR_RETURN(const ChunkHeader header, ReadHeaderAt(record, file, offset_bytes));
  if (header.codec == PayloadCodec::kMissing) return absl::NotFoundError(header.reason);
  WEFT_ASSIGN_OR_RETURN(const uint64_t file_bytes, file.Size());
  if (offset_bytes + kBlockBytes + header.payload_bytes > file_bytes) {
    return DataLoss(file_, record.offset_bytes, "the stream ends inside the frame");
  }
  auto payload = std::make_unique<AlignedBuffer>(header.payload_bytes);
  WEFT_RETURN_IF_ERROR(file.ReadAt(payload->data(), payload->size(), offset_bytes + kBlockBytes));
  if (Checksum(payload->data(), payload->size()) != header.checksum) {
    return DataLoss(file_, record.offset_bytes, "the frame does not fit its checksum");
  }
  if (header.codec == PayloadCodec::kPlanesZstd) {
    auto unpacked = DecodeFrameBytes(*payload, header.format, header.width_px, header.frame_bytes);
    if (!unpacked.ok()) return DataLoss(file_, record.offset_bytes, unpacked.status().message());
    payload = *std::move(unpacked);
  }
  RawFrame frame;
  frame.camera_id = header_.camera_id;
  frame.width_px = header.width_px;
  frame.height_px = header.height_px;
  frame.format = header.format;
  frame.bytes = std::move(payload);
  frame.device_time_ns = header.device_time_ns;
  frame.host_time_ns = header.host_time_ns;
  frame.device_frame_id = header.device_frame_id;
  return frame;
}

bool StreamReader::CheckChunk(uint64_t offset_bytes, uint64_t file_bytes, AlignedBuffer& block,
                              ChunkHeader& header, StreamScan& scan, std::string& why) const {
  if (!file_.ReadAt(block.data(), kBlockBytes, offset_bytes).ok()) {
    why = "the block cannot be read";
    return false;
  }
  absl::StatusOr<ChunkHeader> read = ReadChunkHeader(block.data());
  if (!read.ok()) {
    why = std::string(read.status().message());
    return false;
  }
  if (read->take != header_.take) {
    why = "chunk of another take";
    return false;
  }
  if (offset_bytes + kBlockBytes + read->payload_bytes > file_bytes) {
    why = "the stream ends inside the frame";
    return false;
  }
  const uint64_t payload_at = offset_bytes + kBlockBytes;
  AlignedBuffer payload(read->payload_bytes);
  const uint64_t stored_bytes = std::min(PaddedBytes(payload.size()), file_bytes - payload_at);
  if (!file_.ReadAt(payload.data(), stored_bytes, payload_at).ok() ||
      Checksum(payload.data(), payload.size()) != read->checksum) {
    why = absl::StrCat("the frame of set ", read->set, " does not fit its checksum");
    return false;
  }
  NoteStrayByte(payload.data(), payload.size(), stored_bytes, payload_at, scan);
  header = *std::move(read);
  return true;
}

absl::Status StreamReader::CheckDescriptionPadding(StreamScan& scan) const {
  const uint64_t bytes = header_.description.size(), blocks_bytes = header_.size_in_stream() - kBlockBytes;
  if (!header_damage_.empty() || bytes == blocks_bytes || header_.size_in_stream() > scan.file_bytes)
    return absl::OkStatus();
  AlignedBuffer last(kBlockBytes);
  const uint64_t at = header_.size_in_stream() - kBlockBytes;
  WEFT_RETURN_IF_ERROR(file_.ReadAt(last.data(), kBlockBytes, at));
  NoteStrayByte(last.data(), bytes % kBlockBytes, kBlockBytes, at, scan);
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> StreamReader::NextChunk(uint64_t offset_bytes, uint64_t file_bytes) const {
  AlignedBuffer piece(kSearchBytes);
  for (uint64_t at = offset_bytes + kBlockBytes; at + kBlockBytes <= file_bytes; at += kSearchBytes) {
    const uint64_t size = std::min<uint64_t>(kSearchBytes, file_bytes - at);
    WEFT_RETURN_IF_ERROR(file_.ReadAt(piece.data(), size, at));
    for (uint64_t block = 0; block + kBlockBytes <= size; block += kBlockBytes)
      if (BeginsLikeChunk(piece.data() + block) || BeginsLikeEnd(piece.data() + block)) return at + block;
  }
  return file_bytes;
}

absl::StatusOr<StreamScan> StreamReader::Scan() const {
  WEFT_ASSIGN_OR_RETURN(const uint64_t file_bytes, file_.Size());
  StreamScan scan;
  scan.file_bytes = file_bytes;
  WEFT_RETURN_IF_ERROR(CheckDescriptionPadding(scan));
  AlignedBuffer block(kBlockBytes);
  uint64_t at = std::min(header_.size_in_stream(), file_bytes);
  scan.end_bytes = std::max<uint64_t>(at, kBlockBytes);
  while (at + kBlockBytes <= file_bytes) {
    ChunkHeader header;
    std::string why;
    if (CheckChunk(at, file_bytes, block, header, scan, why) &&
        (scan.records.empty() ||
         (header.sequence > scan.records.back().sequence && header.set > scan.records.back().set))) {
      scan.records.push_back(RecordOf(header, at));
      at += header.size_in_stream();
      scan.end_bytes = std::min(at, file_bytes);
      continue;
    }
    if (end_ && at + kBlockBytes == file_bytes && at == scan.end_bytes) {
      scan.end = end_;
      break;
    }
    if (why.empty()) why = absl::StrCat("set ", header.set, " stands after a later one");
    WEFT_ASSIGN_OR_RETURN(const uint64_t next, NextChunk(at, file_bytes));
    if (next < file_bytes || why != "no chunk header") scan.damage.push_back({at, why});
    at = next;
  }
  return scan;
}

}  // namespace weft

#include "capture/take/stream_writer.h"

#include <fcntl.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "capture/take/frame_codec.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

constexpr uint64_t kShareDivisor = 8;  // of the room above the mark, that all streams may reserve at a time

}  // namespace

absl::Status StreamWriterOptions::Validate() const {
  if (zstd_level >= 1 && zstd_level <= 19) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("zstd_level is ", zstd_level, ", expected 1 to 19"));
}

StreamWriter::StreamWriter(PosixFile stream, PosixFile index, const StreamHeader& header,
                           const StreamWriterOptions& options)
    : stream_(std::move(stream)),
      index_(std::move(index)),
      header_(header),
      options_(options),
      end_bytes_(header.size_in_stream()),
      committed_end_bytes_(header.size_in_stream()) {}

absl::StatusOr<std::unique_ptr<StreamWriter>> StreamWriter::Create(const std::string& folder,
                                                                   const StreamHeader& header,
                                                                   const StreamWriterOptions& options) {
  WEFT_RETURN_IF_ERROR(CheckCameraId(header.camera_id));
  const std::string path = StreamFile(folder, header.camera_id);
  constexpr int kNew = O_RDWR | O_CREAT | O_EXCL;
  absl::StatusOr<PosixFile> stream = PosixFile::Open(path, kNew | (options.bypass_page_cache ? O_DIRECT : 0));
  if (!stream.ok() && options.bypass_page_cache && stream.status().code() == absl::StatusCode::kUnavailable) {
    stream = PosixFile::Open(path, O_RDWR | O_CREAT);  // the refusal may have left the file behind
  }
  if (!stream.ok()) return stream.status();
  WEFT_ASSIGN_OR_RETURN(PosixFile index, PosixFile::Open(IndexFile(folder, header.camera_id), kNew));
  auto writer =
      std::unique_ptr<StreamWriter>(new StreamWriter(*std::move(stream), std::move(index), header, options));
  WEFT_RETURN_IF_ERROR(writer->Reserve(header.size_in_stream()));
  const std::string head = HeaderBytes(header);
  AlignedBuffer blocks(head.size());
  std::memcpy(blocks.data(), head.data(), head.size());
  WEFT_RETURN_IF_ERROR(writer->stream_.WriteAt(blocks.data(), blocks.size(), 0));
  const std::string start = IndexHeader(header.take);
  WEFT_RETURN_IF_ERROR(writer->index_.WriteAt(start.data(), start.size(), 0));
  writer->index_bytes_ = start.size();
  return writer;
}

// Streams that reserved all that is free would leave nothing for the ledger, nor for other programs.
uint64_t StreamWriter::Ahead_bytes() const {
  struct statvfs info {};
  if (fstatvfs(stream_.descriptor(), &info) != 0) return 0;
  const uint64_t free_bytes = static_cast<uint64_t>(info.f_bavail) * info.f_frsize;
  const uint64_t above_bytes =
      free_bytes > options_.keep_free_bytes ? free_bytes - options_.keep_free_bytes : 0;
  const uint64_t share_bytes = above_bytes / (kShareDivisor * std::max<uint64_t>(options_.streams, 1));
  return std::min(options_.preallocate_bytes, share_bytes) / kBlockBytes * kBlockBytes;
}

absl::Status StreamWriter::Reserve(uint64_t end_bytes) {
  if (end_bytes <= reserved_bytes_ || options_.preallocate_bytes == 0) return absl::OkStatus();
  const uint64_t room = end_bytes - reserved_bytes_ + Ahead_bytes();
  absl::Status status = stream_.Preallocate(reserved_bytes_, room);
  if (status.ok()) {
    reserved_bytes_ += room;
  } else if (absl::IsResourceExhausted(status)) {
    status = absl::OkStatus();  // the last chunks may still fit
  }
  return status;
}

absl::Status StreamWriter::Write(ChunkHeader& header, const uint8_t* payload) {
  header.take = header_.take;
  header.sequence = sequence_;
  header.checksum = Checksum(payload, header.payload_bytes);
  const uint64_t offset = end_bytes_;
  const uint64_t end = offset + header.size_in_stream();
  WEFT_RETURN_IF_ERROR(Reserve(end));
  WriteBlock(header, header_block_.data());
  const iovec pieces[] = {{header_block_.data(), kBlockBytes},
                          {const_cast<uint8_t*>(payload), PaddedBytes(header.payload_bytes)}};
  WEFT_RETURN_IF_ERROR(stream_.WriteAt(pieces, header.payload_bytes > 0 ? 2 : 1, offset));
  ++sequence_;
  end_bytes_ = end;
  const MutexLock lock(mutex_);
  pending_.push_back(RecordOf(header, offset));
  return absl::OkStatus();
}

absl::Status StreamWriter::Append(uint64_t set, const RawFrame& frame) {
  ChunkHeader header;
  header.set = set;
  header.device_time_ns = frame.device_time_ns;
  header.host_time_ns = frame.host_time_ns;
  header.device_frame_id = frame.device_frame_id;
  header.width_px = frame.width_px;
  header.height_px = frame.height_px;
  header.format = frame.format;
  header.frame_bytes = header.payload_bytes = frame.bytes->size();
  if (!options_.compress) return Write(header, frame.bytes->data());
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<AlignedBuffer> packed, EncodeFrame(frame, options_.zstd_level));
  if (packed->size() >= header.frame_bytes) return Write(header, frame.bytes->data());
  header.codec = PayloadCodec::kPlanesZstd;
  header.payload_bytes = packed->size();
  return Write(header, packed->data());
}

absl::Status StreamWriter::AppendMissing(uint64_t set, int64_t device_time_ns, const std::string& reason) {
  ChunkHeader header;
  header.set = set;
  header.device_time_ns = device_time_ns;
  header.codec = PayloadCodec::kMissing;
  header.reason = reason;
  return Write(header, header_block_.data());
}

absl::Status StreamWriter::Commit(uint64_t last_set) {
  std::vector<IndexRecord> records;
  {
    const MutexLock lock(mutex_);
    for (size_t i = 0; i < pending_.size() && pending_[i].set <= last_set; ++i)
      records.push_back(pending_[i]);
  }
  if (records.empty()) return absl::OkStatus();
  if (flush_failure_.ok()) flush_failure_ = stream_.SyncData();
  if (!flush_failure_.ok()) return flush_failure_;
  std::string bytes;
  for (const IndexRecord& record : records) AppendTo(bytes, record);
  WEFT_RETURN_IF_ERROR(index_.WriteAt(bytes.data(), bytes.size(), index_bytes_));
  index_bytes_ += bytes.size();
  committed_end_bytes_ =
      records.back().offset_bytes + kBlockBytes + PaddedBytes(records.back().payload_bytes);
  {
    const MutexLock lock(mutex_);
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(records.size()));
  }
  committed_.insert(committed_.end(), records.begin(), records.end());
  last_set_ = committed_.back().set;
  return absl::OkStatus();
}

absl::Status StreamWriter::Trim() {
  reserved_bytes_ = end_bytes_.load();
  return stream_.Truncate(end_bytes_);
}

absl::Status StreamWriter::Close(std::optional<uint64_t> last_set) {
  for (; !committed_.empty() && (!last_set || committed_.back().set > *last_set); committed_.pop_back()) {
    committed_end_bytes_ = committed_.back().offset_bytes;
    index_bytes_ -= kIndexRecordBytes;
  }
  if (index_bytes_ == kIndexRecordBytes) {
    last_set_ = 0;
  } else if (last_set) {
    last_set_ = std::min(last_set_, *last_set);
  }
  absl::Status status = index_.Truncate(index_bytes_);
  status.Update(stream_.Truncate(committed_end_bytes_));
  status.Update(stream_.SyncData());
  status.Update(index_.SyncData());
  return status;
}

absl::Status StreamWriter::WriteEnd(StreamEnd end) {
  end.take = header_.take;
  end.chunks = index_bytes_ / kIndexRecordBytes - 1;
  end.last_set = last_set_;
  WriteBlock(end, header_block_.data());
  WEFT_RETURN_IF_ERROR(stream_.WriteAt(header_block_.data(), kBlockBytes, committed_end_bytes_));
  return stream_.SyncData();
}

}  // namespace weft

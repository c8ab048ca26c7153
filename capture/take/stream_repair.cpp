#include "capture/take/stream_repair.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
constexpr uint64_t kPieceBytes = uint64_t{4} << 20;

ChunkHeader GapHeader(const PlannedChunk& gap, uint64_t take) {
  ChunkHeader header;
  header.take = take;
  header.set = gap.set;
  header.device_time_ns = gap.device_time_ns;
  header.host_time_ns = gap.host_time_ns;
  header.codec = PayloadCodec::kMissing;
  header.checksum = Checksum(nullptr, 0);
  header.reason = gap.reason.substr(0, kMaxReasonBytes);
  return header;
}

absl::Status Copy(const PosixFile& from, uint64_t from_bytes, PosixFile& to, uint64_t to_bytes,
                  uint64_t size) {
  std::string piece;
  for (uint64_t done = 0; done < size; done += piece.size()) {
    piece.resize(std::min(kPieceBytes, size - done));
    absl::Status status = from.ReadAt(piece.data(), piece.size(), from_bytes + done);
    if (status.ok()) status = to.WriteAt(piece.data(), piece.size(), to_bytes + done);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// Bytes from `start` to the last one that is not zero.
absl::StatusOr<uint64_t> BytesWithContent(const PosixFile& file, uint64_t start, uint64_t end) {
  std::string piece;
  while (end > start) {
    piece.resize(std::min(kPieceBytes, end - start));
    WEFT_RETURN_IF_ERROR(file.ReadAt(piece.data(), piece.size(), end - piece.size()));
    const size_t last = piece.find_last_not_of('\0');
    if (last != std::string::npos) return end - piece.size() + last + 1 - start;
    end -= piece.size();
  }
  return 0;
}

// Writes chunks one after the other and keeps their index.
class ChunkSink {
 public:
  ChunkSink(PosixFile& file, uint64_t take, uint64_t offset_bytes)
      : file_(file), take_(take), offset_bytes_(offset_bytes) {}

  // The chunk stands in the file already.
  void Skip(const IndexRecord& record) {
    records_.push_back(record);
    offset_bytes_ = record.offset_bytes + kBlockBytes + PaddedBytes(record.payload_bytes);
  }
  absl::Status Gap(const PlannedChunk& gap) { return Write(GapHeader(gap, take_)); }
  absl::Status CopyOf(const IndexRecord& record, const StreamReader& from, const PosixFile& file) {
    WEFT_ASSIGN_OR_RETURN(const ChunkHeader header, from.ReadHeader(record));
    const uint64_t payload = offset_bytes_ + kBlockBytes;
    WEFT_RETURN_IF_ERROR(Write(header));
    // The file is new, so zeros follow whatever followed before.
    return Copy(file, record.offset_bytes + kBlockBytes, file_, payload, record.payload_bytes);
  }
  absl::Status End(StreamEnd end) {
    end.take = take_;
    end.chunks = records_.size();
    end.last_set = records_.empty() ? 0 : records_.back().set;
    AlignedBuffer block(kBlockBytes);
    WriteBlock(end, block.data());
    const absl::Status status = file_.WriteAt(block.data(), kBlockBytes, offset_bytes_);
    offset_bytes_ += kBlockBytes;
    return status;
  }
  absl::Status Finish() {
    WEFT_RETURN_IF_ERROR(file_.Truncate(offset_bytes_));
    return file_.SyncData();
  }
  const std::vector<IndexRecord>& records() const { return records_; }

 private:
  absl::Status Write(ChunkHeader header) {
    header.sequence = records_.empty() ? 0 : records_.back().sequence + 1;
    AlignedBuffer block(kBlockBytes);
    WriteBlock(header, block.data());
    records_.push_back(RecordOf(header, offset_bytes_));
    const absl::Status status = file_.WriteAt(block.data(), kBlockBytes, offset_bytes_);
    offset_bytes_ += header.size_in_stream();
    return status;
  }

  PosixFile& file_;
  const uint64_t take_;
  uint64_t offset_bytes_;
  std::vector<IndexRecord> records_;
};

absl::StatusOr<std::vector<IndexRecord>> Rewrite(const std::string& path, const StreamPlan& plan,
                                                 const StreamEnd& end, KeptAside& aside) {
  const std::string unfinished = path + ".new";
  std::vector<IndexRecord> records;
  {
    WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(unfinished, O_RDWR | O_CREAT | O_TRUNC));
    const std::string head = HeaderBytes(plan.header);
    absl::Status status = file.WriteAt(head.data(), head.size(), 0);
    absl::StatusOr<PosixFile> old = absl::NotFoundError("");
    if (plan.stream->reader) old = PosixFile::Open(path, O_RDONLY);
    ChunkSink sink(file, plan.header.take, head.size());
    for (const PlannedChunk& chunk : plan.chunks) {
      if (!status.ok()) break;
      if (chunk.intact && !old.ok()) return old.status();
      status = chunk.intact ? sink.CopyOf(*chunk.intact, *plan.stream->reader, *old) : sink.Gap(chunk);
    }
    if (status.ok() && plan.header.version > 1) status = sink.End(end);
    if (status.ok()) status = sink.Finish();
    if (!status.ok()) {
      unlink(unfinished.c_str());
      return status;
    }
    records = sink.records();
  }
  if (plan.stream->reader) WEFT_RETURN_IF_ERROR(aside.Keep(path));
  if (rename(unfinished.c_str(), path.c_str()) != 0) return FileError(path, "cannot be replaced", errno);
  WEFT_RETURN_IF_ERROR(SyncFolder(fs::path(path).parent_path().string()));
  return records;
}

absl::StatusOr<std::vector<IndexRecord>> Append(const std::string& path, const StreamPlan& plan,
                                                const StreamEnd& end, KeptAside& aside) {
  WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(path, O_RDWR));
  const StreamScan& scan = plan.stream->scan;
  if (plan.cut_bytes > 0) {
    WEFT_ASSIGN_OR_RETURN(
        const std::string kept,
        aside.Path(absl::StrCat(plan.stream->camera_id, ".stream.from-byte-", scan.end_bytes)));
    WEFT_ASSIGN_OR_RETURN(PosixFile tail, PosixFile::Open(kept, O_RDWR | O_CREAT | O_TRUNC));
    absl::Status status = Copy(file, scan.end_bytes, tail, 0, plan.cut_bytes);
    if (status.ok()) status = tail.SyncData();
    if (status.ok()) status = aside.Sync();
    if (!status.ok()) return status;
  }
  ChunkSink sink(file, plan.header.take, plan.header.size_in_stream());
  for (size_t i = 0; i < plan.first_appended; ++i) sink.Skip(*plan.chunks[i].intact);
  if (plan.first_appended == plan.chunks.size() && plan.cut_bytes == 0 && !plan.needs_end &&
      !plan.changes_length)
    return sink.records();
  // What was cut is kept, and reserved zeros end here, before anything new is written.
  WEFT_RETURN_IF_ERROR(file.Truncate(std::max(scan.end_bytes, plan.header.size_in_stream())));
  absl::Status status;
  for (size_t i = plan.first_appended; i < plan.chunks.size() && status.ok(); ++i)
    status = sink.Gap(plan.chunks[i]);
  if (status.ok() && plan.header.version > 1) status = sink.End(end);
  if (status.ok()) status = sink.Finish();
  if (!status.ok()) return status;
  return sink.records();
}

}  // namespace

absl::StatusOr<std::string> KeptAside::Path(const std::string& name) {
  if (folder_.empty()) {
    const fs::path all = fs::path(take_) / "recovered";
    std::error_code error;
    fs::create_directories(all, error);
    for (int number = 1; !error && folder_.empty(); ++number) {
      const fs::path own = all / std::to_string(number);
      if (fs::create_directory(own, error)) folder_ = own.string();
    }
    if (error) return FileError(all.string(), "cannot be made", error.value());
    absl::Status status = SyncFolder(all.string());
    status.Update(SyncFolder(take_));
    if (!status.ok()) return status;
  }
  return (fs::path(folder_) / name).string();
}

absl::Status KeptAside::Keep(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string kept, Path(fs::path(path).filename().string()));
  // A file system without second names: the file moves, and a repair that is interrupted now finds it gone
  // here.
  if (link(path.c_str(), kept.c_str()) != 0 && rename(path.c_str(), kept.c_str()) != 0)
    return FileError(kept, "cannot be made", errno);
  return Sync();
}

absl::Status KeptAside::Sync() const { return folder_.empty() ? absl::OkStatus() : SyncFolder(folder_); }

absl::StatusOr<StreamPlan> PlanStream(const std::string& take_folder, const ScannedStream& stream,
                                      StreamHeader header, std::vector<PlannedChunk> chunks) {
  StreamPlan plan;
  plan.stream = &stream;
  plan.header = std::move(header);
  plan.chunks = std::move(chunks);
  const StreamScan& scan = stream.scan;
  while (plan.first_appended < plan.chunks.size() && plan.chunks[plan.first_appended].intact)
    ++plan.first_appended;
  plan.is_rewritten = !stream.file_damage().empty() || plan.first_appended < scan.records.size();
  uint64_t at = plan.header.size_in_stream();
  for (const IndexRecord& record : scan.records) {  // nothing stands between them
    plan.is_rewritten |= record.offset_bytes != at;
    at = record.offset_bytes + kBlockBytes + PaddedBytes(record.payload_bytes);
  }
  if (plan.is_rewritten) return plan;
  plan.changes_length = scan.file_bytes < at;  // the padding of the last frame may be cut
  const bool appends = plan.first_appended < plan.chunks.size();
  if (!scan.end && scan.file_bytes > scan.end_bytes) {
    WEFT_ASSIGN_OR_RETURN(const PosixFile file,
                          PosixFile::Open(StreamFile(StreamFolder(take_folder), stream.camera_id), O_RDONLY));
    WEFT_ASSIGN_OR_RETURN(const uint64_t content, BytesWithContent(file, scan.end_bytes, scan.file_bytes));
    plan.cut_bytes = content;
    plan.changes_length = true;
  }
  plan.needs_end =
      plan.header.version > 1 && (appends || !scan.end || scan.end->chunks != scan.records.size());
  plan.needs_index =
      appends || stream.reader->records() != scan.records || !stream.reader->index_damage().empty();
  return plan;
}

absl::Status ApplyPlan(const std::string& take_folder, const StreamPlan& plan, StreamEnd end,
                       KeptAside& aside) {
  if (!plan.has_changes()) return absl::OkStatus();
  const std::string folder = StreamFolder(take_folder);
  const std::string& id = plan.stream->camera_id;
  const std::string path = StreamFile(folder, id), index = IndexFile(folder, id);
  // An index that is short is what a crash leaves; nothing is lost with it.
  const bool keeps_index =
      plan.is_rewritten || (plan.needs_index && !plan.stream->reader->index_damage().empty());
  if (keeps_index && access(index.c_str(), F_OK) == 0) WEFT_RETURN_IF_ERROR(aside.Keep(index));
  WEFT_ASSIGN_OR_RETURN(const std::vector<IndexRecord> records,
                        plan.is_rewritten ? Rewrite(path, plan, end, aside) : Append(path, plan, end, aside));
  if (!plan.is_rewritten && !plan.needs_index) return absl::OkStatus();
  std::string bytes = IndexHeader(plan.header.take);
  for (const IndexRecord& record : records) AppendTo(bytes, record);
  return ReplaceFile(index, bytes);
}

absl::Status ReplaceFile(const std::string& path, const std::string& bytes) {
  const std::string unfinished = path + ".new";
  {
    WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(unfinished, O_RDWR | O_CREAT | O_TRUNC));
    absl::Status status = file.WriteAt(bytes.data(), bytes.size(), 0);
    if (status.ok()) status = file.SyncData();
    if (!status.ok()) {
      unlink(unfinished.c_str());
      return status;
    }
  }
  if (rename(unfinished.c_str(), path.c_str()) != 0) return FileError(path, "cannot be replaced", errno);
  return SyncFolder(fs::path(path).parent_path().string());
}

}  // namespace weft

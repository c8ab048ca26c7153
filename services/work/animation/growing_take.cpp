#include "services/work/animation/growing_take.h"

#include <fcntl.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "capture/take/take_files.h"
#include "services/work/animation/set_in_memory.h"

namespace weft {

absl::StatusOr<GrowingTake> GrowingTake::Open(const std::string& folder, const Rig& rig) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> ids, CamerasOfTake(folder));
  GrowingTake take(rig);
  bool has_any = false;
  for (const CameraModel& camera : rig.cameras) {
    Stream stream;
    if (std::ranges::find(ids, camera.id) != ids.end()) {
      WEFT_ASSIGN_OR_RETURN(stream.reader, StreamReader::Open(StreamFolder(folder), camera.id));
      stream.recent = stream.reader->records();
      stream.index_path = IndexFile(StreamFolder(folder), camera.id);
      stream.index_bytes = (1 + stream.recent.size()) * kIndexRecordBytes;  // a header of a record's size
      has_any = true;
    }
    take.streams_.push_back(std::move(stream));
  }
  if (!has_any)
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": has no camera of the rig (is it the rig of this take?)"));
  return take;
}

absl::StatusOr<const IndexRecord*> GrowingTake::FindRecord(Stream& stream, uint64_t number) {
  const auto find = [&]() -> const IndexRecord* {
    const auto found = std::find_if(stream.recent.rbegin(), stream.recent.rend(),
                                    [number](const IndexRecord& record) { return record.set == number; });
    return found == stream.recent.rend() ? nullptr : &*found;
  };
  if (const IndexRecord* record = find()) return record;
  const absl::StatusOr<PosixFile> file = PosixFile::Open(stream.index_path, O_RDONLY);
  WEFT_ASSIGN_OR_RETURN(const uint64_t size,
                        file.ok() ? file->Size() : absl::StatusOr<uint64_t>(file.status()));
  if (size > stream.index_bytes) {
    std::string fresh(size - stream.index_bytes, '\0');
    WEFT_RETURN_IF_ERROR(file->ReadAt(fresh.data(), fresh.size(), stream.index_bytes));
    WEFT_ASSIGN_OR_RETURN(ParsedIndex parsed, ParseIndex(IndexHeader(stream.reader->header().take) + fresh));
    stream.recent = std::move(parsed.records);
    stream.index_bytes += stream.recent.size() * kIndexRecordBytes;
    if (const IndexRecord* record = find()) return record;
  }
  return absl::NotFoundError("the stream lacks this frame set");
}

absl::StatusOr<std::shared_ptr<const FrameSource>> GrowingTake::Read(uint64_t number) {
  RawFrameSet set;
  set.number = number;
  std::vector<StoredPicture> stored(streams_.size());
  for (size_t camera = 0; camera < streams_.size(); ++camera) {
    Stream& stream = streams_[camera];
    if (!stream.reader) continue;
    const absl::StatusOr<const IndexRecord*> record = FindRecord(stream, number);
    if (absl::IsNotFound(record.status())) {
      set.missing.push_back({rig_.cameras[camera].id, std::string(record.status().message())});
      continue;
    }
    if (!record.ok()) return record.status();
    stored[camera] = {(*record)->is_missing ? 0 : (*record)->payload_bytes, (*record)->checksum};
    absl::StatusOr<RawFrame> frame = stream.reader->Read(**record);
    if (frame.ok()) {
      set.frames.push_back(*std::move(frame));
    } else {
      set.missing.push_back({rig_.cameras[camera].id, std::string(frame.status().message())});
    }
  }
  return std::make_shared<SetInMemory>(std::move(set), rig_, std::move(stored));
}

}  // namespace weft

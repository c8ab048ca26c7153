#include "capture/take/recorded_take.h"

#include <fcntl.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"
#include "capture/image/image_size.h"
#include "capture/rig/camera_match.h"
#include "capture/take/frame_set_reading.h"
#include "capture/take/take_files.h"
#include "capture/take/view_moment.h"

namespace weft {

absl::StatusOr<std::unique_ptr<RecordedTake>> RecordedTake::Open(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(std::vector<std::string> ids, CamerasOfTake(folder));
  auto take = std::unique_ptr<RecordedTake>(new RecordedTake);
  take->camera_ids_ = std::move(ids);
  for (const std::string& id : take->camera_ids_) {
    WEFT_ASSIGN_OR_RETURN(auto stream, StreamReader::Open(StreamFolder(folder), id));
    take->streams_.push_back(std::move(stream));
    const StreamReader& opened = *take->streams_.back();
    if (opened.header().take != take->take()) {
      return absl::InvalidArgumentError(absl::StrCat(folder, ": the streams of cameras ",
                                                     take->camera_ids_.front(), " and ", id,
                                                     " are of different takes"));
    }
    if (!opened.index_damage().empty()) {
      take->warnings_.push_back(
          absl::StrCat(opened.index_damage(), "; run `weft take recover ", folder, "`"));
    }
  }
  take->ReadLedger(folder);
  take->MergeSets();
  return take;
}

void RecordedTake::ReadLedger(const std::string& folder) {
  const absl::StatusOr<PosixFile> file = PosixFile::Open(LedgerFile(folder), O_RDONLY);
  const absl::StatusOr<uint64_t> size = file.ok() ? file->Size() : absl::StatusOr<uint64_t>(file.status());
  absl::Status status = size.status();
  if (status.ok()) {
    std::string text(*size, '\0');
    status = file->ReadAt(text.data(), text.size(), 0);
    absl::StatusOr<ParsedLedger> ledger =
        status.ok() ? ParseLedger(text) : absl::StatusOr<ParsedLedger>(status);
    status = ledger.status();
    if (ledger.ok()) {
      ledger_ = std::move(ledger->entries);
      if (!ledger->damage.empty()) {
        warnings_.push_back(
            absl::StrCat(LedgerFile(folder), ": ", ledger->damage, "; run `weft take recover ", folder, "`"));
      }
    }
  }
  if (!status.ok()) warnings_.push_back(std::string(status.message()));
}

void RecordedTake::MergeSets() {
  std::set<uint64_t> sets;
  for (const auto& stream : streams_)
    for (const IndexRecord& record : stream->records()) sets.insert(record.set);
  sets_.assign(sets.begin(), sets.end());
}

const IndexRecord* RecordedTake::Record(size_t index, size_t camera) const {
  const std::vector<IndexRecord>& records = streams_[camera]->records();
  const auto at = std::lower_bound(records.begin(), records.end(), sets_[index],
                                   [](const IndexRecord& r, uint64_t set) { return r.set < set; });
  return at != records.end() && at->set == sets_[index] ? &*at : nullptr;
}

absl::StatusOr<RawFrame> RecordedTake::ReadRaw(size_t index, size_t camera) const {
  if (index >= sets_.size() || camera >= streams_.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame set ", index, " of ", sets_.size(), ", camera ", camera,
                                              " of ", streams_.size()));
  }
  const IndexRecord* record = Record(index, camera);
  if (record == nullptr) return absl::NotFoundError("the stream lacks this frame set");
  return streams_[camera]->Read(*record);
}

absl::StatusOr<RawFrameSet> RecordedTake::ReadSet(size_t index) const {
  if (index >= sets_.size())
    return absl::OutOfRangeError(absl::StrCat("frame set ", index, " of ", sets_.size()));
  RawFrameSet set;
  set.number = sets_[index];
  for (size_t camera = 0; camera < streams_.size(); ++camera) {
    absl::StatusOr<RawFrame> frame = ReadRaw(index, camera);
    if (frame.ok()) {
      if (set.frames.empty()) set.device_time_ns = frame->device_time_ns;
      set.frames.push_back(*std::move(frame));
    } else {
      set.missing.push_back({camera_ids_[camera], std::string(frame.status().message())});
    }
  }
  return set;
}

std::string FrameNameOf(uint64_t set) { return absl::StrFormat("%04d", set); }

absl::StatusOr<std::unique_ptr<RecordedTakeDump>> RecordedTakeDump::Open(const std::string& folder,
                                                                         const Rig& rig) {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<RecordedTake> take, RecordedTake::Open(folder));
  auto dump = std::unique_ptr<RecordedTakeDump>(new RecordedTakeDump);
  dump->rig_ = rig;
  dump->take_ = std::move(take);
  dump->warnings_ = dump->take_->warnings();
  const std::vector<std::string>& ids = dump->take_->camera_ids();
  size_t known = 0;
  CameraMatch match{
      .of_rig = rig.cameras.size(), .of_recording = ids.size(), .without_images = {}, .without_model = {}};
  const CameraNames names(ids);
  std::set<int> of_rig;
  for (const CameraModel& camera : rig.cameras) {
    const int stream = names.Find(camera.id);
    dump->stream_of_camera_.push_back(stream);
    of_rig.insert(stream);
    known += stream >= 0;
    if (stream < 0) match.without_images.push_back(camera.id);
  }
  if (known == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": holds no stream of any camera of the rig (found cameras ", FirstNames(ids),
                     ", which the rig lacks; is it the rig of this take?)"));
  }
  for (size_t i = 0; i < ids.size(); ++i)
    if (!of_rig.contains(static_cast<int>(i))) match.without_model.push_back(ids[i]);
  for (std::string& line : CameraWarnings(match, folder)) dump->warnings_.push_back(std::move(line));
  dump->unknown_cameras_ = std::move(match.without_model);
  for (const uint64_t set : dump->take_->sets()) dump->frame_names_.push_back(FrameNameOf(set));
  dump->ReadSetTimes();
  if (!dump->frame_names_.empty()) return dump;
  return absl::InvalidArgumentError(absl::StrCat(
      folder, ": holds no frame set",
      dump->take_->warnings().empty() ? "" : absl::StrCat("; ", dump->take_->warnings().front())));
}

// Frames of live cameras have arrived at some time, those of videos have not. Only the latter are on one axis
// for certain, with the sets' moments in the ledger.
void RecordedTakeDump::ReadSetTimes() {
  const RecordedTake& take = *take_;
  for (size_t camera = 0; camera < take.camera_ids().size(); ++camera)
    for (const IndexRecord& record : take.stream(camera).records())
      if (record.host_time_ns != 0) return;
  std::map<uint64_t, int64_t> times_ns;
  for (const LedgerEntry& entry : take.ledger())
    if (entry.event == LedgerEvent::kRecorded) times_ns[entry.first_set] = entry.device_time_ns;
  for (const uint64_t set : take.sets()) {
    const auto found = times_ns.find(set);
    set_times_ns_.push_back(found == times_ns.end() ? std::nullopt : std::optional(found->second));
  }
}

const IndexRecord* RecordedTakeDump::RecordOf(size_t index, size_t camera) const {
  return stream_of_camera_[camera] < 0 ? nullptr
                                       : take_->Record(index, static_cast<size_t>(stream_of_camera_[camera]));
}

std::optional<int64_t> RecordedTakeDump::ViewTime_ns(size_t index, size_t camera) const {
  if (index >= set_times_ns_.size() || camera >= rig_.cameras.size()) return std::nullopt;
  const IndexRecord* record = RecordOf(index, camera);
  if (record == nullptr || record->is_missing) return std::nullopt;
  return record->device_time_ns;
}

std::optional<int64_t> RecordedTakeDump::FrameTime_ns(size_t index) const {
  return index < set_times_ns_.size() ? set_times_ns_[index] : std::nullopt;
}

absl::StatusOr<FrameSet> RecordedTakeDump::Read(size_t index) const {
  return ReadFrameSet(*this, rig_, index);
}

absl::StatusOr<size_t> RecordedTakeDump::StreamOf(size_t index, size_t camera) const {
  if (index >= frame_names_.size() || camera >= rig_.cameras.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size(), ", camera ",
                                              camera, " of ", rig_.cameras.size()));
  }
  if (stream_of_camera_[camera] < 0) return absl::NotFoundError("no stream in the take");
  return static_cast<size_t>(stream_of_camera_[camera]);
}

absl::StatusOr<Frame> RecordedTakeDump::ReadView(size_t index, size_t camera) const {
  WEFT_ASSIGN_OR_RETURN(const size_t stream, StreamOf(index, camera));
  return AsRigHasIt(take_->ReadRaw(index, stream), index, camera);
}

absl::StatusOr<StoredView> RecordedTakeDump::Locate(size_t index, size_t camera) const {
  WEFT_ASSIGN_OR_RETURN(const size_t stream, StreamOf(index, camera));
  const IndexRecord* record = take_->Record(index, stream);
  if (record == nullptr) return absl::NotFoundError("the stream lacks this frame set");
  return StoredView{take_->stream(stream).path(), record->offset_bytes, StreamReader::BytesOf(*record)};
}

absl::StatusOr<Frame> RecordedTakeDump::ReadCopy(const std::string& copy, size_t index, size_t camera) const {
  WEFT_ASSIGN_OR_RETURN(const size_t stream, StreamOf(index, camera));
  const IndexRecord* record = take_->Record(index, stream);
  if (record == nullptr) return absl::NotFoundError("the stream lacks this frame set");
  return AsRigHasIt(take_->stream(stream).ReadCopy(*record, copy), index, camera);
}

absl::StatusOr<Frame> RecordedTakeDump::AsRigHasIt(const absl::StatusOr<RawFrame>& raw, size_t index,
                                                   size_t camera) const {
  if (!raw.ok()) return raw.status();
  const CameraModel& model = rig_.cameras[camera];
  const WrongSize sizes{{raw->width_px, raw->height_px}, {model.width_px, model.height_px}};
  if (sizes.found != sizes.expected)
    return WrongSizeError(absl::StrCat("camera ", model.id, ", frame ", frame_names_[index]), sizes);
  absl::StatusOr<Frame> frame = ToFrame(*raw, DeepBits::kUsed);
  if (!frame.ok()) return frame;
  frame->camera_id = model.id;  // names of the take may differ in case
  frame->origin = absl::StrCat("camera ", model.id, ", frame ", frame_names_[index]);
  return frame;
}

absl::StatusOr<std::string> RecordedTakeDump::Fingerprint(size_t index) const {
  if (index >= frame_names_.size())
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size()));
  ContentHash hash;
  hash.Add(frame_names_[index]);
  for (size_t i = 0; i < rig_.cameras.size(); ++i) {
    const IndexRecord* record = RecordOf(index, i);
    hash.Add(rig_.cameras[i].id);
    hash.AddInteger(record && !record->is_missing ? record->payload_bytes : 0);
    hash.AddInteger(record ? record->checksum : 0);
    const std::optional<ViewMoment> moment = MomentOfView(*this, index, i);
    if (!moment) continue;
    hash.AddInteger(static_cast<uint64_t>(std::llround(1e9 * moment->own_s)));
    hash.AddInteger(static_cast<uint64_t>(std::llround(1e9 * moment->other_s)));
    hash.AddInteger(RecordOf(moment->other, i)->checksum);
  }
  return hash.Hex();
}

}  // namespace weft

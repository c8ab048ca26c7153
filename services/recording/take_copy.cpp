#include "services/recording/take_copy.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/image/image_file.h"
#include "capture/take/image_folder.h"
#include "capture/take/recorded_take.h"
#include "services/files/atomic_file.h"
#include "services/recording/clock_log.h"
#include "services/recording/take_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// The take that is being written, from its take.json to its end.
class TakeCopy {
 public:
  static absl::StatusOr<TakeCopy> Start(const std::string& out, v1::Take take, RecorderOptions options) {
    std::vector<std::string> ids;
    for (const v1::TakeCamera& camera : take.cameras()) ids.push_back(camera.id());
    DescribeStreams(take, options.take);
    auto recorder = Recorder::Start(out, ids, options);
    if (!recorder.ok()) return recorder.status();
    if (absl::Status status = WriteTakeFile(out, take); !status.ok()) return status;
    return TakeCopy(out, std::move(take), *std::move(recorder));
  }

  bool Add(RawFrameSet set) { return recorder_->OfferAndWait(std::move(set)); }

  // Of the sets from `first` to `last`, those of which the ledger says that they were dropped.
  void NoteDropped(const std::vector<LedgerEntry>& ledger, uint64_t first, uint64_t last) {
    for (const LedgerEntry& entry : ledger) {
      if (entry.event != LedgerEvent::kDropped || entry.last_set < first || entry.first_set > last) continue;
      recorder_->NoteDropped(std::max(first, entry.first_set), std::min(last, entry.last_set),
                             entry.device_time_ns, entry.cause);
    }
  }

  // The number of sets, where all of them are in the take.
  absl::StatusOr<uint64_t> Finish() {
    const absl::Status stopped = recorder_->Stop();
    const RecorderCounters counters = recorder_->Counters();
    SetOutcome(counters, take_);
    absl::Status status = stopped;
    if (!absl::IsDeadlineExceeded(stopped)) status.Update(WriteTakeFile(out_, take_));
    if (!status.ok()) return status;
    if (!counters.stop_cause.empty())
      return absl::ResourceExhaustedError(absl::StrCat(out_, ": ", counters.stop_cause));
    return counters.sets_recorded;
  }

 private:
  TakeCopy(std::string out, v1::Take take, std::unique_ptr<Recorder> recorder)
      : out_(std::move(out)), take_(std::move(take)), recorder_(std::move(recorder)) {}

  std::string out_;
  v1::Take take_;
  std::unique_ptr<Recorder> recorder_;
};

// The frame's name as a number where that keeps the order, else the next one.
uint64_t NumberOf(const std::string& name, uint64_t next) {
  uint64_t number = 0;
  return absl::SimpleAtoi(name, &number) && number >= next ? number : next;
}

}  // namespace

absl::StatusOr<uint64_t> ImportImages(const std::string& images, const std::string& out,
                                      const TakeCopyOptions& options, const CopyProgress& progress) {
  if (!(options.fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  const absl::StatusOr<ImageFolder> folder = ListImageFolder(images);
  if (!folder.ok()) return folder.status();
  std::set<std::string> ids;
  for (const auto& [name, files] : *folder)
    for (const auto& [camera, path] : files) ids.insert(camera);
  if (ids.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        images, ": holds no image; expected <frame>/<camera>.png or cam<camera>/image<frame>.png"));
  }
  v1::Take take = NewTake(absl::StrCat("images of ", fs::path(images).filename().string()));
  for (const std::string& id : ids) {
    v1::TakeCamera& camera = *take.add_cameras();
    camera.set_id(id);
    camera.set_source("images");
  }
  absl::StatusOr<TakeCopy> copy = TakeCopy::Start(out, std::move(take), options.recorder);
  if (!copy.ok()) return copy.status();
  uint64_t next = 0, done = 0;
  for (const auto& [name, files] : *folder) {
    RawFrameSet set;
    set.number = NumberOf(name, next);
    next = set.number + 1;
    if (options.fps > 0)
      set.device_time_ns = std::llround(1e9 / options.fps * static_cast<double>(set.number));
    for (const std::string& id : ids) {
      const auto file = files.find(id);
      absl::StatusOr<Frame> frame = absl::NotFoundError("no image in the dump");
      if (file != files.end()) frame = ReadImageFile(file->second, options.mosaic);
      absl::StatusOr<RawFrame> raw =
          frame.ok() ? ToRawFrame(*frame) : absl::StatusOr<RawFrame>(frame.status());
      if (!raw.ok()) {
        set.missing.push_back({id, std::string(raw.status().message())});
        continue;
      }
      raw->camera_id = id;
      raw->device_time_ns = set.device_time_ns;
      raw->device_frame_id = set.number;
      set.frames.push_back(*std::move(raw));
    }
    if (!copy->Add(std::move(set))) break;
    if (progress) progress(++done, folder->size());
  }
  return copy->Finish();
}

absl::StatusOr<uint64_t> ExportImages(const std::string& take, const std::string& out, bool demosaic,
                                      const CopyProgress& progress) {
  const absl::StatusOr<std::unique_ptr<RecordedTake>> recorded = RecordedTake::Open(take);
  if (!recorded.ok()) return recorded.status();
  const RecordedTake& source = **recorded;
  for (size_t set = 0; set < source.sets().size(); ++set) {
    const fs::path folder = fs::path(out) / FrameNameOf(source.sets()[set]);
    if (absl::Status status = CreateFolders(folder.string()); !status.ok()) return status;
    for (size_t camera = 0; camera < source.camera_ids().size(); ++camera) {
      const absl::StatusOr<RawFrame> raw = source.ReadRaw(set, camera);
      if (absl::IsNotFound(raw.status())) continue;
      if (!raw.ok()) return raw.status();
      absl::StatusOr<Frame> frame = ToFrame(*raw);
      if (frame.ok() && demosaic) frame = ToRgb(*frame);
      if (!frame.ok()) return frame.status();
      const std::string path = (folder / (source.camera_ids()[camera] + ".png")).string();
      if (absl::Status status = WriteImageFile(path, *frame); !status.ok()) return status;
    }
    if (progress) progress(set + 1, source.sets().size());
  }
  return source.sets().size();
}

absl::StatusOr<uint64_t> TrimTake(const std::string& take, const std::string& out, const TrimOptions& options,
                                  const CopyProgress& progress) {
  const absl::StatusOr<TakeView> view = TakeView::Open(take, options.view);
  if (!view.ok()) return view.status();
  absl::StatusOr<v1::Take> description = ReadTakeFile(take);
  if (!description.ok()) return description.status();
  const std::vector<uint64_t>& sets = view->sets();
  std::string source =
      absl::StrCat("sets ", sets.front(), " to ", sets.back(), " of take ", description->id());
  for (const auto& [camera, shift_ns] : options.view.shift_ns)
    absl::StrAppendFormat(&source, ", camera %s shifted by %.6f ms", camera,
                          static_cast<double>(shift_ns) / 1e6);
  v1::Take trimmed = NewTake(source);
  *trimmed.mutable_cameras() = description->cameras();
  trimmed.set_rig_hash(description->rig_hash());
  trimmed.set_board_hash(description->board_hash());
  trimmed.set_sync(description->sync());
  trimmed.set_own_clocks(description->own_clocks());
  absl::StatusOr<TakeCopy> copy = TakeCopy::Start(out, std::move(trimmed), options.recorder);
  if (!copy.ok()) return copy.status();
  std::error_code no_clocks;  // takes of images have none
  fs::copy_file(ClockLogFile(take), ClockLogFile(out), no_clocks);
  for (size_t i = 0; i < sets.size(); ++i) {
    if (i > 0) copy->NoteDropped(view->take().ledger(), sets[i - 1] + 1, sets[i] - 1);
    absl::StatusOr<RawFrameSet> set = view->ReadSet(i);
    if (!set.ok()) return set.status();
    if (!copy->Add(*std::move(set))) break;
    if (progress) progress(i + 1, sets.size());
  }
  return copy->Finish();
}

}  // namespace weft

#include "services/studio/recording/take_copy.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/image/image_file.h"
#include "capture/take/frame_number.h"
#include "capture/take/frame_times.h"
#include "capture/take/image_folder.h"
#include "capture/take/picture_sizes.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/unfinished_folder.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/take_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// The take that is being written, from its take.json to its end.
class TakeCopy {
 public:
  static absl::StatusOr<TakeCopy> Start(const std::string& out, v1::Take take, RecorderOptions options) {
    if (IsRecordedTake(out)) {
      return absl::AlreadyExistsError(
          absl::StrCat(out, ": holds a take; choose another folder, takes are kept"));
    }
    WEFT_ASSIGN_OR_RETURN(UnfinishedFolder folder, UnfinishedFolder::Begin(out));
    std::vector<std::string> ids;
    for (const v1::TakeCamera& camera : take.cameras()) ids.push_back(camera.id());
    DescribeStreams(take, options.take);
    WEFT_ASSIGN_OR_RETURN(auto recorder, Recorder::Start(folder.path(), ids, options));
    WEFT_RETURN_IF_ERROR(WriteTakeFile(folder.path(), take));
    return TakeCopy(std::move(folder), std::move(take), std::move(recorder));
  }

  // Where it is written.
  const std::string& folder() const { return folder_.path(); }

  void Note(const std::string& text) { recorder_->Note("", text); }

  bool Add(RawFrameSet set) { return recorder_->OfferAndWait(std::move(set)); }

  // Of the sets from `first` to `last`, those of which the ledger says that they were dropped.
  void NoteDropped(const std::vector<LedgerEntry>& ledger, uint64_t first, uint64_t last) {
    for (const LedgerEntry& entry : ledger) {
      if (entry.event != LedgerEvent::kDropped || entry.last_set < first || entry.first_set > last) continue;
      recorder_->NoteDropped(std::max(first, entry.first_set), std::min(last, entry.last_set),
                             entry.device_time_ns, entry.cause);
    }
  }

  // The number of sets, where all of them are in the take, which has its name then.
  absl::StatusOr<uint64_t> Finish() {
    const absl::Status stopped = recorder_->Stop();
    const RecorderCounters counters = recorder_->Counters();
    SetOutcome(counters, take_);
    absl::Status status = stopped;
    if (!absl::IsDeadlineExceeded(stopped)) status.Update(WriteTakeFile(folder(), take_));
    if (!status.ok()) return status;
    if (!counters.stop_cause.empty())
      return absl::ResourceExhaustedError(absl::StrCat(folder(), ": ", counters.stop_cause));
    recorder_.reset();
    if (status = folder_.Publish(); !status.ok()) return status;
    return counters.sets_recorded;
  }

 private:
  TakeCopy(UnfinishedFolder folder, v1::Take take, std::unique_ptr<Recorder> recorder)
      : folder_(std::move(folder)), take_(std::move(take)), recorder_(std::move(recorder)) {}

  UnfinishedFolder folder_;  // outlives the recorder, which writes there
  v1::Take take_;
  std::unique_ptr<Recorder> recorder_;
};

// Where a frame set stands in its take.
struct Place {
  uint64_t number = 0;
  int64_t time_ns = 0;
};

// Of a take: 2 years at 30 frames a second. Exports have 32 bits for it.
constexpr int64_t kMostFrames = INT32_MAX;

// The names' numbers where they keep the order of the names, else counted on from the last one that does.
std::vector<uint64_t> NumbersOf(const std::vector<std::string>& names, std::vector<std::string>& notes) {
  std::vector<uint64_t> numbers;
  const std::optional<std::vector<int64_t>> all = FrameNumbers(names);
  const int64_t first = all && all->back() > kMostFrames ? all->front() : 0;
  const bool rise = all && std::ranges::adjacent_find(*all, std::greater_equal<>()) == all->end();
  if (rise && all->back() - first <= kMostFrames) {
    if (first > 0) notes.push_back(absl::StrCat("sets are numbered from frame ", names.front(), " on"));
    for (const int64_t number : *all) numbers.push_back(static_cast<uint64_t>(number - first));
    return numbers;
  }
  bool too_large = false;
  for (const std::string& name : names) {
    const uint64_t next = numbers.empty() ? 0 : numbers.back() + 1;
    uint64_t number = next;
    const bool is_number = name.find_first_not_of("0123456789") == std::string::npos;
    const bool is_fit = is_number && absl::SimpleAtoi(name, &number) && number <= uint64_t{kMostFrames};
    too_large |= is_number && !is_fit;
    numbers.push_back(is_fit ? std::max(number, next) : next);
  }
  if (too_large)
    notes.push_back(
        "names of frames are neither times nor numbers below 2^31; sets are numbered in their order");
  return numbers;
}

absl::StatusOr<std::vector<Place>> PlacesOf(const ImageFolder& folder, const TakeCopyOptions& options,
                                            std::vector<std::string>& notes) {
  const double fps = options.fps;
  std::vector<std::string> names;
  for (const auto& [name, files] : folder.frames) names.push_back(name);
  WEFT_ASSIGN_OR_RETURN(const std::optional<FrameTimes> times, TimesInNames(names, fps, options.names));
  std::vector<Place> places(names.size());
  if (times) {
    notes.push_back(absl::StrCat("the names of the frames are ", times->words,
                                 "; sets have them as their times; --names numbers takes them as numbers"));
    for (size_t i = 0; i < names.size(); ++i) places[i] = {times->numbers[i], times->times_ns[i]};
    return places;
  }
  if (std::string doubt = DoubtOfNumbers(names); options.names == NameMeaning::kAuto && !doubt.empty())
    notes.push_back(std::move(doubt));
  const std::vector<uint64_t> numbers = NumbersOf(names, notes);
  constexpr double kMost_ns = 9.2e18;  // of 64 bits
  for (size_t i = 0; i < names.size(); ++i) {
    const double time_ns = fps > 0 ? 1e9 / fps * static_cast<double>(numbers[i]) : 0;
    if (!(time_ns < kMost_ns)) {
      return absl::InvalidArgumentError(
          absl::StrCat("fps: at ", fps, " frames a second, frame ", names[i],
                       " is later than 292 years; give the rate of the cameras"));
    }
    places[i] = {numbers[i], std::llround(time_ns)};
  }
  return places;
}

// All cameras' images of a frame; those that are odd are missing.
RawFrameSet ReadSet(const std::map<std::string, std::string>& files, const std::set<std::string>& ids,
                    const Place& place, const OddPictures& odd, const std::optional<PixelFormat>& mosaic) {
  RawFrameSet set;
  set.number = place.number;
  set.device_time_ns = place.time_ns;
  for (const std::string& id : ids) {
    const auto file = files.find(id);
    absl::StatusOr<Frame> frame = absl::NotFoundError("no image in the dump");
    if (file != files.end()) {
      const auto why = odd.why.find(file->second);
      frame = why == odd.why.end() ? ReadImageFile(file->second, mosaic)
                                   : absl::StatusOr<Frame>(absl::InvalidArgumentError(why->second));
    }
    absl::StatusOr<RawFrame> raw = frame.ok() ? ToRawFrame(*frame) : absl::StatusOr<RawFrame>(frame.status());
    if (!raw.ok()) {
      set.missing.push_back({id, std::string(raw.status().message())});
      continue;
    }
    raw->camera_id = id;
    raw->device_time_ns = set.device_time_ns;
    raw->device_frame_id = set.number;
    set.frames.push_back(*std::move(raw));
  }
  return set;
}

// What became of the pictures of a folder.
struct PictureCount {
  uint64_t found = 0, unread = 0;
  uint64_t sets = 0, whole_sets = 0;
  std::string first_reason;

  void Add(const std::map<std::string, std::string>& files, const RawFrameSet& set) {
    found += files.size();
    ++sets;
    whole_sets += set.missing.empty();
    for (const auto& [camera, reason] : set.missing) {
      if (!files.contains(camera)) continue;
      if (unread++ == 0) first_reason = reason;
    }
  }
  absl::Status AllUnread() const {
    if (found == 0 || unread < found) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("none of the ", found, " pictures could be read, the first: ", first_reason));
  }
  std::vector<std::string> Notes() const {
    std::vector<std::string> notes;
    if (unread > 0)
      notes.push_back(
          absl::StrCat(unread, " of ", found, " pictures are missing, the first: ", first_reason));
    if (sets > 0 && whole_sets == 0)
      notes.push_back(
          "no frame has pictures of all cameras: frames are taken by their names, <frame>/<camera>.png or "
          "<camera>/<frame>.png, so a frame has the same name at each camera");
    return notes;
  }
};

absl::Status CopyClocks(const std::string& take, const std::string& copy) {
  const absl::StatusOr<std::string> log = ReadWholeFile(ClockLogFile(take));
  if (absl::IsNotFound(log.status())) return absl::OkStatus();  // takes of images have none
  return log.ok() ? WriteFileAtomically(ClockLogFile(copy), *log) : log.status();
}

}  // namespace

absl::StatusOr<ImportedImages> ImportImages(const std::string& images, const std::string& out,
                                            const TakeCopyOptions& options, const CopyProgress& progress) {
  if (!(options.fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  WEFT_ASSIGN_OR_RETURN(const ImageFolder folder, ListImageFolder(images));
  std::set<std::string> ids;
  for (const auto& [name, files] : folder.frames)
    for (const auto& [camera, path] : files) ids.insert(camera);
  if (ids.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        images, ": holds no image; expected <frame>/<camera>.png or cam<camera>/image<frame>.png",
        folder.notes.empty() ? "" : absl::StrCat("; ", folder.notes.front())));
  }
  ImportedImages imported;
  imported.notes = folder.notes;
  WEFT_ASSIGN_OR_RETURN(const OddPictures odd, Naming(images, FindOddPictures(folder)));
  imported.notes.insert(imported.notes.end(), odd.notes.begin(), odd.notes.end());
  WEFT_ASSIGN_OR_RETURN(const std::vector<Place> places, PlacesOf(folder, options, imported.notes));
  v1::Take take = NewTake(absl::StrCat("images of ", fs::path(images).filename().string()));
  for (const std::string& id : ids) {
    v1::TakeCamera& camera = *take.add_cameras();
    camera.set_id(id);
    camera.set_source("images");
  }
  WEFT_ASSIGN_OR_RETURN(TakeCopy copy, TakeCopy::Start(out, std::move(take), options.recorder));
  for (const std::string& note : imported.notes) copy.Note(note);
  uint64_t done = 0;
  PictureCount count;
  for (const auto& [name, files] : folder.frames) {
    RawFrameSet set = ReadSet(files, ids, places[done], odd, options.mosaic);
    count.Add(files, set);
    if (!copy.Add(std::move(set))) break;
    ++done;
    if (progress) progress(done, folder.frames.size());
  }
  // A take without a picture would stand at the place of the next try.
  WEFT_RETURN_IF_ERROR(count.AllUnread());
  WEFT_ASSIGN_OR_RETURN(imported.sets, copy.Finish());
  for (std::string& note : count.Notes()) imported.notes.push_back(std::move(note));
  return imported;
}

absl::StatusOr<uint64_t> ExportImages(const std::string& take, const std::string& out, bool demosaic,
                                      const CopyProgress& progress) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RecordedTake> recorded, RecordedTake::Open(take));
  const RecordedTake& source = *recorded;
  WEFT_ASSIGN_OR_RETURN(UnfinishedFolder whole, UnfinishedFolder::Begin(out));
  for (size_t set = 0; set < source.sets().size(); ++set) {
    const fs::path folder = fs::path(whole.path()) / FrameNameOf(source.sets()[set]);
    WEFT_RETURN_IF_ERROR(CreateFolders(folder.string()));
    for (size_t camera = 0; camera < source.camera_ids().size(); ++camera) {
      const absl::StatusOr<RawFrame> raw = source.ReadRaw(set, camera);
      if (absl::IsNotFound(raw.status())) continue;
      if (!raw.ok()) return raw.status();
      absl::StatusOr<Frame> frame = ToFrame(*raw, DeepBits::kUsed);
      if (frame.ok() && demosaic) frame = ToRgb(*frame);
      if (!frame.ok()) return frame.status();
      const std::string path = (folder / (source.camera_ids()[camera] + ".png")).string();
      WEFT_RETURN_IF_ERROR(WriteImageFile(path, *frame));
    }
    if (progress) progress(set + 1, source.sets().size());
  }
  WEFT_RETURN_IF_ERROR(whole.Publish());
  return source.sets().size();
}

absl::StatusOr<uint64_t> TrimTake(const std::string& take, const std::string& out, const TrimOptions& options,
                                  const CopyProgress& progress) {
  WEFT_ASSIGN_OR_RETURN(const TakeView view, TakeView::Open(take, options.view));
  WEFT_ASSIGN_OR_RETURN(v1::Take description, ReadTakeFile(take));
  const std::vector<uint64_t>& sets = view.sets();
  std::string source =
      absl::StrCat("sets ", sets.front(), " to ", sets.back(), " of take ", description.id());
  for (const auto& [camera, shift_ns] : options.view.shift_ns)
    absl::StrAppendFormat(&source, ", camera %s shifted by %.6f ms", camera,
                          static_cast<double>(shift_ns) / 1e6);
  v1::Take trimmed = NewTake(source);
  *trimmed.mutable_cameras() = description.cameras();
  trimmed.set_rig_hash(description.rig_hash());
  trimmed.set_board_hash(description.board_hash());
  trimmed.set_sync(description.sync());
  trimmed.set_own_clocks(description.own_clocks());
  trimmed.set_clocks_checksum(description.clocks_checksum());
  WEFT_ASSIGN_OR_RETURN(TakeCopy copy, TakeCopy::Start(out, std::move(trimmed), options.recorder));
  WEFT_RETURN_IF_ERROR(CopyClocks(take, copy.folder()));
  for (size_t i = 0; i < sets.size(); ++i) {
    if (i > 0) copy.NoteDropped(view.take().ledger(), sets[i - 1] + 1, sets[i] - 1);
    WEFT_ASSIGN_OR_RETURN(RawFrameSet set, view.ReadSet(i));
    if (!copy.Add(std::move(set))) break;
    if (progress) progress(i + 1, sets.size());
  }
  return copy.Finish();
}

}  // namespace weft

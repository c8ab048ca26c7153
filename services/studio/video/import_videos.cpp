#include "services/studio/video/import_videos.h"

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <set>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/image/raw_frame.h"
#include "capture/rig/camera_match.h"
#include "capture/take/take_files.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/studio/recording/take_description.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/video/at_once.h"
#include "services/studio/video/chapters.h"
#include "services/studio/video/frame_plan.h"
#include "services/studio/video/import_notes.h"
#include "services/studio/video/imported_take.h"
#include "services/studio/video/ltc.h"
#include "services/studio/video/motion_offsets.h"
#include "services/studio/video/timecode.h"
#include "services/studio/video/timecode_track.h"
#include "services/studio/video/video_facts.h"
#include "services/studio/video/video_frames.h"
#include "weft/v1/video.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr size_t kAtOnce = 3;         // videos that are written; ffmpeg has threads of its own
constexpr size_t kMostLookedAt = 16;  // videos, each by one thread
constexpr int kFactsVersion = 3;
constexpr const char* kUnfinished = ".unfinished";

std::string NameOfFile(const v1::VideoFacts& video) { return fs::path(video.path()).filename().string(); }

class Importer {
 public:
  Importer(const VideoImportOptions& options, std::string out, const VideoImportProgress& progress)
      : options_(options), out_(std::move(out)), folder_(out_ + kUnfinished), progress_(progress) {}

  absl::StatusOr<VideoImportResult> Run() {
    for (const auto step : {&Importer::Check, &Importer::Begin, &Importer::Inspect, &Importer::CompareWithRig,
                            &Importer::FindOffsets, &Importer::Plan, &Importer::Write, &Importer::Publish})
      WEFT_RETURN_IF_ERROR((this->*step)());
    return VideoImportResult{std::move(take_), std::move(warnings_)};
  }

 private:
  bool Report(const char* stage, uint64_t done, uint64_t total) const {
    return !progress_ || progress_(stage, done, total);
  }
  std::string StateFile() const { return folder_ + "/import.json"; }
  absl::Status Check();
  absl::Status Begin();
  absl::Status Inspect();
  absl::Status CompareWithRig();
  absl::Status FindOffsets();
  absl::StatusOr<std::vector<v1::CameraSync>> OffsetsBy(SyncWay way);
  absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByWhatThereIs();
  absl::Status Plan();
  void DescribeTake(const std::vector<v1::CameraSync>& syncs);
  void SetTimecode();
  ImportedTake Import() const {
    return {folder_, take_, videos_, plan_, times_s_, options_.stream, options_.mosaic};
  }
  absl::Status Write();
  absl::Status Publish();
  std::string Key() const;
  absl::Status SaveState();

  const VideoImportOptions& options_;
  const std::string out_, folder_;
  const VideoImportProgress& progress_;
  UniqueFd lock_;
  std::optional<Rig> rig_;
  v1::VideoImport state_;
  std::vector<v1::VideoFacts> videos_;
  std::vector<std::vector<double>> times_s_;
  FramePlan plan_;
  v1::Take take_;
  std::vector<std::string> warnings_;
  std::vector<LedgerNote> notes_;
};

absl::Status Importer::Check() {
  if (options_.videos.empty()) return absl::InvalidArgumentError("no video is named");
  const v1::Take& said = options_.said;
  WEFT_RETURN_IF_ERROR(CheckTakeDescription({said.slate(), said.name(), said.notes()}));
  std::map<std::string, std::string> files;
  std::vector<std::string> paths;
  for (const VideoFile& video : options_.videos) {
    if (absl::Status status = CheckCameraId(video.camera); !status.ok())
      return absl::InvalidArgumentError(
          absl::StrCat(video.path, ": ", status.message(), "; name it: --camera NAME=", video.path));
    const auto [other, is_new] = files.emplace(video.camera, video.path);
    if (!is_new)
      return absl::InvalidArgumentError(absl::StrCat("camera ", video.camera, ": two videos, ", other->second,
                                                     " and ", video.path,
                                                     "; one per camera, named by --camera NAME=FILE"));
    paths.push_back(video.path);
  }
  WEFT_RETURN_IF_ERROR(CheckChapters(paths));
  if (!options_.rig.empty()) {
    WEFT_ASSIGN_OR_RETURN(rig_, ReadRig(options_.rig));
  }
  std::error_code error;
  if (!fs::exists(out_, error) || fs::is_empty(out_, error)) return absl::OkStatus();
  return absl::AlreadyExistsError(absl::StrCat(out_, ": is there already; name another folder"));
}

absl::Status Importer::Begin() {
  WEFT_RETURN_IF_ERROR(CreateFolders(StreamFolder(folder_)));
  lock_ = UniqueFd(open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock_.open() || flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
    return absl::FailedPreconditionError(absl::StrCat(folder_, ": another import writes there"));
  const absl::Status read = ReadJsonFile(StateFile(), state_);
  // A first try, one that did not get far, or one of a program that knew less of videos.
  if (!read.ok() || state_.version() != kFactsVersion) state_.Clear();
  state_.set_version(kFactsVersion);
  return absl::OkStatus();
}

absl::Status Importer::Inspect() {
  videos_.resize(options_.videos.size());
  std::atomic<uint64_t> frames = 0;
  const auto look = [&](size_t i) -> absl::Status {
    std::error_code error;
    const std::string path = fs::canonical(options_.videos[i].path, error).string();
    if (error) return absl::NotFoundError(absl::StrCat(options_.videos[i].path, ": no such file"));
    for (const v1::VideoFacts& known : state_.videos()) {
      const auto modified = fs::last_write_time(path, error);
      if (known.path() != path || known.bytes() != fs::file_size(path, error)) continue;
      const auto since = std::chrono::file_clock::to_sys(modified).time_since_epoch();
      if (std::chrono::duration_cast<std::chrono::nanoseconds>(since).count() == known.modified_unix_ns())
        videos_[i] = known;
    }
    if (videos_[i].path().empty()) {
      uint64_t own = 0;
      WEFT_ASSIGN_OR_RETURN(videos_[i], InspectVideo(path, [&](uint64_t seen) {
                              frames += seen - own;
                              own = seen;
                              return Report("look", frames, frames);
                            }));
    }
    videos_[i].set_camera(options_.videos[i].camera);
    return absl::OkStatus();
  };
  WEFT_RETURN_IF_ERROR(ForEachAtOnce(
      videos_.size(), std::clamp<size_t>(std::thread::hardware_concurrency(), 1, kMostLookedAt), look));
  state_.mutable_videos()->Assign(videos_.begin(), videos_.end());
  return SaveState();
}

absl::Status Importer::SaveState() { return WriteJsonFile(StateFile(), state_, JsonZeros::kOmitted); }

absl::Status Importer::CompareWithRig() {
  if (!rig_) return absl::OkStatus();
  CameraMatch match{.of_rig = rig_->cameras.size(),
                    .of_recording = videos_.size(),
                    .without_images = {},
                    .without_model = {}};
  std::vector<std::string> known;
  for (const CameraModel& camera : rig_->cameras) {
    known.push_back(camera.id);
    const bool has = std::ranges::any_of(
        videos_, [&](const v1::VideoFacts& video) { return video.camera() == camera.id; });
    if (!has) match.without_images.push_back(camera.id);
  }
  for (const v1::VideoFacts& video : videos_) {
    const int index = rig_->IndexOf(video.camera());
    if (index < 0)
      return absl::InvalidArgumentError(absl::StrCat(
          video.path(), ": ", options_.rig, " has no camera ", video.camera(), "; it has ", FirstNames(known),
          ". Say whose film it is (--camera NAME=", video.path(), "), or leave it out"));
    const CameraModel& camera = rig_->cameras[static_cast<size_t>(index)];
    if (camera.width_px != video.width_px() || camera.height_px != video.height_px())
      return absl::InvalidArgumentError(absl::StrCat(
          video.path(), ": its pictures are ", video.width_px(), "x", video.height_px(), ", ", options_.rig,
          " says ", camera.width_px, "x", camera.height_px, " of camera ", video.camera(),
          "; use the rig that was calibrated at this size, or the film as the camera wrote it"));
  }
  for (std::string& warning : CameraWarnings(match, "the videos")) warnings_.push_back(std::move(warning));
  return absl::OkStatus();
}

std::string Importer::Key() const {
  std::string key = absl::StrCat("sync ", NameOf(options_.sync), " ", options_.max_offset_s, "\nrig ",
                                 rig_ ? rig_->ContentHash() : "", "\nboard ", options_.board, "\nmosaic ",
                                 options_.mosaic ? std::string(PixelFormatName(*options_.mosaic)) : "",
                                 "\ncompress ", options_.stream.compress);
  for (const auto& [camera, file] : options_.ltc) absl::StrAppend(&key, "\nltc ", camera, " ", file);
  for (const auto& [camera, offset_s] : options_.given_s)
    absl::StrAppend(&key, "\noffset ", camera, " ", offset_s);
  for (const v1::VideoFacts& video : videos_)
    absl::StrAppend(&key, "\n", video.camera(), " ", video.path(), " ", video.bytes(), " ",
                    video.modified_unix_ns());
  return key;
}

absl::StatusOr<std::vector<v1::CameraSync>> Importer::OffsetsByWhatThereIs() {
  std::vector<std::string> without;
  for (const v1::VideoFacts& video : videos_)
    if (video.timecode().empty() && !options_.given_s.contains(video.camera()))
      without.push_back(video.camera());
  if (!options_.ltc.empty()) return OffsetsBy(SyncWay::kLtc);
  if (without.empty()) return OffsetsBy(SyncWay::kTimecode);
  // To listen takes seconds; to decode the print takes minutes.
  const bool have_sound = std::ranges::all_of(
      videos_, [](const v1::VideoFacts& video) { return video.audio_channels_size() > 0; });
  if (have_sound) {
    absl::StatusOr<std::vector<v1::CameraSync>> heard = OffsetsBy(SyncWay::kLtc);
    if (!absl::IsFailedPrecondition(heard.status())) return heard;
  }
  if (!options_.rig.empty() && !options_.board.empty()) return OffsetsBy(SyncWay::kMotion);
  if (videos_.size() == 1) return OffsetsBy(SyncWay::kTogether);
  return absl::FailedPreconditionError(absl::StrCat(
      "no timecode in the videos of ", FirstNames(without), have_sound ? ", nor in their sound" : "",
      "; name a rig and a board, then motion tells the offsets (--rig RIG --board BOARD), give the offsets "
      "(--offset CAMERA=SECONDS), or say that the clips begin together (--sync together)"));
}

absl::StatusOr<std::vector<v1::CameraSync>> Importer::OffsetsBy(SyncWay way) {
  switch (way) {
    case SyncWay::kTimecode: {
      // A video whose offset is given needs none.
      std::vector<v1::VideoFacts> asked;
      for (const v1::VideoFacts& video : videos_)
        if (!options_.given_s.contains(video.camera())) asked.push_back(video);
      WEFT_ASSIGN_OR_RETURN(std::vector<v1::CameraSync> found, OffsetsByTimecode(asked));
      std::vector<v1::CameraSync> syncs;
      size_t next = 0;
      for (const v1::VideoFacts& video : videos_)
        syncs.push_back(options_.given_s.contains(video.camera()) ? v1::CameraSync() : found[next++]);
      return syncs;
    }
    case SyncWay::kFileTimes:
      return OffsetsByFileTimes(videos_);
    case SyncWay::kTogether:
      return OffsetsTogether(videos_);
    case SyncWay::kMotion: {
      if (options_.rig.empty() || options_.board.empty())
        return absl::InvalidArgumentError(
            "offsets from motion need a rig and a board: --rig RIG --board BOARD");
      WEFT_ASSIGN_OR_RETURN(Board board, ReadBoard(options_.board));
      MotionOffsetOptions motion;
      motion.max_offset_s = options_.max_offset_s;
      motion.mosaic = options_.mosaic;
      return OffsetsByMotion(*rig_, board, videos_, motion,
                             [&](uint64_t done, uint64_t total) { return Report("sync", done, total); });
    }
    case SyncWay::kLtc:
      return OffsetsByLtc(options_.ltc, videos_);
    default:
      return absl::InternalError(absl::StrCat("no way to put videos in step: ", NameOf(way)));
  }
}

absl::Status Importer::FindOffsets() {
  const std::string key = Key();
  if (state_.has_take() && state_.key() == key) {
    take_ = state_.take();
    return absl::OkStatus();
  }
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::CameraSync> syncs,
                        options_.sync == SyncWay::kAuto ? OffsetsByWhatThereIs() : OffsetsBy(options_.sync));
  WEFT_RETURN_IF_ERROR(UseGivenOffsets(options_.given_s, videos_, syncs));
  BeginAtZero(videos_, syncs);
  DescribeTake(syncs);
  state_.mutable_videos()->Assign(videos_.begin(), videos_.end());  // linear timecode is known now
  state_.set_key(key);
  *state_.mutable_take() = take_;
  return SaveState();
}

void Importer::DescribeTake(const std::vector<v1::CameraSync>& syncs) {
  std::vector<std::string> names;
  for (const v1::VideoFacts& video : videos_) names.push_back(NameOfFile(video));
  take_ = NewTake(absl::StrCat("videos ", FirstNames(names)));
  take_.set_slate(options_.said.slate());
  take_.set_name(options_.said.name());
  take_.set_notes(options_.said.notes());
  if (rig_) take_.set_rig_hash(rig_->ContentHash());
  std::set<std::string> ways;
  for (size_t i = 0; i < videos_.size(); ++i) {
    v1::TakeCamera& camera = *take_.add_cameras();
    camera.set_id(videos_[i].camera());
    camera.set_source(absl::StrCat("video:", NameOfFile(videos_[i])));
    camera.set_width_px(videos_[i].width_px());
    camera.set_height_px(videos_[i].height_px());
    camera.set_pixel_format(
        std::string(RawFormatName(RawFormatOf(VideoPixelFormat(videos_[i], options_.mosaic)))));
    camera.set_unsynchronized(true);
    *camera.mutable_sync() = syncs[i];
    DescribeTimes(videos_[i], *camera.mutable_sync());
    ways.insert(syncs[i].found_by());
  }
  take_.set_ended_host_time_ns(HostTime_ns());
  take_.set_sync(absl::StrCat("videos, offsets by ", absl::StrJoin(ways, " and ")));
}

// Of the first set, by the first video that has a timecode.
void Importer::SetTimecode() {
  for (size_t i = 0; i < videos_.size(); ++i) {
    const absl::StatusOr<Timecode> first = TimecodeOfFirst(videos_[i]);
    if (!first.ok()) continue;
    const double since_s = plan_.set_times_s.front() - times_s_[i].front();
    take_.set_timecode(
        TimecodeText(TimecodeOf(first->Number() + std::llround(since_s * first->fps), *first)));
    take_.set_timecode_fps(first->fps);
    return;
  }
}

absl::Status Importer::Plan() {
  std::vector<v1::CameraSync> syncs;
  for (const v1::TakeCamera& camera : take_.cameras()) syncs.push_back(camera.sync());
  times_s_ = CommonFrameTimes_s(videos_, syncs);
  plan_ = PlanFrames(times_s_);
  for (size_t i = 0; i < videos_.size(); ++i)
    take_.mutable_cameras(static_cast<int>(i))->mutable_sync()->set_frames_left_out(plan_.left_out[i]);
  SetTimecode();
  take_.set_state(v1::TAKE_STATE_COMPLETE);
  take_.set_sets_recorded(plan_.set_times_s.size());
  take_.set_frames_missing(FramesMissing(plan_));
  notes_ = NotesOn(Import());
  for (const v1::VideoFacts& video : videos_)
    if (std::string text = ChaptersText(video.path()); !text.empty())
      notes_.push_back({video.camera(), std::move(text), true});
  for (const LedgerNote& note : notes_)
    if (note.is_warning) warnings_.push_back(WarningOf(note, videos_));
  return CheckRoom(Import(), out_);
}

absl::Status Importer::Write() {
  const ImportedTake imported = Import();
  std::atomic<uint64_t> done = 0;
  const uint64_t total = plan_.set_times_s.size() * videos_.size();
  absl::Status status = ForEachAtOnce(videos_.size(), kAtOnce, [&](size_t camera) {
    return WriteCameraStream(imported, camera, [&] {
      const uint64_t so_far = ++done;
      return Report("import", so_far, total);
    });
  });
  if (status.ok()) status = WriteLedger(imported, notes_);
  return status.ok() ? WriteTakeFile(folder_, take_) : status;
}

absl::Status Importer::Publish() {
  std::error_code error;
  fs::remove(StateFile(), error);
  WEFT_RETURN_IF_ERROR(SyncFolder(lock_.get(), folder_));
  fs::rename(folder_, out_, error);
  if (error) return absl::UnavailableError(absl::StrCat(out_, ": ", error.message()));
  const fs::path parent = fs::absolute(out_).parent_path();
  const UniqueFd above(open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return above.open() ? SyncFolder(above.get(), parent.string()) : absl::OkStatus();
}

}  // namespace

absl::StatusOr<VideoImportResult> ImportVideos(const VideoImportOptions& options, const std::string& out,
                                               const VideoImportProgress& progress) {
  std::string folder = out;
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  return Importer(options, folder, progress).Run();
}

}  // namespace weft

#include "services/studio/video/imported_take.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/image/raw_frame.h"
#include "capture/sync/ledger.h"
#include "capture/take/stream_reader.h"
#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "services/formats/files/atomic_file.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/video/video_frames.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kSetsPerCommit = 64;

int64_t Nanoseconds(double time_s) { return std::llround(1e9 * time_s); }

bool IsWritten(const ImportedTake& imported, size_t camera) {
  const auto stream = StreamReader::Open(StreamFolder(imported.folder), imported.videos[camera].camera());
  return stream.ok() && (*stream)->end() && (*stream)->header().take == TakeNumber(imported.take) &&
         (*stream)->records().size() == imported.plan.set_times_s.size();
}

// Whether a damaged picture is the one of this moment.
bool IsDamagedAt(const ImportedTake& imported, size_t camera, double time_s) {
  const v1::VideoFacts& video = imported.videos[camera];
  const v1::CameraSync& sync = imported.take.cameras(static_cast<int>(camera)).sync();
  const double count_s =
      static_cast<double>(video.time_base_num()) / static_cast<double>(video.time_base_den());
  const double half_s = sync.period_ms() / 2e3;
  const auto begin = static_cast<int64_t>(std::floor((time_s - sync.offset_s() - half_s) / count_s));
  const auto end = static_cast<int64_t>(std::ceil((time_s - sync.offset_s() + half_s) / count_s));
  const auto found = std::ranges::lower_bound(video.damaged_pts(), begin);
  return found != video.damaged_pts().end() && *found <= end;
}

std::string ReasonOfGap(const ImportedTake& imported, size_t camera, size_t set) {
  const double time_s = imported.plan.set_times_s[set];
  if (IsDamagedAt(imported, camera, time_s)) return "the video is damaged at this time";
  if (time_s < imported.times_s[camera].front()) return "the video begins later";
  if (time_s > imported.times_s[camera].back()) return "the video has ended";
  return "the video has no frame at this time";
}

StreamEnd EndOf(const v1::Take& take) {
  StreamEnd end;
  end.ended_host_time_ns = take.ended_host_time_ns();
  end.sets_recorded = take.sets_recorded();
  end.frames_missing = take.frames_missing();
  return end;
}

// Between the frames of a video and its stream.
class StreamOfVideo {
 public:
  StreamOfVideo(const ImportedTake& imported, size_t camera, VideoFrames frames, StreamWriter& stream)
      : import_(imported), camera_(camera), frames_(std::move(frames)), stream_(stream) {}

  absl::Status Append(size_t set) {
    const int64_t wanted = import_.plan.frames[camera_][set];
    if (wanted < 0)
      return stream_.AppendMissing(set, Nanoseconds(import_.plan.set_times_s[set]),
                                   ReasonOfGap(import_, camera_, set));
    WEFT_ASSIGN_OR_RETURN(Frame frame, FrameAt(wanted));
    WEFT_ASSIGN_OR_RETURN(RawFrame raw, ToRawFrame(frame));
    raw.device_time_ns = Nanoseconds(import_.times_s[camera_][static_cast<size_t>(wanted)]);
    raw.device_frame_id = static_cast<uint64_t>(wanted);
    return stream_.Append(set, raw);
  }

  // Reads what is left, and checks that all was as at first.
  absl::Status Finish() {
    while (next_ < import_.videos[camera_].frame_pts_size()) WEFT_RETURN_IF_ERROR(FrameAt(next_).status());
    return frames_.Finish();
  }

 private:
  absl::StatusOr<Frame> FrameAt(int64_t wanted) {
    for (;;) {
      absl::StatusOr<Frame> frame = frames_.Next();
      if (!frame.ok() || next_++ == wanted) return frame;
    }
  }

  const ImportedTake& import_;
  const size_t camera_;
  VideoFrames frames_;
  StreamWriter& stream_;
  int64_t next_ = 0;
};

}  // namespace

uint64_t FramesMissing(const FramePlan& plan) {
  uint64_t missing = 0;
  for (const std::vector<int64_t>& camera : plan.frames)
    missing += static_cast<uint64_t>(std::ranges::count(camera, -1));
  return missing;
}

absl::Status CheckRoom(const ImportedTake& imported, const std::string& out) {
  if (imported.stream.compress) return absl::OkStatus();
  double bytes = 0;
  for (const v1::VideoFacts& video : imported.videos)
    bytes += 3.0 * video.width_px() * video.height_px() * video.frame_pts_size();
  std::error_code error;
  const fs::space_info space = fs::space(imported.folder, error);
  // What stands there from an earlier try counts as free.
  double written = 0;
  for (const auto& entry : fs::directory_iterator(StreamFolder(imported.folder), error))
    written += static_cast<double>(entry.file_size(error));
  if (error || bytes <= static_cast<double>(space.available) + written) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "%s: the pictures take up to %.1f GB, the disk has %.1f GB; name another disk, or --compress", out,
      bytes / 1e9, static_cast<double>(space.available) / 1e9));
}

absl::Status WriteCameraStream(const ImportedTake& imported, size_t camera,
                               const std::function<bool()>& done) {
  const size_t sets = imported.plan.set_times_s.size();
  if (IsWritten(imported, camera)) {
    for (size_t set = 0; set < sets; ++set) done();
    return absl::OkStatus();
  }
  const v1::VideoFacts& video = imported.videos[camera];
  const std::string folder = StreamFolder(imported.folder);
  RemoveFile(StreamFile(folder, video.camera()));
  RemoveFile(IndexFile(folder, video.camera()));
  StreamHeader header;
  header.take = TakeNumber(imported.take);
  header.camera_id = video.camera();
  header.description = StreamDescription(imported.take, static_cast<int>(camera));
  WEFT_ASSIGN_OR_RETURN(const auto stream, StreamWriter::Create(folder, header, imported.stream));
  WEFT_ASSIGN_OR_RETURN(
      auto frames,
      VideoFrames::Start(video, {0, static_cast<size_t>(video.frame_pts_size())}, imported.mosaic));
  StreamOfVideo copy(imported, camera, std::move(frames), *stream);
  absl::Status status;
  for (size_t set = 0; set < sets && status.ok(); ++set) {
    status = copy.Append(set);
    if (status.ok() && (set + 1) % kSetsPerCommit == 0) status = stream->Commit(set);
    stream->Keep();
    if (!done()) status.Update(absl::CancelledError("stopped"));
  }
  if (status.ok()) status = copy.Finish();
  if (status.ok()) status = stream->Commit(sets - 1);
  stream->Keep();
  if (status.ok()) status = stream->Close(sets - 1);
  return status.ok() ? stream->WriteEnd(EndOf(imported.take)) : status;
}

absl::Status WriteLedger(const ImportedTake& imported, const std::vector<LedgerNote>& notes) {
  uint64_t checksum = LedgerStart();
  std::string text = LedgerHeading();
  const auto add = [&](const LedgerEntry& entry) { text += ToCsvLine(entry, checksum); };
  const int64_t now_ns = imported.take.ended_host_time_ns();
  for (const LedgerNote& note : notes) add({LedgerEvent::kNote, 0, 0, 0, now_ns, note.camera, note.text});
  const size_t sets = imported.plan.set_times_s.size();
  for (size_t set = 0; set < sets; ++set) {
    RawFrameSet told;
    told.number = set;
    told.device_time_ns = Nanoseconds(imported.plan.set_times_s[set]);
    for (size_t camera = 0; camera < imported.videos.size(); ++camera)
      if (imported.plan.frames[camera][set] < 0)
        told.missing.push_back({imported.videos[camera].camera(), ReasonOfGap(imported, camera, set)});
    for (const LedgerEntry& entry : EntriesOfRecorded(told, now_ns)) add(entry);
  }
  TakeEnd end;
  end.ended_host_time_ns = now_ns;
  add(EndEntry(end, sets - 1));
  return WriteFileAtomically(LedgerFile(imported.folder), text);
}

}  // namespace weft

#include "services/studio/recording/take_archive.h"

#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/take/recorded_take.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/unfinished_folder.h"
#include "services/ground/process/ffmpeg_process.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// How the bytes of a frame lie in a video, without loss.
struct VideoLayout {
  int width_px = 0, height_px = 0;
  std::string pixels = "gray";    // ffmpeg's name for what goes in and comes out
  std::string coded_as = "gray";  // what FFV1 keeps of it

  bool operator==(const VideoLayout&) const = default;
};

absl::StatusOr<VideoLayout> LayoutOf(const ChunkHeader& frame) {
  if (frame.format == RawFormat::kMotionJpeg || frame.frame_bytes == 0)
    return absl::InvalidArgumentError("motion JPEG is compressed already; copy the take, or export images");
  const uint64_t pixels = static_cast<uint64_t>(frame.width_px) * static_cast<uint64_t>(frame.height_px);
  const bool is_yuv = frame.format == RawFormat::kYuyv || frame.format == RawFormat::kUyvy;
  VideoLayout layout{frame.width_px, frame.height_px};
  if (frame.format == RawFormat::kRgb8 || frame.format == RawFormat::kBgr8) {
    layout.pixels = frame.format == RawFormat::kRgb8 ? "rgb24" : "bgr24";
    layout.coded_as = "bgr0";
  } else if (frame.frame_bytes == 2 * pixels && !is_yuv) {
    layout.pixels = layout.coded_as = "gray16le";
  } else if (frame.frame_bytes != pixels) {  // a line holds whole bytes, or the frame is one line
    const auto height = static_cast<uint64_t>(frame.height_px);
    const bool lines = frame.frame_bytes % height == 0;
    layout.width_px = static_cast<int>(lines ? frame.frame_bytes / height : frame.frame_bytes);
    layout.height_px = lines ? frame.height_px : 1;
  }
  return layout;
}

// What a camera has recorded, all of one layout.
struct CameraFrames {
  const StreamReader* stream = nullptr;
  std::string camera_id;
  VideoLayout layout;
  std::vector<const IndexRecord*> records;
  std::string list;  // the CSV
};

absl::StatusOr<CameraFrames> FramesOf(const RecordedTake& take, size_t camera) {
  CameraFrames frames{&take.stream(camera), take.camera_ids()[camera], {}, {}, {}};
  frames.list =
      "video_frame,set,device_time_ns,host_time_ns,device_frame_id,pixel_format,width_px,height_px\n";
  for (const IndexRecord& record : frames.stream->records()) {
    if (record.is_missing) continue;
    WEFT_ASSIGN_OR_RETURN(const ChunkHeader header, frames.stream->ReadHeader(record));
    const absl::StatusOr<VideoLayout> layout = LayoutOf(header);
    if (!layout.ok())
      return absl::InvalidArgumentError(
          absl::StrCat("camera ", frames.camera_id, ": ", layout.status().message()));
    if (!frames.records.empty() && *layout != frames.layout) {
      return absl::InvalidArgumentError(absl::StrCat("camera ", frames.camera_id,
                                                     ": its frames change size or format at set ", record.set,
                                                     "; export the parts (`weft take trim`)"));
    }
    frames.layout = *layout;
    absl::StrAppend(&frames.list, frames.records.size(), ",", header.set, ",", header.device_time_ns, ",",
                    header.host_time_ns, ",", header.device_frame_id, ",",
                    std::string(RawFormatName(header.format)), ",", header.width_px, ",", header.height_px,
                    "\n");
    frames.records.push_back(&record);
  }
  return frames;
}

using FrameDone = std::function<void()>;

absl::Status Encode(const CameraFrames& frames, const std::string& rate, const std::string& file,
                    const FrameDone& done) {
  const VideoLayout& layout = frames.layout;
  std::vector<std::string> arguments = absl::StrSplit(
      absl::StrCat("-f rawvideo -pixel_format ", layout.pixels, " -video_size ", layout.width_px, "x",
                   layout.height_px, " -framerate ", rate,
                   " -i pipe:0 -fps_mode passthrough -c:v ffv1 -level 3 -g 1 -slicecrc 1 -pix_fmt ",
                   layout.coded_as, " -f matroska"),
      ' ');
  arguments.push_back(FileArgument(file));
  WEFT_ASSIGN_OR_RETURN(FfmpegProcess ffmpeg, FfmpegProcess::Start(arguments));
  for (const IndexRecord* record : frames.records) {
    WEFT_ASSIGN_OR_RETURN(const RawFrame frame, frames.stream->Read(*record));
    WEFT_RETURN_IF_ERROR(ffmpeg.Write(frame.bytes->data(), frame.bytes->size()));
    done();
  }
  return ffmpeg.Finish();
}

absl::Status Check(const CameraFrames& frames, const std::string& file, const FrameDone& done) {
  WEFT_ASSIGN_OR_RETURN(FfmpegProcess ffmpeg,
                        FfmpegProcess::Start({"-i", FileArgument(file), "-fps_mode", "passthrough", "-f",
                                              "rawvideo", "-pix_fmt", frames.layout.pixels, "pipe:1"}));
  std::vector<uint8_t> decoded;
  for (const IndexRecord* record : frames.records) {
    WEFT_ASSIGN_OR_RETURN(const RawFrame frame, frames.stream->Read(*record));
    decoded.resize(frame.bytes->size());
    const absl::Status status = ffmpeg.Read(decoded.data(), decoded.size());
    if (!status.ok() || std::memcmp(decoded.data(), frame.bytes->data(), decoded.size()) != 0) {
      return absl::DataLossError(absl::StrCat(file, ": does not give back the frame of set ", record->set,
                                              status.ok() ? "" : ": ", status.message()));
    }
    done();
  }
  return ffmpeg.Finish();
}

absl::Status ExportCamera(const CameraFrames& frames, const std::string& rate, const std::string& out,
                          const FrameDone& done) {
  const std::string base = (fs::path(out) / frames.camera_id).string();
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(base + ".csv", frames.list));
  if (frames.records.empty()) return absl::OkStatus();
  WEFT_RETURN_IF_ERROR(Encode(frames, rate, base + ".mkv", done));
  return Check(frames, base + ".mkv", done);
}

// Takes of images have no clocks.csv.
absl::Status CopyWhereItExists(const fs::path& from, const fs::path& to) {
  const absl::Status copied = CopyWholeFile(from.string(), to.string());
  return absl::IsNotFound(copied) ? absl::OkStatus() : copied;
}

}  // namespace

absl::StatusOr<uint64_t> ExportArchive(const std::string& take, const std::string& out,
                                       const CopyProgress& progress) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RecordedTake> recorded, RecordedTake::Open(take));
  std::vector<CameraFrames> cameras;
  uint64_t total = 0, done = 0;
  for (size_t camera = 0; camera < recorded->camera_ids().size(); ++camera) {
    WEFT_ASSIGN_OR_RETURN(CameraFrames frames, FramesOf(*recorded, camera));
    total += frames.records.size();
    cameras.push_back(std::move(frames));
  }
  WEFT_ASSIGN_OR_RETURN(UnfinishedFolder whole, UnfinishedFolder::Begin(out));
  for (const char* file : {"take.json", "ledger.csv", "clocks.csv"})
    WEFT_RETURN_IF_ERROR(CopyWhereItExists(fs::path(take) / file, fs::path(whole.path()) / file));
  const std::string rate = VideoRate(PeriodOf_ns(*recorded));
  for (const CameraFrames& frames : cameras) {
    WEFT_RETURN_IF_ERROR(ExportCamera(frames, rate, whole.path(), [&] {
      if (progress) progress(++done, 2 * total);
    }));
  }
  WEFT_RETURN_IF_ERROR(whole.Publish());
  return total;
}

}  // namespace weft

#include "services/studio/recording/proxy_video.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/thumbnail.h"
#include "capture/take/recorded_take.h"
#include "services/ground/process/ffmpeg_process.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxWidth_px = 1920;  // of all cameras together, where nobody asks for more
constexpr int kMaxCameraWidth_px = 480;
constexpr int kMaxCameraSide_px = 8192;  // whatever is asked for

// The cameras of a set in rows and columns, RGB.
class Grid {
 public:
  Grid(size_t cameras, int cell_width_px, int cell_height_px)
      : cols_(ColsOf(cameras)),
        cell_(cell_width_px, cell_height_px),
        picture_((static_cast<int>(cameras) + cols_ - 1) / cols_ * cell_.height, cols_ * cell_.width,
                 CV_8UC3) {}

  static int ColsOf(size_t cameras) {
    return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(cameras))));
  }
  std::string Size() const { return absl::StrCat(picture_.cols, "x", picture_.rows); }
  const uint8_t* data() const { return picture_.data; }
  size_t bytes() const { return picture_.total() * picture_.elemSize(); }

  void Clear() { picture_.setTo(cv::Scalar::all(0)); }
  void Put(size_t camera, const Frame& rgb) {
    const cv::Mat source(rgb.height_px, rgb.width_px, CV_8UC3, const_cast<uint8_t*>(rgb.pixels->data()));
    source.copyTo(Cell(camera));
  }
  // White on black, in the line of the cell that `line` says.
  void Write(size_t camera, const std::string& text, int line = 0) {
    cv::Mat cell = Cell(camera);
    const double scale = std::clamp(cell_.width / 600.0, 0.3, 0.8);
    const cv::Point at(4, static_cast<int>(30 * scale * (line + 1)));
    for (const int thickness : {3, 1})
      cv::putText(cell, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar::all(thickness == 1 ? 255 : 0),
                  thickness, cv::LINE_AA);
  }

 private:
  cv::Mat Cell(size_t camera) {
    const int index = static_cast<int>(camera);
    return picture_(cv::Rect({index % cols_ * cell_.width, index / cols_ * cell_.height}, cell_));
  }

  const int cols_;
  const cv::Size cell_;
  cv::Mat picture_;
};

// Even, as encoders want it, and of the shape of the first frame of any camera.
absl::StatusOr<int> CellHeight_px(const RecordedTake& take, int width_px) {
  for (size_t camera = 0; camera < take.camera_ids().size(); ++camera)
    for (const IndexRecord& record : take.stream(camera).records()) {
      if (record.is_missing) continue;
      WEFT_ASSIGN_OR_RETURN(const ChunkHeader header, take.stream(camera).ReadHeader(record));
      const int64_t half_px = int64_t{header.height_px} * width_px / header.width_px / 2;
      if (half_px > kMaxCameraSide_px / 2) {
        return absl::InvalidArgumentError(absl::StrCat(
            "camera ", take.camera_ids()[camera], ": frames of ", header.width_px, "x", header.height_px,
            " px would be higher than ", kMaxCameraSide_px, " px in the video; ask for narrower pictures"));
      }
      return 2 * std::max<int>(1, static_cast<int>(half_px));
    }
  return absl::InvalidArgumentError("the take holds no frame");
}

void Draw(const RecordedTake& take, size_t set, int width_px, int height_px, Grid& grid) {
  grid.Clear();
  for (size_t camera = 0; camera < take.camera_ids().size(); ++camera) {
    const absl::StatusOr<RawFrame> raw = take.ReadRaw(set, camera);
    const absl::StatusOr<Frame> frame = raw.ok() ? ToFrame(*raw) : absl::StatusOr<Frame>(raw.status());
    const absl::StatusOr<Frame> picture = frame.ok() ? Resized(*frame, width_px, height_px) : frame;
    if (picture.ok()) {
      grid.Put(camera, *picture);
    } else {
      grid.Write(camera, std::string(picture.status().message()), 1);
    }
    grid.Write(camera, absl::StrCat(take.camera_ids()[camera],
                                    camera == 0 ? absl::StrCat("   set ", take.sets()[set]) : ""));
  }
}

absl::Status WriteVideo(const RecordedTake& take, int width_px, int height_px, const std::string& file,
                        const CopyProgress& progress) {
  Grid grid(take.camera_ids().size(), width_px, height_px);
  WEFT_ASSIGN_OR_RETURN(FfmpegProcess ffmpeg,
                        FfmpegProcess::Start({"-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
                                              grid.Size(), "-framerate", VideoRate(PeriodOf_ns(take)), "-i",
                                              "pipe:0", "-pix_fmt", "yuv420p", FileArgument(file)}));
  for (size_t set = 0; set < take.sets().size(); ++set) {
    Draw(take, set, width_px, height_px, grid);
    WEFT_RETURN_IF_ERROR(ffmpeg.Write(grid.data(), grid.bytes()));
    if (progress) progress(set + 1, take.sets().size());
  }
  return ffmpeg.Finish();
}

}  // namespace

absl::StatusOr<uint64_t> ExportProxy(const std::string& take, const std::string& out,
                                     const ProxyOptions& options, const CopyProgress& progress) {
  if (!fs::path(out).has_extension()) {
    return absl::InvalidArgumentError(absl::StrCat(
        out, ": a proxy video is one file, and its ending says which kind; end the name in .mp4 or .mkv"));
  }
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RecordedTake> recorded, RecordedTake::Open(take));
  const int cols = Grid::ColsOf(recorded->camera_ids().size());
  int width_px = options.camera_width_px;
  if (width_px == 0) width_px = std::clamp(kMaxWidth_px / cols, 16, kMaxCameraWidth_px);
  if (width_px < 16 || width_px > kMaxCameraSide_px)
    return absl::InvalidArgumentError(
        absl::StrCat("a camera's picture must be 16 to ", kMaxCameraSide_px, " px wide"));
  width_px = width_px / 2 * 2;
  WEFT_ASSIGN_OR_RETURN(const int height_px, CellHeight_px(*recorded, width_px));
  // The ending stays: it tells ffmpeg what to write.
  const fs::path path(out);
  const fs::path unfinished =
      path.parent_path() / (path.stem().string() + ".unfinished" + path.extension().string());
  absl::Status status = WriteVideo(*recorded, width_px, height_px, unfinished.string(), progress);
  std::error_code error;
  if (status.ok()) fs::rename(unfinished, path, error);
  if (error) status = absl::UnavailableError(absl::StrCat(out, ": ", error.message()));
  if (!status.ok()) {
    fs::remove(unfinished, error);
    return status;
  }
  return recorded->sets().size();
}

}  // namespace weft

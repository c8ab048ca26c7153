#include "services/video/video_frames.h"

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/video/video_facts.h"

namespace weft {
namespace {

bool IsGrey(const v1::VideoFacts& facts) { return absl::StartsWith(facts.pixels(), "gray"); }

std::string FiltersOf(const v1::VideoFacts& facts, const VideoRange& range) {
  const std::string part =
      range.count == static_cast<size_t>(facts.frame_pts_size())
          ? ""
          : absl::StrCat("select=between(n\\,", range.first, "\\,", range.first + range.count - 1, "),");
  return absl::StrCat(part, FrameLinesFilter("pipe:3"),
                      IsGrey(facts) ? ",format=gray"
                                    : ",scale=flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp,"
                                      "format=rgb24");
}

}  // namespace

PixelFormat VideoPixelFormat(const v1::VideoFacts& facts, std::optional<PixelFormat> mosaic) {
  return IsGrey(facts) ? mosaic.value_or(PixelFormat::kGrey8) : PixelFormat::kRgb8;
}

absl::StatusOr<VideoFrames> VideoFrames::Start(const v1::VideoFacts& facts, const VideoRange& range,
                                               std::optional<PixelFormat> mosaic) {
  if (mosaic && !IsGrey(facts))
    return absl::InvalidArgumentError(absl::StrCat(
        facts.path(), ": a mosaic is named, and the video is in colours (", facts.pixels(), ")"));
  std::vector<std::string> arguments = DecodingArguments();
  for (const std::string& word :
       {std::string("-i"), absl::StrCat("file:", facts.path()), std::string("-map"), std::string("0:v:0"),
        std::string("-vf"), FiltersOf(facts, range), std::string("-fps_mode"), std::string("passthrough"),
        std::string("-frames:v"), absl::StrCat(range.count), std::string("-f"), std::string("rawvideo"),
        std::string("pipe:1")})
    arguments.push_back(word);
  absl::StatusOr<VideoProgram> ffmpeg =
      VideoProgram::Start("ffmpeg", facts.path(), arguments, VideoProgram::Out::kPipe);
  if (!ffmpeg.ok()) return ffmpeg.status();
  return VideoFrames(facts, range, *std::move(ffmpeg), VideoPixelFormat(facts, mosaic));
}

absl::Status VideoFrames::Changed(const std::string& why) const {
  return absl::DataLossError(
      absl::StrCat(facts_.path(), ": ", why,
                   "; was it changed meanwhile? If not, write it anew: ffmpeg -i FILE -c:v ffv1 FILE.mkv"));
}

absl::StatusOr<Frame> VideoFrames::Next() {
  Frame frame;
  frame.camera_id = facts_.camera();
  frame.origin = facts_.path();
  frame.width_px = facts_.width_px();
  frame.height_px = facts_.height_px();
  frame.format = format_;
  const size_t channels = format_ == PixelFormat::kRgb8 ? 3 : 1;
  auto pixels = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(frame.width_px) *
                                                       static_cast<size_t>(frame.height_px) * channels);
  const absl::Status read = ffmpeg_.Read(pixels->data(), pixels->size());
  if (absl::IsOutOfRange(read)) return Changed("it gives fewer frames than at first");
  if (!read.ok()) return absl::Status(read.code(), absl::StrCat(facts_.path(), ": ", read.message()));
  frame.pixels = std::move(pixels);
  return frame;
}

absl::Status VideoFrames::Finish() {
  char more = 0;
  if (ffmpeg_.Read(&more, 1).ok()) return Changed("it gives more frames than at first");
  const absl::StatusOr<VideoProgramOutput> said = ffmpeg_.Finish();
  if (!said.ok()) return said.status();
  const absl::StatusOr<std::vector<int64_t>> pts = ParseFrameLines(said->out);
  if (!pts.ok()) return Changed(std::string(pts.status().message()));
  bool same = pts->size() == range_.count;
  for (size_t i = 0; same && i < pts->size(); ++i)
    same = (*pts)[i] == facts_.frame_pts(static_cast<int>(range_.first + i));
  return same ? absl::OkStatus() : Changed("its frames have other times than at first");
}

}  // namespace weft

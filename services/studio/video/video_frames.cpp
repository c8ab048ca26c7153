#include "services/studio/video/video_frames.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/studio/video/video_facts.h"

namespace weft {
namespace {

bool IsGrey(const v1::VideoFacts& facts) { return absl::StartsWith(facts.pixels(), "gray"); }

// `first`, `count`: of all pictures that the file gives.
std::string FiltersOf(const v1::VideoFacts& facts, uint64_t first, uint64_t count) {
  const auto all = static_cast<uint64_t>(facts.frame_pts_size() + facts.unused_size());
  const std::string part =
      count == all ? "" : absl::StrCat("select=between(n\\,", first, "\\,", first + count - 1, "),");
  return absl::StrCat(part, FrameLinesFilter("pipe:3"),
                      IsGrey(facts) ? ",format=gray"
                                    : ",scale=flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp,"
                                      "format=rgb24");
}

}  // namespace

PixelFormat VideoPixelFormat(const v1::VideoFacts& facts, std::optional<PixelFormat> mosaic) {
  return IsGrey(facts) ? mosaic.value_or(PixelFormat::kGrey8) : PixelFormat::kRgb8;
}

VideoFrames::Places VideoFrames::PlacesOf(const v1::VideoFacts& facts, const VideoRange& range) {
  Places places;
  const auto all = static_cast<uint64_t>(facts.frame_pts_size() + facts.unused_size());
  places.used.assign(all, true);
  for (const uint64_t place : facts.unused())
    if (place < all) places.used[place] = false;
  uint64_t end = 0;
  for (uint64_t place = 0, used = 0; place < all && used < range.first + range.count; ++place) {
    if (!places.used[place]) continue;
    if (used++ == range.first) places.first = place;
    if (used > range.first) end = place + 1;
  }
  places.count = end - std::min(end, places.first);
  return places;
}

absl::StatusOr<VideoFrames> VideoFrames::Start(const v1::VideoFacts& facts, const VideoRange& range,
                                               std::optional<PixelFormat> mosaic) {
  if (mosaic && !IsGrey(facts))
    return absl::InvalidArgumentError(absl::StrCat(
        facts.path(), ": a mosaic is named, and the video is in colours (", facts.pixels(), ")"));
  Places places = PlacesOf(facts, range);
  std::vector<std::string> arguments = DecodingArguments(facts);
  for (const std::string& word :
       {std::string("-i"), absl::StrCat("file:", facts.path()), std::string("-map"), std::string("0:v:0"),
        std::string("-vf"), FiltersOf(facts, places.first, places.count), std::string("-fps_mode"),
        std::string("passthrough"), std::string("-frames:v"), absl::StrCat(places.count), std::string("-f"),
        std::string("rawvideo"), std::string("pipe:1")})
    arguments.push_back(word);
  WEFT_ASSIGN_OR_RETURN(VideoProgram ffmpeg,
                        VideoProgram::Start("ffmpeg", facts.path(), arguments, VideoProgram::Out::kPipe));
  return VideoFrames(facts, std::move(places), std::move(ffmpeg), VideoPixelFormat(facts, mosaic));
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
  bool is_used = false;
  while (!is_used) {
    const absl::Status read = ffmpeg_.Read(pixels->data(), pixels->size());
    if (absl::IsOutOfRange(read)) return Changed("it gives fewer frames than at first");
    if (!read.ok()) return Naming(facts_.path(), read);
    const uint64_t place = places_.first + next_++;
    is_used = place < places_.used.size() && places_.used[place];
  }
  frame.pixels = std::move(pixels);
  return frame;
}

absl::Status VideoFrames::Finish() {
  auto used_before = static_cast<uint64_t>(std::count(
      places_.used.begin(), places_.used.begin() + static_cast<std::ptrdiff_t>(places_.first), true));
  char more = 0;
  if (ffmpeg_.Read(&more, 1).ok()) return Changed("it gives more frames than at first");
  WEFT_ASSIGN_OR_RETURN(const VideoProgramOutput said, ffmpeg_.Finish());
  const absl::StatusOr<FrameLines> lines = ParseFrameLines(said.out);
  if (!lines.ok()) return Changed(std::string(lines.status().message()));
  bool same = lines->pts.size() == places_.count;
  for (uint64_t i = 0; same && i < places_.count; ++i) {
    const uint64_t place = places_.first + i;
    const auto at = static_cast<int>(place);
    if (places_.used[place])
      same =
          lines->pts[i] == (facts_.decoded_pts().empty() ? facts_.frame_pts(static_cast<int>(used_before++))
                                                         : facts_.decoded_pts(at));
  }
  return same ? absl::OkStatus() : Changed("its frames have other times than at first");
}

}  // namespace weft

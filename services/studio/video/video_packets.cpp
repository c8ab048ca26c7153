#include "services/studio/video/video_packets.h"

#include <cstdint>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/studio/video/video_program.h"

namespace weft {
namespace {

constexpr size_t kMostPackets = 10'000'000;

bool TimeOf(absl::string_view text, int64_t& time) {
  constexpr int64_t kMost = INT64_MAX / 4;
  return absl::SimpleAtoi(text, &time) && time >= -kMost && time <= kMost;
}

}  // namespace

absl::StatusOr<std::vector<VideoPacket>> ParsePackets(std::string_view csv) {
  std::vector<VideoPacket> packets;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(csv.data(), csv.size()), '\n', absl::SkipEmpty())) {
    const std::vector<absl::string_view> words = absl::StrSplit(line, ',');
    if (words.size() < 3) continue;
    VideoPacket packet;
    const bool has_pts = TimeOf(words[0], packet.pts), has_dts = TimeOf(words[1], packet.dts);
    if (!has_pts && !has_dts) continue;
    if (!has_pts) packet.pts = packet.dts;
    if (!has_dts) packet.dts = packet.pts;
    packet.is_shown_by_itself = has_pts && !(has_dts && packet.pts == packet.dts);
    packet.is_key = words[2].find('K') != absl::string_view::npos;
    packet.is_hidden = words[2].find('D') != absl::string_view::npos;
    if (packets.size() >= kMostPackets) return absl::InvalidArgumentError("it has more frames than any film");
    packets.push_back(packet);
  }
  return packets;
}

absl::StatusOr<std::vector<VideoPacket>> ReadPackets(const std::string& path, std::string* log) {
  WEFT_ASSIGN_OR_RETURN(
      const auto said,
      RunVideoProgram("ffprobe", path,
                      {"-hide_banner", "-v", log == nullptr ? "quiet" : "debug", "-protocol_whitelist",
                       "file", "-select_streams", "v:0", "-show_entries", "packet=pts,dts,flags", "-of",
                       "csv=p=0", absl::StrCat("file:", path)}));
  if (log != nullptr) *log = said.errors;
  return ParsePackets(said.out);
}

}  // namespace weft

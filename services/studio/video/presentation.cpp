#include "services/studio/video/presentation.h"

#include <algorithm>
#include <cstdlib>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "base/median.h"

namespace weft {
namespace {

std::vector<int64_t> SortedTimes(const std::vector<VideoPacket>& packets) {
  std::vector<int64_t> times;
  for (const VideoPacket& packet : packets) times.push_back(packet.pts);
  std::ranges::sort(times);
  return times;
}

// The number behind `name`, which is at `text`'s begin or later.
bool CountBehind(absl::string_view text, absl::string_view name, int64_t& number) {
  const size_t at = text.find(name);
  if (at == absl::string_view::npos) return false;
  text.remove_prefix(at + name.size());
  const size_t end = text.find_first_not_of("-0123456789");
  return absl::SimpleAtoi(text.substr(0, end), &number) && std::abs(number) <= (INT64_MAX >> 20);
}

}  // namespace

absl::StatusOr<std::vector<int64_t>> TimesByOrder(const std::vector<VideoPacket>& packets,
                                                  const DecodedTimes& decoded) {
  const bool says_when_shown = std::ranges::any_of(
      packets, [](const VideoPacket& packet) { return packet.is_shown_by_itself || packet.is_hidden; });
  if (packets.empty() || decoded.pts.empty() || says_when_shown) return std::vector<int64_t>{};
  const std::vector<int64_t> times = SortedTimes(packets);
  // Pictures that are shown as they are decoded come at the packets' times, all or some of them.
  std::vector<int64_t> come = decoded.pts;
  std::ranges::sort(come);
  const bool is_late = decoded.waits > 0 && come.front() > times.front();
  if (!is_late && std::includes(times.begin(), times.end(), come.begin(), come.end()))
    return std::vector<int64_t>{};
  const bool are_apart = std::ranges::adjacent_find(times) == times.end();
  if (!decoded.is_damaged && are_apart && decoded.pts.size() == times.size()) return times;
  return absl::InvalidArgumentError(
      "its container says in which order pictures are decoded, not when they are shown, and some of them are "
      "damaged or missing; copy it again from the camera where it is whole, or film to MOV, MP4 or MKV");
}

std::vector<VideoEdit> ParseEdits(std::string_view log, int stream) {
  constexpr size_t kMostEdits = 100'000;
  const std::string of_stream = absl::StrCat("Processing st: ", stream, ", edit list ");
  std::vector<VideoEdit> edits;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(log.data(), log.size()), '\n', absl::SkipEmpty())) {
    const size_t at = line.find(of_stream);
    if (at == absl::string_view::npos || edits.size() >= kMostEdits) continue;
    VideoEdit edit;
    if (CountBehind(line.substr(at), "media time: ", edit.media_time) &&
        CountBehind(line.substr(at), "duration: ", edit.duration))
      edits.push_back(edit);
  }
  return edits;
}

absl::Status CheckEdits(const std::vector<VideoEdit>& edits, const std::vector<VideoPacket>& packets,
                        double count_s) {
  const std::vector<int64_t> times = SortedTimes(packets);
  std::vector<int64_t> distances;
  for (size_t i = 1; i < times.size(); ++i) distances.push_back(times[i] - times[i - 1]);
  const int64_t period = distances.empty() ? 0 : Median(std::move(distances));
  int64_t shown = 0, first_shift = 0;
  bool has_part = false;
  for (const VideoEdit& edit : edits) {
    const int64_t shift = shown - edit.media_time;
    if (edit.media_time >= 0 && !has_part) first_shift = shift, has_part = true;
    // Durations are rounded to the movie's counts, which are coarser.
    if (edit.media_time >= 0 && 2 * std::abs(shift - first_shift) > period)
      return absl::InvalidArgumentError(absl::StrFormat(
          "its edit list has a cut %.3f s after its begin: what follows was filmed %.3f s %s; give the file "
          "as the camera wrote it, or each part as a file of its own",
          count_s * static_cast<double>(shown), count_s * static_cast<double>(std::abs(first_shift - shift)),
          shift < first_shift ? "later than it is shown" : "earlier than it is shown"));
    shown += edit.duration;
  }
  return absl::OkStatus();
}

}  // namespace weft

#include "services/studio/video/damage.h"

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <unordered_set>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "base/median.h"

namespace weft {
namespace {

constexpr double kHole = 1.5;   // periods without a picture
constexpr double kMatch = 0.9;  // of the pictures shown have the time of a packet; else times tell nothing

using Times = std::unordered_set<int64_t>;

bool HasOneOf(absl::string_view text, std::initializer_list<const char*> words) {
  return std::ranges::any_of(words, [&](const char* word) { return absl::StrContains(text, word); });
}

enum class Said { kNothing, kDamage, kDoubt, kFrame, kPacket, kContainer };

// Error lines of a decoder: what stands beside the pictures is none of them.
Said OfDecoder(absl::string_view text) {
  if (HasOneOf(text,
               {"SEI", "APP", "Exif", "EXIF", "ICC", "user data", "picture_timing", "picture timing", "VUI"}))
    return Said::kNothing;
  // Some cameras' files make the decoder say these of sound pictures, too.
  if (HasOneOf(text, {"mmco: unref", "exceeds max", "co located POCs unavailable"})) return Said::kDoubt;
  return Said::kDamage;
}

// Error lines of a container are many; these are of files that were cut or changed.
bool IsOfCutFile(absl::string_view text) {
  return HasOneOf(text, {"ended prematurely", "partial file", "truncated", "corrupt", "exceeds", "Read error",
                         "invalid as first byte of an EBML"});
}

struct Line {
  Said said = Said::kNothing;
  absl::string_view text;  // without what ffmpeg puts in brackets before it
};

// "[h264 @ 0x55d1d6f07280] [error] text" or "[warning] text".
Line LogLineOf(absl::string_view line, const std::string& codec, const std::string& container) {
  absl::string_view context, level;
  if (absl::ConsumePrefix(&line, "[")) {
    const size_t end = line.find("] ");
    if (end == absl::string_view::npos) return {};
    level = line.substr(0, end);
    line.remove_prefix(end + 2);
    const size_t at = level.find(" @ ");
    if (at != absl::string_view::npos) {
      context = level.substr(0, at);
      const size_t end_of_level = line.find("] ");
      if (!absl::ConsumePrefix(&line, "[") || end_of_level == absl::string_view::npos) return {};
      level = line.substr(0, end_of_level - 1);
      line.remove_prefix(end_of_level + 1);
    }
  }
  const bool is_error = level == "error" || level == "fatal" || level == "panic";
  if (context.empty() && absl::StrContains(line, ": corrupt decoded frame in stream"))
    return {Said::kFrame, line};
  if (context.empty() && absl::StrContains(line, ": corrupt input packet in stream"))
    return {Said::kPacket, line};
  if (context.empty() && is_error && absl::StartsWith(line, "Error while decoding"))
    return {Said::kDamage, line};
  if (is_error && context == codec) return {OfDecoder(line), line};
  if (is_error && context == container && IsOfCutFile(line)) return {Said::kContainer, line};
  return {Said::kNothing, line};
}

// The whole number after `key`, "pkt_pts:1536".
std::optional<int64_t> NumberAfter(absl::string_view line, absl::string_view key) {
  const size_t at = line.find(key);
  if (at == absl::string_view::npos) return std::nullopt;
  const absl::string_view rest = line.substr(at + key.size());
  int64_t number = 0;
  if (!absl::SimpleAtoi(rest.substr(0, rest.find(' ')), &number)) return std::nullopt;
  return number;
}

// Packets of which nothing is shown. The second field of a picture may be a packet of its own; codes that
// skip pictures do not show all.
std::vector<bool> LostPackets(const DecodedPictures& pictures) {
  const Times shown(pictures.shown_pts.begin(), pictures.shown_pts.end());
  Times known;
  for (const VideoPacket& packet : pictures.packets) known.insert(packet.pts);
  size_t matches = 0;
  for (const int64_t pts : pictures.shown_pts) matches += known.contains(pts);
  std::vector<bool> lost(pictures.packets.size());
  if (pictures.skips ||
      static_cast<double>(matches) < kMatch * static_cast<double>(pictures.shown_pts.size()))
    return lost;
  for (size_t i = 0; i < lost.size(); ++i) {
    const VideoPacket& packet = pictures.packets[i];
    const bool is_second_field = pictures.has_fields && i > 0 && shown.contains(pictures.packets[i - 1].pts);
    lost[i] = !packet.is_hidden && !shown.contains(packet.pts) && !is_second_field;
  }
  return lost;
}

double PeriodOf(const std::vector<VideoPacket>& packets) {
  std::vector<int64_t> times;
  for (const VideoPacket& packet : packets) times.push_back(packet.pts);
  std::ranges::sort(times);
  std::vector<double> periods;
  for (size_t i = 1; i < times.size(); ++i) periods.push_back(static_cast<double>(times[i] - times[i - 1]));
  return Median(std::move(periods));
}

// Whether packets after this one are shown before it.
bool IsAhead(const std::vector<VideoPacket>& packets, size_t at, size_t end) {
  for (size_t later = at + 1; later < end; ++later)
    if (packets[later].pts < packets[at].pts) return true;
  return false;
}

// A packet that is gone leaves a hole in time, between the pictures shown at `before` and `behind`. The place
// of the first one of the group, in the order of decoding, that may follow from it. Pictures that are shown
// before the hole may wait for it, but not those before the last one that is decoded ahead of others.
size_t PlaceOfHole(const std::vector<VideoPacket>& packets, size_t begin, size_t end, int64_t before,
                   int64_t behind) {
  size_t first_behind = begin;
  while (first_behind < end && packets[first_behind].pts < behind) ++first_behind;
  size_t place = begin;
  int64_t ahead = INT64_MIN;
  bool are_reordered = false;
  for (size_t at = begin; at < end; ++at) {
    if (!IsAhead(packets, at, end)) continue;
    are_reordered = true;
    if (at >= first_behind || packets[at].pts > before) continue;
    place = at;
    ahead = packets[at].pts;
  }
  if (!are_reordered) return first_behind;
  for (++place; place < first_behind && packets[place].pts <= ahead;) ++place;
  return place;
}

// The place from which on a group is not what it was, since a packet is gone; `end`: no hole.
size_t PlaceOfLoss(const std::vector<VideoPacket>& packets, size_t begin, size_t end, double period) {
  std::vector<int64_t> times;
  for (size_t i = begin; i < end; ++i) times.push_back(packets[i].pts);
  // The next key frame, and pictures that it overtakes.
  for (size_t i = end; i < packets.size() && packets[i].pts <= packets[end].pts; ++i)
    times.push_back(packets[i].pts);
  std::ranges::sort(times);
  for (size_t i = 1; i < times.size(); ++i)
    if (static_cast<double>(times[i] - times[i - 1]) > kHole * period)
      return PlaceOfHole(packets, begin, end, times[i - 1], times[i]);
  return end;
}

// By packet: whether it is damaged or lost, and whether one before it is gone.
struct BadPackets {
  std::vector<bool> bad, after_hole;
};

BadPackets FindBadPackets(const DecodedPictures& pictures, const DecoderLog& log) {
  const std::vector<VideoPacket>& packets = pictures.packets;
  const Times damaged(log.damaged_pts.begin(), log.damaged_pts.end());
  const Times doubted(log.doubted_pts.begin(), log.doubted_pts.end());
  BadPackets found{LostPackets(pictures), std::vector<bool>(packets.size())};
  const double period = PeriodOf(packets);
  for (size_t begin = 0; begin < packets.size();) {
    size_t end = begin + 1;
    while (end < packets.size() && !packets[end].is_key) ++end;
    bool is_suspect = false;
    for (size_t i = begin; i < end; ++i) {
      found.bad[i] = found.bad[i] || damaged.contains(packets[i].pts);
      is_suspect = is_suspect || found.bad[i] || doubted.contains(packets[i].pts);
    }
    const size_t loss = is_suspect ? PlaceOfLoss(packets, begin, end, period) : end;
    if (loss < end) found.after_hole[loss] = true;
    begin = end;
  }
  return found;
}

}  // namespace

DecoderLog ParseDecoderLog(std::string_view log, const std::string& codec, const std::string& container) {
  DecoderLog told;
  std::optional<int64_t> packet, packet_before;
  bool is_next_packet = false, is_next_frame = false, is_cut = false;
  for (absl::string_view text :
       absl::StrSplit(absl::string_view(log.data(), log.size()), '\n', absl::SkipEmpty())) {
    const Line line = LogLineOf(text, codec, container);
    if (absl::StartsWith(line.text, "demuxer+ffmpeg -> ") && absl::StrContains(line.text, "type:video")) {
      packet_before = packet;
      packet = NumberAfter(line.text, " pkt_pts:");
      if (!packet) packet = NumberAfter(line.text, " pkt_dts:");
      if (packet && is_next_packet) told.damaged_pts.push_back(*packet);
      is_cut = is_next_packet;
      is_next_packet = false;
    } else if (absl::StartsWith(line.text, "decoder -> ") && absl::StrContains(line.text, "type:video")) {
      const auto frame = NumberAfter(line.text, " best_effort_ts:");
      if (frame && is_next_frame) told.damaged_pts.push_back(*frame);
      is_next_frame = false;
    }
    if (line.said == Said::kNothing) continue;
    is_next_packet = is_next_packet || line.said == Said::kPacket;
    is_next_frame = is_next_frame || line.said == Said::kFrame;
    if (packet && line.said == Said::kDamage) told.damaged_pts.push_back(*packet);
    // Damage from the first byte on seldom begins there: the end of the packet before is overwritten as well.
    if (packet_before && !is_cut && absl::StrContains(line.text, "Invalid NAL unit size"))
      told.damaged_pts.push_back(*packet_before);
    if (packet && line.said == Said::kDoubt) told.doubted_pts.push_back(*packet);
    if (!packet) continue;
    if (line.said == Said::kDamage && told.complaint.empty()) told.complaint = std::string(line.text);
    if (line.said == Said::kContainer && told.cut.empty()) told.cut = std::string(line.text);
  }
  if (told.complaint.empty() && !told.damaged_pts.empty()) told.complaint = "a picture is not whole";
  return told;
}

bool IsWorthALook(std::string_view errors, const std::string& codec, const std::string& container) {
  for (absl::string_view text :
       absl::StrSplit(absl::string_view(errors.data(), errors.size()), '\n', absl::SkipEmpty()))
    if (LogLineOf(text, codec, container).said != Said::kNothing) return true;
  return false;
}

bool LacksPictures(const DecodedPictures& pictures) {
  const std::vector<bool> lost = LostPackets(pictures);
  return std::ranges::find(lost, true) != lost.end();
}

std::vector<int64_t> DamagedPictures(const DecodedPictures& pictures, const DecoderLog& log) {
  const std::vector<VideoPacket>& packets = pictures.packets;
  const Times alone(pictures.unreferenced_pts.begin(), pictures.unreferenced_pts.end());
  const auto [bad, after_hole] = FindBadPackets(pictures, log);
  const bool has_keys = std::ranges::any_of(packets, [](const VideoPacket& packet) { return packet.is_key; });
  // From the last key frame on, and of pictures that it overtakes, which follow from those before it as well.
  bool is_broken = has_keys && !packets.front().is_key, are_overtaken_broken = false;
  int64_t key_pts = INT64_MIN;
  std::vector<int64_t> damaged;
  for (size_t i = 0; i < packets.size(); ++i) {
    const VideoPacket& packet = packets[i];
    if (packet.is_key) {
      are_overtaken_broken = is_broken || bad[i];
      is_broken = bad[i] || after_hole[i];
      key_pts = packet.pts;
    }
    bool& state = packet.pts < key_pts ? are_overtaken_broken : is_broken;
    state = state || after_hole[i] || (bad[i] && !alone.contains(packet.pts));
    if ((state || bad[i]) && !packet.is_hidden) damaged.push_back(packet.pts);
  }
  std::ranges::sort(damaged);
  damaged.erase(std::unique(damaged.begin(), damaged.end()), damaged.end());
  return damaged;
}

}  // namespace weft

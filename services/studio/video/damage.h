// Which pictures of a video are damaged, by what ffmpeg says while it decodes them, and which follow from
// those. H.264, HEVC and their like carry no checksums: a decoder notices damage by contradictions alone, and
// goes on with wrong pictures until the next key frame.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/studio/video/video_packets.h"

namespace weft {

// What ffmpeg says of a video that it decodes with one thread, -debug_ts and lines that tell their level.
struct DecoderLog {
  std::vector<int64_t> damaged_pts;  // packets that are cut short, fail, or are complained of
  std::vector<int64_t>
      doubted_pts;        // packets that want a picture that is not there: damage where one is lost
  std::string complaint;  // the first one of damage; empty where there is none
  std::string cut;        // what the container says of a file that was cut off or changed
};

// `codec` and `container` as ffmpeg calls them: others' lines are not of the pictures. Complaints of what
// stands beside pictures (SEI messages, APP fields) are none.
DecoderLog ParseDecoderLog(std::string_view log, const std::string& codec, const std::string& container);

// Whether the lines of errors and warnings of an ordinary run give reason to look closely.
bool IsWorthALook(std::string_view errors, const std::string& codec, const std::string& container);

// What is known of the pictures of a video.
struct DecodedPictures {
  std::vector<VideoPacket> packets;       // in the order of decoding
  std::vector<int64_t> shown_pts;         // of what was decoded, in any order
  std::vector<int64_t> unreferenced_pts;  // of decoded pictures from which no other one follows
  bool has_fields = false;                // some are coded as two fields, each of which may be a packet
  bool skips = false;                     // the code has packets that are not shown (VP8, VP9, MPEG-4)
};

// Whether a packet gives no picture.
bool LacksPictures(const DecodedPictures& pictures);

// Times of pictures that are damaged or missing, and of those that follow from them, up to the next key
// frame; sorted. Pictures that a key frame overtakes belong to those before it too.
std::vector<int64_t> DamagedPictures(const DecodedPictures& pictures, const DecoderLog& log);

}  // namespace weft

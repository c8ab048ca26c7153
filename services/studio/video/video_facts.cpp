#include "services/studio/video/video_facts.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/file_facts.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/video/damage.h"
#include "services/studio/video/flat_values.h"
#include "services/studio/video/presentation.h"
#include "services/studio/video/timecode_track.h"
#include "services/studio/video/video_packets.h"
#include "services/studio/video/video_program.h"

namespace weft {
namespace {

constexpr int kMostSide_px = 65536;
constexpr size_t kMostFrames = 10'000'000;
constexpr size_t kMostComplaint = 1000;
constexpr absl::string_view kStream = "streams.stream.";

// In any stream or of the file: MOV has a track of its own for it.
std::string TimecodeTagOf(const FlatValues& values) {
  for (const auto& [name, value] : values)
    if (absl::EndsWith(name, ".tags.timecode") && IsPlainText(value)) return value;
  return "";
}

int64_t CreationOf(const FlatValues& values, const std::string& stream) {
  for (const std::string& tag : {stream + "tags.creation_time", std::string("format.tags.creation_time")}) {
    absl::Time time;
    std::string error;
    if (absl::ParseTime(absl::RFC3339_full, ValueOf(values, tag), &time, &error))
      return absl::ToUnixNanos(time);
  }
  return 0;
}

// ffprobe lists at most as many streams as the file has, in their order.
void AddSounds(const FlatValues& values, v1::VideoFacts& facts) {
  constexpr int kMostStreams = 64;
  for (int i = 0; i < kMostStreams; ++i) {
    const std::string stream = absl::StrCat("streams.stream.", i, ".");
    if (ValueOf(values, stream + "codec_type") != "audio") continue;
    double start_s = 0;
    if (!absl::SimpleAtod(ValueOf(values, stream + "start_time"), &start_s) || !std::isfinite(start_s))
      start_s = 0;
    facts.add_audio_channels(std::max(0, IntegerOf(values, stream + "channels")));
    facts.add_audio_start_s(start_s);
  }
}

absl::Status Complain(const std::string& path, const VideoProgramOutput& said) {
  const std::string why = LastComplaint(said.errors);
  if (absl::StrContains(why, "install the package ffmpeg")) return absl::FailedPreconditionError(why);
  const bool is_cut = absl::StrContains(said.errors, "moov atom not found");
  return absl::InvalidArgumentError(absl::StrCat(
      path, ": ffmpeg cannot read it",
      why.empty() ? absl::StrCat(" (", DescribeExit(said.wait_status), ")")
                  : absl::StrCat(": ", EscapedText(why)),
      is_cut ? "; the file was cut off, or its recording never ended: copy it again from the camera"
             : "; is it a video, and was it copied whole?"));
}

// What ffprobe says of a file, as "flat".
absl::StatusOr<std::string> ReadHeader(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(
      const auto said,
      RunVideoProgram(
          "ffprobe", path,
          {"-hide_banner", "-v", "error", "-protocol_whitelist", "file", "-show_entries",
           "stream=codec_type,codec_name,codec_tag_string,channels,start_time,has_b_frames,width,height,pix_"
           "fmt,"
           "field_order,"
           "time_base,nb_frames,avg_frame_rate,r_frame_rate:stream_tags:format=format_name:format_tags",
           "-of", "flat", absl::StrCat("file:", path)}));
  if (said.wait_status != 0) return Complain(path, said);
  return said.out;
}

// One run of the decoder over the whole video; `filters` may be empty.
absl::StatusOr<VideoProgramOutput> Decode(const v1::VideoFacts& facts, std::vector<std::string> arguments,
                                          const std::string& filters,
                                          const std::function<bool(size_t bytes)>& grown = nullptr) {
  for (const std::string& word :
       {std::string("-i"), absl::StrCat("file:", facts.path()), std::string("-map"), std::string("0:v:0"),
        std::string("-vf"), filters, std::string("-fps_mode"), std::string("passthrough"), std::string("-f"),
        std::string("null"), std::string("-")})
    arguments.push_back(word);
  return RunVideoProgram("ffmpeg", facts.path(), arguments, grown);
}

// The lines of all frames, and another one for those that are coded as two fields.
std::string FrameAndFieldLinesFilter() {
  return absl::StrCat(
      FrameLinesFilter("pipe:1"),
      ",split[all][some];[some]select=gt(interlace_type\\,0),metadata=mode=modify:key=weft:value=2,"
      "metadata=mode=print:file=pipe\\\\:1,nullsink;[all]null");
}

// Decoded pictures from which others follow.
absl::StatusOr<std::vector<int64_t>> ReferencedPictures(const v1::VideoFacts& facts) {
  std::vector<std::string> arguments = DecodingArguments(facts);
  arguments.insert(arguments.end(), {"-skip_frame", "noref"});
  WEFT_ASSIGN_OR_RETURN(const auto said, Decode(facts, arguments, FrameLinesFilter("pipe:1")));
  absl::StatusOr<FrameLines> lines = ParseFrameLines(said.out);
  if (!lines.ok()) return Naming(facts.path(), lines.status());
  return std::move(lines->pts);
}

// Decodes once more, with a word for every packet, and says which pictures are not to be used.
absl::StatusOr<std::vector<int64_t>> LookClosely(DecodedPictures pictures, v1::VideoFacts& facts) {
  std::vector<std::string> arguments = DecodingArguments(facts);
  *std::ranges::find(arguments, "repeat+level+warning") = "repeat+level+info";
  arguments.insert(arguments.end(), {"-debug_ts", "-nostats"});
  WEFT_ASSIGN_OR_RETURN(const auto said, Decode(facts, arguments, "null"));
  const DecoderLog log = ParseDecoderLog(said.errors, facts.codec(), facts.container());
  WEFT_ASSIGN_OR_RETURN(const std::vector<int64_t> referenced, ReferencedPictures(facts));
  const std::set<int64_t> known(referenced.begin(), referenced.end());
  for (const int64_t pts : pictures.shown_pts)
    if (!known.contains(pts)) pictures.unreferenced_pts.push_back(pts);
  std::vector<int64_t> damaged = DamagedPictures(pictures, log);
  std::string why = damaged.empty() ? log.cut : log.complaint.empty() ? log.cut : log.complaint;
  if (!damaged.empty() && why.empty()) why = "pictures follow from ones that the file does not have";
  facts.set_complaint(EscapedText(why.substr(0, kMostComplaint)));
  return damaged;
}

absl::Status ReadFrameTimes(const FramesSeen& seen, const std::vector<VideoPacket>& packets,
                            v1::VideoFacts& facts) {
  constexpr size_t kBytesOfFrame = 60;  // about, in the lines of a frame
  WEFT_ASSIGN_OR_RETURN(const auto said,
                        Decode(facts, DecodingArguments(facts), FrameAndFieldLinesFilter(),
                               [&](size_t bytes) { return !seen || seen(bytes / kBytesOfFrame); }));
  absl::StatusOr<FrameLines> lines = ParseFrameLines(said.out);
  if (!lines.ok()) return Naming(facts.path(), lines.status());
  if (lines->pts.empty()) return Complain(facts.path(), said);
  const bool is_complained =
      said.wait_status != 0 || IsWorthALook(said.errors, facts.codec(), facts.container());
  absl::StatusOr<std::vector<int64_t>> by_order =
      TimesByOrder(packets, {lines->pts, facts.waits(), is_complained});
  if (!by_order.ok()) return Naming(facts.path(), by_order.status());
  if (!by_order->empty()) {
    facts.mutable_decoded_pts()->Add(lines->pts.begin(), lines->pts.end());
    lines->pts = *std::move(by_order);
  }
  // A header that says it speaks for all.
  const bool is_declared = facts.interlaced() > 0;
  facts.set_interlaced(lines->interlaced == 0 && is_declared ? lines->pts.size() : lines->interlaced);
  DecodedPictures pictures;
  pictures.packets = packets;
  pictures.shown_pts = lines->pts;
  pictures.has_fields = lines->interlaced > 0;
  for (const char* code : {"vp8", "vp9", "mpeg4"}) pictures.skips = pictures.skips || facts.codec() == code;
  std::vector<int64_t> damaged;
  if (is_complained || LacksPictures(pictures)) {
    WEFT_ASSIGN_OR_RETURN(damaged, LookClosely(std::move(pictures), facts));
  }
  facts.mutable_damaged_pts()->Add(damaged.begin(), damaged.end());
  if (absl::Status status = UseFrames(lines->pts, damaged, facts); !status.ok())
    return Naming(facts.path(), status);
  if (!facts.frame_pts().empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(facts.path(), ": no picture of it is whole (ffmpeg: ",
                                                 facts.complaint(), "); copy it again from the camera"));
}

// The first picture that is shown; 0 of none.
int64_t BeginOf(const std::vector<VideoPacket>& packets) {
  int64_t begin = INT64_MAX;
  for (const VideoPacket& packet : packets)
    if (!packet.is_hidden) begin = std::min(begin, packet.pts);
  return begin == INT64_MAX ? 0 : begin;
}

// Label and moment of a timecode track, else the file's label for its first picture.
absl::Status FindTimecode(const std::string& header, const std::vector<VideoPacket>& packets,
                          v1::VideoFacts& facts) {
  const double count_s =
      static_cast<double>(facts.time_base_num()) / static_cast<double>(facts.time_base_den());
  const double begin_s = count_s * static_cast<double>(facts.begin_pts());
  facts.set_timecode_at_s(begin_s);
  const int track = TimecodeTrackOf(ValuesOf(header));
  if (track < 0) return absl::OkStatus();
  const absl::Status read = ReadTimecodeTrack(track, facts);
  // The file may have a label of its own.
  if (absl::IsNotFound(read) || absl::IsInvalidArgument(read)) return absl::OkStatus();
  if (!read.ok()) return read;
  // Without an edit list pictures wait for those that they follow from, and the track does not: both begin
  // with what is decoded first.
  const bool has_edits =
      packets.empty() || packets.front().is_hidden ||
      std::abs(count_s * static_cast<double>(packets.front().dts) - facts.timecode_at_s()) > count_s;
  if (!has_edits) facts.set_timecode_at_s(begin_s);
  return absl::OkStatus();
}

}  // namespace

std::vector<std::string> DecodingArguments(const v1::VideoFacts& facts) {
  // Pictures are decoded as well as they can be, and those that are wrong are told by what is said of them:
  // ffmpeg's "explode" drops others, which were waiting to be shown, and keeps those that follow.
  // Threads of frames hide where slices end too early; what is sound is the same with two of them.
  // Where a decoder tells the times by how long it waits, they depend on its threads.
  const bool is_sound = facts.frame_pts_size() > 0 && facts.unused().empty() && facts.complaint().empty() &&
                        facts.decoded_pts().empty();
  // CAVLC slices of H.264 that end before their data are damaged; stuffing is usual in other codes.
  const std::string detect = facts.codec() == "h264" ? "crccheck+aggressive" : "crccheck";
  return absl::StrSplit(
      absl::StrCat("-hide_banner -loglevel repeat+level+warning -nostdin -y -copyts -threads ",
                   is_sound ? "2" : "1", " -noautorotate -err_detect ", detect,
                   " -protocol_whitelist file,pipe"),
      ' ');
}

std::string FrameLinesFilter(const std::string& where) {
  // The filter prints frames that have metadata alone.
  // A colon is escaped for the graph and for the filter's options.
  return absl::StrCat("metadata=mode=add:key=weft:value=1,metadata=mode=print:file=",
                      absl::StrReplaceAll(where, {{":", R"(\\:)"}}));
}

absl::StatusOr<v1::VideoFacts> ReadSoundHeader(const std::string& path) {
  std::error_code error;
  const std::string file = std::filesystem::canonical(path, error).string();
  if (error) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  WEFT_ASSIGN_OR_RETURN(const std::string header, ReadHeader(file));
  absl::StatusOr<v1::VideoFacts> facts = ParseSoundHeader(header);
  if (!facts.ok()) return Naming(file, facts.status());
  facts->set_path(file);
  return facts;
}

absl::StatusOr<v1::VideoFacts> ParseVideoHeader(std::string_view flat) {
  const FlatValues values = ValuesOf(flat);
  v1::VideoFacts facts;
  std::string stream;
  for (const auto& [name, value] : values) {
    if (!absl::StartsWith(name, kStream) || !absl::EndsWith(name, ".codec_type")) continue;
    if (value == "video" && stream.empty())
      stream = name.substr(0, name.size() - std::string_view("codec_type").size());
  }
  if (stream.empty()) return absl::InvalidArgumentError("it holds no video");
  AddSounds(values, facts);
  int index = 0;
  if (absl::SimpleAtoi(stream.substr(kStream.size(), stream.size() - kStream.size() - 1), &index))
    facts.set_stream(index);
  facts.set_width_px(IntegerOf(values, stream + "width"));
  facts.set_height_px(IntegerOf(values, stream + "height"));
  if (facts.width_px() <= 0 || facts.height_px() <= 0 || facts.width_px() > kMostSide_px ||
      facts.height_px() > kMostSide_px)
    return absl::InvalidArgumentError("its pictures have no size; is it damaged?");
  facts.set_waits(std::max(0, IntegerOf(values, stream + "has_b_frames")));
  facts.set_pixels(ValueOf(values, stream + "pix_fmt"));
  const auto base = FractionOf(ValueOf(values, stream + "time_base"));
  if (!base || !IsPlainText(facts.pixels()))
    return absl::InvalidArgumentError("its header makes no sense; is it damaged?");
  facts.set_time_base_num(base->first);
  facts.set_time_base_den(base->second);
  facts.set_frames_declared(static_cast<uint64_t>(std::max(0, IntegerOf(values, stream + "nb_frames"))));
  for (const char* rate : {"r_frame_rate", "avg_frame_rate"}) {
    const auto fps = FractionOf(ValueOf(values, stream + rate));
    if (fps) facts.set_declared_fps(static_cast<double>(fps->first) / static_cast<double>(fps->second));
  }
  facts.set_codec(ValueOf(values, stream + "codec_name"));
  facts.set_container(ValueOf(values, "format.format_name"));
  for (const char* order : {"tt", "bb", "tb", "bt"})
    if (ValueOf(values, stream + "field_order") == order) facts.set_interlaced(1);
  facts.set_timecode(TimecodeTagOf(values));
  facts.set_created_unix_ns(CreationOf(values, stream));
  return facts;
}

absl::StatusOr<v1::VideoFacts> ParseSoundHeader(std::string_view flat) {
  v1::VideoFacts facts;
  AddSounds(ValuesOf(flat), facts);
  if (facts.audio_channels().empty()) return absl::InvalidArgumentError("it holds no sound");
  return facts;
}

absl::StatusOr<FrameLines> ParseFrameLines(std::string_view lines) {
  FrameLines frames;
  std::vector<absl::string_view> words;  // of the last frame's line, whose kind is on the next one
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(lines.data(), lines.size()), '\n', absl::SkipEmpty())) {
    if (absl::StartsWith(line, "frame:")) words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    if (!absl::StartsWith(line, "weft=") || words.empty()) continue;
    if (line == "weft=2") {
      ++frames.interlaced;
      continue;
    }
    // The filter begins anew where it gets other pictures.
    if (words[0] != absl::StrCat("frame:", frames.pts.size()))
      return absl::InvalidArgumentError(
          absl::StrCat("its pictures change their size or format at frame ", frames.pts.size(),
                       "; cut it there: ffmpeg -i FILE -c copy -t SECONDS PART.mkv"));
    int64_t time = 0;
    if (words.size() < 2 || !absl::StartsWith(words[1], "pts:") ||
        !absl::SimpleAtoi(words[1].substr(4), &time))
      return absl::InvalidArgumentError(
          "its frames carry no times; put it into a container that has them: ffmpeg -r FPS -i FILE -c copy "
          "FILE.mkv");
    if (std::abs(time) > INT64_MAX / 4 || frames.pts.size() >= kMostFrames)
      return absl::InvalidArgumentError("its frames have impossible times; is it damaged?");
    frames.pts.push_back(time);
  }
  return frames;
}

absl::Status UseFrames(const std::vector<int64_t>& pts, const std::vector<int64_t>& damaged_pts,
                       v1::VideoFacts& facts) {
  for (size_t i = 0; i < pts.size(); ++i) {
    const bool is_damaged = std::ranges::binary_search(damaged_pts, pts[i]);
    const bool is_later = facts.frame_pts().empty() || pts[i] > facts.frame_pts(facts.frame_pts_size() - 1);
    if (!is_damaged && is_later) {
      facts.add_frame_pts(pts[i]);
      continue;
    }
    facts.add_unused(i);
    if (is_damaged) continue;
    const bool is_same = pts[i] == facts.frame_pts(facts.frame_pts_size() - 1);
    if (is_same) facts.set_same_time(facts.same_time() + 1);
    // Decoders show pictures in a wrong order after damage.
    if (!is_same && damaged_pts.empty())
      return absl::InvalidArgumentError(absl::StrCat("the time of frame ", i,
                                                     " is not after that of the frame before; write it anew: "
                                                     "ffmpeg -i FILE -c:v ffv1 FILE.mkv"));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::VideoFacts> InspectVideo(const std::string& path, const FramesSeen& seen) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  if (!S_ISREG(info.st_mode)) return absl::InvalidArgumentError(absl::StrCat(path, ": not a file"));
  if (info.st_size == 0)
    return absl::InvalidArgumentError(absl::StrCat(path, ": the file is empty; copy it again"));
  WEFT_ASSIGN_OR_RETURN(const std::string header, ReadHeader(path));
  absl::StatusOr<v1::VideoFacts> facts = ParseVideoHeader(header);
  if (!facts.ok()) return Naming(path, facts.status());
  facts->set_path(path);
  facts->set_bytes(static_cast<uint64_t>(info.st_size));
  facts->set_modified_unix_ns(UnixTime_ns(info.st_mtim));
  // Files of QuickTime and MP4 alone have edit lists.
  std::string log;
  const bool has_edits = absl::StrContains(facts->container(), "mov");
  WEFT_ASSIGN_OR_RETURN(const std::vector<VideoPacket> packets,
                        ReadPackets(path, has_edits ? &log : nullptr));
  const double count_s =
      static_cast<double>(facts->time_base_num()) / static_cast<double>(facts->time_base_den());
  if (absl::Status edits = CheckEdits(ParseEdits(log, facts->stream()), packets, count_s); !edits.ok())
    return Naming(path, edits);
  facts->set_begin_pts(BeginOf(packets));
  facts->set_hidden(static_cast<uint64_t>(
      std::ranges::count_if(packets, [](const VideoPacket& packet) { return packet.is_hidden; })));
  WEFT_RETURN_IF_ERROR(FindTimecode(header, packets, *facts));
  WEFT_RETURN_IF_ERROR(ReadFrameTimes(seen, packets, *facts));
  if (packets.empty()) facts->set_begin_pts(facts->frame_pts(0));
  return facts;
}

}  // namespace weft

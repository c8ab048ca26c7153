#include "services/video/video_facts.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "base/median.h"
#include "capture/file/plain_text.h"
#include "services/process/exit_status.h"
#include "services/video/video_program.h"

namespace weft {
namespace {

constexpr int kMostSide_px = 65536;
constexpr size_t kMostFrames = 10'000'000;
constexpr size_t kMostText = 1000;

// Of "flat": streams.stream.0.tags.timecode="10:22:33:12".
using FlatValues = std::map<std::string, std::string, std::less<>>;

std::string Unquoted(absl::string_view value) {
  if (value.size() < 2 || value.front() != '"' || value.back() != '"') return std::string(value);
  std::string text;
  for (size_t i = 1; i + 1 < value.size(); ++i) {
    if (value[i] == '\\' && i + 2 < value.size()) ++i;
    text += value[i];
  }
  return text;
}

FlatValues ValuesOf(std::string_view flat) {
  FlatValues values;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(flat.data(), flat.size()), '\n', absl::SkipEmpty())) {
    const size_t equals = line.find('=');
    if (equals == absl::string_view::npos || line.size() > kMostText) continue;
    // Names of tags differ in their case between containers.
    values.emplace(absl::AsciiStrToLower(line.substr(0, equals)), Unquoted(line.substr(equals + 1)));
  }
  return values;
}

std::string ValueOf(const FlatValues& values, const std::string& name) {
  const auto found = values.find(name);
  return found == values.end() || found->second == "N/A" ? "" : found->second;
}

// "30000/1001"; nothing where a part is no positive number.
std::optional<std::pair<int64_t, int64_t>> FractionOf(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, '/');
  int64_t num = 0, den = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[0], &num) || !absl::SimpleAtoi(parts[1], &den))
    return std::nullopt;
  if (num <= 0 || den <= 0 || num > INT32_MAX || den > INT32_MAX) return std::nullopt;
  return std::pair(num, den);
}

int IntegerOf(const FlatValues& values, const std::string& name) {
  int number = 0;
  return absl::SimpleAtoi(ValueOf(values, name), &number) ? number : 0;
}

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

// The file's own word is exact where its times are rounded to milliseconds; 0: unknown.
double RateOf(const v1::VideoFacts& facts) {
  const double period_s = Period_s(facts), fps = facts.declared_fps();
  if (fps > 0 && (period_s <= 0 || std::abs(fps * period_s - 1) < 0.05)) return fps;
  return period_s > 0 ? 1 / period_s : 0;
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

using HeaderParser = absl::StatusOr<v1::VideoFacts> (*)(std::string_view);

absl::StatusOr<v1::VideoFacts> ReadHeader(const std::string& path, HeaderParser parse) {
  absl::StatusOr<VideoProgram> probe =
      VideoProgram::Start("ffprobe", path,
                          {"-hide_banner", "-v", "error", "-protocol_whitelist", "file", "-show_entries",
                           "stream=codec_type,channels,start_time,width,height,pix_fmt,time_base,nb_frames,"
                           "avg_frame_rate,r_frame_rate:stream_tags:"
                           "format_tags",
                           "-of", "flat", absl::StrCat("file:", path)},
                          VideoProgram::Out::kKept);
  if (!probe.ok()) return probe.status();
  const absl::StatusOr<VideoProgramOutput> said = probe->Finish();
  if (!said.ok())
    return absl::Status(said.status().code(), absl::StrCat(path, ": ", said.status().message()));
  if (said->wait_status != 0) return Complain(path, *said);
  absl::StatusOr<v1::VideoFacts> facts = parse(said->out);
  if (!facts.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", facts.status().message()));
  return facts;
}

absl::Status ReadFrameTimes(const FramesSeen& seen, v1::VideoFacts& facts) {
  std::vector<std::string> arguments = DecodingArguments();
  for (const std::string& word :
       {std::string("-i"), absl::StrCat("file:", facts.path()), std::string("-map"), std::string("0:v:0"),
        std::string("-vf"), FrameLinesFilter("pipe:1"), std::string("-fps_mode"), std::string("passthrough"),
        std::string("-f"), std::string("null"), std::string("-")})
    arguments.push_back(word);
  auto ffmpeg = VideoProgram::Start("ffmpeg", facts.path(), arguments, VideoProgram::Out::kKept);
  if (!ffmpeg.ok()) return ffmpeg.status();
  constexpr size_t kBytesOfFrame = 60;  // about, in the lines of a frame
  const absl::StatusOr<VideoProgramOutput> said =
      ffmpeg->Finish([&](size_t bytes) { return !seen || seen(bytes / kBytesOfFrame); });
  if (!said.ok())
    return absl::Status(said.status().code(), absl::StrCat(facts.path(), ": ", said.status().message()));
  absl::StatusOr<std::vector<int64_t>> pts = ParseFrameLines(said->out);
  if (!pts.ok()) return absl::InvalidArgumentError(absl::StrCat(facts.path(), ": ", pts.status().message()));
  if (pts->empty()) return Complain(facts.path(), *said);
  facts.set_complaint(EscapedText(LastComplaint(said->errors).substr(0, kMostText)));
  if (said->wait_status != 0 && facts.complaint().empty()) facts.set_complaint("ffmpeg failed");
  facts.mutable_frame_pts()->Add(pts->begin(), pts->end());
  return absl::OkStatus();
}

}  // namespace

bool IsVideoName(const std::string& path) {
  const std::string ending = absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  for (const char* known : {".mp4", ".mov", ".mkv", ".m4v", ".avi", ".mxf", ".webm", ".ts"})
    if (ending == known) return true;
  return false;
}

std::vector<std::string> DecodingArguments() {
  // A damaged picture is left out instead of shown with its holes filled from others. Two threads of slices
  // or frames: more gain little while several cameras are read.
  return {"-hide_banner", "-loglevel", "error",         "-nostdin",    "-y",      "-copyts",
          "-threads",     "2",         "-noautorotate", "-err_detect", "explode", "-protocol_whitelist",
          "file,pipe"};
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
  absl::StatusOr<v1::VideoFacts> facts = ReadHeader(file, &ParseSoundHeader);
  if (facts.ok()) facts->set_path(file);
  return facts;
}

absl::StatusOr<v1::VideoFacts> ParseVideoHeader(std::string_view flat) {
  const FlatValues values = ValuesOf(flat);
  v1::VideoFacts facts;
  std::string stream;
  for (const auto& [name, value] : values) {
    if (!absl::StartsWith(name, "streams.stream.") || !absl::EndsWith(name, ".codec_type")) continue;
    if (value == "video" && stream.empty())
      stream = name.substr(0, name.size() - std::string_view("codec_type").size());
  }
  if (stream.empty()) return absl::InvalidArgumentError("it holds no video");
  AddSounds(values, facts);
  facts.set_width_px(IntegerOf(values, stream + "width"));
  facts.set_height_px(IntegerOf(values, stream + "height"));
  if (facts.width_px() <= 0 || facts.height_px() <= 0 || facts.width_px() > kMostSide_px ||
      facts.height_px() > kMostSide_px)
    return absl::InvalidArgumentError("its pictures have no size; is it damaged?");
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

absl::StatusOr<std::vector<int64_t>> ParseFrameLines(std::string_view lines) {
  std::vector<int64_t> pts;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(lines.data(), lines.size()), '\n', absl::SkipEmpty())) {
    if (!absl::StartsWith(line, "frame:")) continue;
    const std::vector<absl::string_view> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    // The filter begins anew where it gets other pictures.
    if (words[0] != absl::StrCat("frame:", pts.size()))
      return absl::InvalidArgumentError(
          absl::StrCat("its pictures change their size or format at frame ", pts.size(),
                       "; cut it there: ffmpeg -i FILE -c copy -t SECONDS PART.mkv"));
    int64_t time = 0;
    if (words.size() < 2 || !absl::StartsWith(words[1], "pts:") ||
        !absl::SimpleAtoi(words[1].substr(4), &time))
      return absl::InvalidArgumentError(
          "its frames carry no times; put it into a container that has them: ffmpeg -r FPS -i FILE -c copy "
          "FILE.mkv");
    if (std::abs(time) > INT64_MAX / 4 || pts.size() >= kMostFrames)
      return absl::InvalidArgumentError("its frames have impossible times; is it damaged?");
    if (!pts.empty() && time <= pts.back())
      return absl::InvalidArgumentError(absl::StrCat("the time of frame ", pts.size(),
                                                     " is not after that of the frame before; write it anew: "
                                                     "ffmpeg -i FILE -c:v ffv1 FILE.mkv"));
    pts.push_back(time);
  }
  return pts;
}

absl::StatusOr<v1::VideoFacts> LookAtVideo(const std::string& path, const FramesSeen& seen) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  if (!S_ISREG(info.st_mode)) return absl::InvalidArgumentError(absl::StrCat(path, ": not a file"));
  if (info.st_size == 0)
    return absl::InvalidArgumentError(absl::StrCat(path, ": the file is empty; copy it again"));
  absl::StatusOr<v1::VideoFacts> facts = ReadHeader(path, &ParseVideoHeader);
  if (!facts.ok()) return facts;
  facts->set_path(path);
  facts->set_bytes(static_cast<uint64_t>(info.st_size));
  facts->set_modified_unix_ns(info.st_mtim.tv_sec * int64_t{1'000'000'000} + info.st_mtim.tv_nsec);
  if (absl::Status status = ReadFrameTimes(seen, *facts); !status.ok()) return status;
  return facts;
}

std::vector<double> FrameTimes_s(const v1::VideoFacts& facts) {
  const double count_s =
      static_cast<double>(facts.time_base_num()) / static_cast<double>(facts.time_base_den());
  std::vector<double> times_s;
  for (const int64_t pts : facts.frame_pts()) times_s.push_back(count_s * static_cast<double>(pts));
  return times_s;
}

double Period_s(const v1::VideoFacts& facts) { return Period_s(FrameTimes_s(facts)); }

double Period_s(const std::vector<double>& times_s) {
  std::vector<double> periods_s;
  for (size_t i = 1; i < times_s.size(); ++i) periods_s.push_back(times_s[i] - times_s[i - 1]);
  return periods_s.empty() ? 0 : Median(std::move(periods_s));
}

absl::StatusOr<Timecode> TimecodeOfFirst(const v1::VideoFacts& facts) {
  if (facts.timecode().empty()) return absl::NotFoundError(absl::StrCat(facts.path(), ": has no timecode"));
  const double fps = facts.timecode_fps() > 0 ? facts.timecode_fps() : RateOf(facts);
  const absl::StatusOr<Timecode> timecode = ParseTimecode(facts.timecode(), fps);
  if (timecode.ok()) return timecode;
  return absl::InvalidArgumentError(absl::StrCat(facts.path(), ": ", timecode.status().message()));
}

}  // namespace weft

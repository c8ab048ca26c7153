#include "services/studio/video/import_notes.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/studio/video/camera_offsets.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/timecode_track.h"

namespace weft {
namespace {

std::string OffsetText(const v1::CameraSync& sync) {
  return absl::StrFormat("offset %.4f s, sigma %.4f s, by %s%s", sync.offset_s(), sync.offset_sigma_s(),
                         sync.found_by(), sync.timecode().empty() ? "" : ", timecode " + sync.timecode());
}

// "1.000 s", or the first and the last of them, since the film's beginning.
std::string WhenText(const v1::VideoFacts& video) {
  const double count_s =
      static_cast<double>(video.time_base_num()) / static_cast<double>(video.time_base_den());
  const auto since_s = [&](int64_t pts) { return count_s * static_cast<double>(pts - video.begin_pts()); };
  const double first_s = since_s(video.damaged_pts(0));
  const double last_s = since_s(video.damaged_pts(video.damaged_pts_size() - 1));
  return video.damaged_pts_size() == 1 ? absl::StrFormat("at %.3f s", first_s)
                                       : absl::StrFormat("from %.3f to %.3f s", first_s, last_s);
}

std::string DamageText(const v1::VideoFacts& video) {
  constexpr const char* kRemedy = "copy it again from the camera where it is whole";
  const int frames = video.frame_pts_size(), damaged = video.damaged_pts_size();
  if (damaged > 0)
    return absl::StrCat("it is damaged, ", damaged, " of ", frames + damaged,
                        " pictures are missing in the take, ", WhenText(video),
                        ": they are damaged, or follow from such up to the next key frame (ffmpeg: ",
                        video.complaint(), "); ", kRemedy);
  if (!video.complaint().empty())
    return absl::StrCat("it is damaged, the take has the ", frames,
                        " pictures that it holds (ffmpeg: ", video.complaint(), "); ", kRemedy);
  return "";
}

// Pictures that the file has and that are not shown, without damage.
std::string HiddenText(const v1::VideoFacts& video) {
  const auto frames = static_cast<uint64_t>(video.frame_pts_size());
  if (video.hidden() > 0)
    return absl::StrCat("its edit list hides ", video.hidden(), " of its pictures; they are not in the take");
  const uint64_t known = frames + static_cast<uint64_t>(video.damaged_pts_size()) + video.same_time();
  if (!video.complaint().empty() || video.frames_declared() <= known) return "";
  return absl::StrCat("its header lists ", video.frames_declared(), " frames, and ", frames,
                      " are shown and in the take");
}

std::string SameTimeText(const v1::VideoFacts& video) {
  if (video.same_time() == 0) return "";
  return absl::StrCat(
      video.same_time(),
      " of its pictures have the time of the one before; the first of each time is in the take");
}

std::string FieldsText(const v1::VideoFacts& video) {
  if (video.interlaced() == 0) return "";
  return absl::StrCat(
      "it is interlaced: ", video.interlaced(), " of its ", video.frame_pts_size() + video.unused_size(),
      " pictures are coded as two fields, which show two moments half a period apart where the "
      "camera filmed fields; film progressively (25p, 30p, 50p, 60p)");
}

// Labels without dropped numbers of 29.97 frames a second are 3.6 s behind the clock after an hour.
bool KeepsClockTime(const v1::VideoFacts& video, double fps) {
  const absl::StatusOr<TimecodeAt> label = LabelOf(video, fps);
  const std::optional<TimecodeRate> rate = StandardRate(fps);
  return !label.ok() || !rate || !rate->is_slow || label->timecode.drops;
}

std::string MixedRatesText(const ImportedTake& imported, size_t camera) {
  const auto by_timecode = [&](size_t i) {
    return imported.take.cameras(static_cast<int>(i)).sync().found_by() == NameOf(SyncWay::kTimecode);
  };
  if (!by_timecode(camera)) return "";
  const std::vector<double> rates = TimecodeRates(imported.videos);
  for (size_t i = 0; i < camera; ++i) {
    if (!by_timecode(i)) continue;
    if (KeepsClockTime(imported.videos[i], rates[i]) ==
        KeepsClockTime(imported.videos[camera], rates[camera]))
      return "";
    return absl::StrFormat(
        "its timecode and that of %s count at different speeds, and part by 3.6 s an hour; the offset holds "
        "where both began at midnight; motion tells more (--sync motion), or one timecode for all cameras",
        imported.videos[i].camera());
  }
  return "";
}

// Where it does not film in all sets from the first to the last.
std::string LengthText(const std::vector<int64_t>& frames) {
  const auto has = [](int64_t frame) { return frame >= 0; };
  const auto first = std::ranges::find_if(frames, has) - frames.begin();
  const auto last = frames.rend() - std::find_if(frames.rbegin(), frames.rend(), has) - 1;
  const auto sets = static_cast<std::ptrdiff_t>(frames.size());
  if (first == 0 && last + 1 == sets) return "";
  return absl::StrCat("it films sets ", first, " to ", last, " of 0 to ", sets - 1,
                      "; it is missing in the others");
}

std::vector<std::string> WarningsOf(const ImportedTake& imported, size_t camera) {
  const v1::VideoFacts& video = imported.videos[camera];
  const v1::CameraSync& sync = imported.take.cameras(static_cast<int>(camera)).sync();
  std::vector<std::string> warnings;
  if (sync.longest_ms() > 0)
    warnings.push_back(
        absl::StrFormat("its rate varies: frames are %.1f to %.1f ms apart, %.1f in the middle; each frame "
                        "is in the set nearest to its time",
                        sync.shortest_ms(), sync.longest_ms(), sync.period_ms()));
  for (std::string text : {DamageText(video), HiddenText(video), SameTimeText(video), FieldsText(video),
                           MixedRatesText(imported, camera), LengthText(imported.plan.frames[camera])})
    if (!text.empty()) warnings.push_back(std::move(text));
  if (imported.plan.left_out[camera] > 0)
    warnings.push_back(
        absl::StrFormat("%d of its %d frames are in no set, since another one is nearer: frames are %.2f ms "
                        "apart, sets %.2f ms",
                        imported.plan.left_out[camera], video.frame_pts_size(), sync.period_ms(),
                        1e3 * Period_s(imported.videos[imported.plan.reference])));
  if (sync.found_by() == NameOf(SyncWay::kFileTimes))
    warnings.push_back(
        "its offset is by the time of the file, right to a second alone; motion or timecode tell more "
        "(--sync)");
  return warnings;
}

}  // namespace

std::vector<LedgerNote> NotesOn(const ImportedTake& imported) {
  std::vector<LedgerNote> notes;
  if (!imported.take.timecode().empty())
    notes.push_back({"", absl::StrFormat("timecode of the first frame set %s at %.6g frames a second",
                                         imported.take.timecode(), imported.take.timecode_fps())});
  for (size_t camera = 0; camera < imported.videos.size(); ++camera) {
    const std::string& id = imported.videos[camera].camera();
    notes.push_back({id, OffsetText(imported.take.cameras(static_cast<int>(camera)).sync())});
    for (std::string& text : WarningsOf(imported, camera)) notes.push_back({id, std::move(text), true});
  }
  return notes;
}

std::string WarningOf(const LedgerNote& note, const std::vector<v1::VideoFacts>& videos) {
  const auto video = std::ranges::find_if(
      videos, [&](const v1::VideoFacts& facts) { return facts.camera() == note.camera; });
  return absl::StrCat(note.camera, video == videos.end() ? "" : absl::StrCat(" (", video->path(), ")"), ": ",
                      note.text);
}

}  // namespace weft

#include "services/video/import_notes.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/video/camera_offsets.h"
#include "services/video/video_facts.h"

namespace weft {
namespace {

std::string OffsetText(const v1::CameraSync& sync) {
  return absl::StrFormat("offset %.4f s, sigma %.4f s, by %s%s", sync.offset_s(), sync.offset_sigma_s(),
                         sync.found_by(), sync.timecode().empty() ? "" : ", timecode " + sync.timecode());
}

std::string DamageText(const v1::VideoFacts& video) {
  const auto frames = static_cast<uint64_t>(video.frame_pts_size());
  const bool lacks = video.frames_declared() > frames;
  if (video.complaint().empty())
    return lacks ? absl::StrCat("its header lists ", video.frames_declared(), " frames, and ", frames,
                                " are shown and in the take; an edit list may leave out the others")
                 : "";
  return absl::StrCat("it is damaged, ", frames, lacks ? absl::StrCat(" of ", video.frames_declared()) : "",
                      " frames can be decoded and are in the take (ffmpeg: ", video.complaint(),
                      "); copy it again from the camera where it is whole");
}

// Where it does not film in all sets from the first to the last.
std::string LengthText(const std::vector<int64_t>& frames) {
  const auto has = [](int64_t frame) { return frame >= 0; };
  const auto first = std::find_if(frames.begin(), frames.end(), has) - frames.begin();
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
  for (std::string text : {DamageText(video), LengthText(imported.plan.frames[camera])})
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
  const auto video = std::find_if(videos.begin(), videos.end(),
                                  [&](const v1::VideoFacts& facts) { return facts.camera() == note.camera; });
  return absl::StrCat(note.camera, video == videos.end() ? "" : absl::StrCat(" (", video->path(), ")"), ": ",
                      note.text);
}

}  // namespace weft

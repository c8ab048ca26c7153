// The section with the meshes in three dimensions.
#include "absl/strings/str_cat.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/sequence_view.h"

namespace weft {

std::string SequenceSection(const SequenceView& sequence, const std::vector<FramePictures>& pictures,
                            size_t frames_of_job) {
  MeshPicture still;
  for (const FramePictures& frame : pictures) {
    if (frame.by_state.empty()) continue;
    still = frame.by_state[0];
    still.title = absl::StrCat("Frame ", frame.frame, ", colours: state");
    break;
  }
  const auto count = [](size_t number) { return FormatCount(static_cast<int64_t>(number)); };
  std::string about =
      absl::StrCat("The view follows the garment and shows ", count(sequence.kept().size()),
                   " of its vertices as they are in mesh.ply, to a part in 130,000 of its size");
  absl::StrAppend(&about, sequence.frames() < frames_of_job
                              ? absl::StrCat(", in ", count(sequence.frames()), " of ", count(frames_of_job),
                                             " frames, spread evenly.")
                              : ".");
  return sequence.Section(still, about);
}

}  // namespace weft

#include "services/tools/cli/take_range.h"

#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/ground/process/command_option.h"
#include "services/tools/cli/input_options.h"

namespace weft {
namespace {

// Frames of takes are named by the numbers of their sets.
absl::Status ParseSets(const std::string& text, TakeViewOptions& view) {
  if (text.empty()) return absl::OkStatus();
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  if (parts.size() == 1 && absl::SimpleAtoi(text, &view.first_set)) {
    view.last_set = view.first_set;
    return absl::OkStatus();
  }
  uint64_t end = UINT64_MAX;
  const bool fits = parts.size() == 2 && (parts[0].empty() || absl::SimpleAtoi(parts[0], &view.first_set)) &&
                    (parts[1].empty() || (absl::SimpleAtoi(parts[1], &end) && end > view.first_set));
  if (!fits) {
    return absl::InvalidArgumentError(
        absl::StrCat("--frames ", text,
                     ": expected the number of a frame set, or A:B, the numbers of the first one and of the "
                     "first one after the range"));
  }
  view.last_set = end - 1;
  return absl::OkStatus();
}

}  // namespace

void AddTakeRangeOptions(CLI::App& command, TakeRange& range) {
  AddFramesOption(command, range.sets, "Which frame sets of the take, all by default", "--sets");
  AddOption(command, "--shift CAMERA=MS", range.shifts,
            "Add this to all times of a camera's frames, again for another camera. Half a period and more "
            "takes them to the sets that were triggered then")
      ->default_str("")
      ->allow_extra_args(false);
}

absl::StatusOr<TakeViewOptions> ParseTakeRange(const TakeRange& range) {
  TakeViewOptions view;
  WEFT_RETURN_IF_ERROR(ParseSets(range.sets, view));
  for (const std::string& text : range.shifts) {
    const std::vector<std::string> parts = absl::StrSplit(text, absl::MaxSplits('=', 1));
    double shift_ms = 0;
    if (parts.size() != 2 || parts[0].empty() || !absl::SimpleAtod(parts[1], &shift_ms) ||
        !(std::abs(shift_ms) < 1e12))
      return absl::InvalidArgumentError(absl::StrCat("--shift ", text, ": expected CAMERA=MILLISECONDS"));
    if (!view.shift_ns.emplace(parts[0], std::llround(1e6 * shift_ms)).second)
      return absl::InvalidArgumentError(
          absl::StrCat("--shift ", text, ": the camera has been shifted already; name each once"));
  }
  return view;
}

}  // namespace weft

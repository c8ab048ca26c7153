#include "services/results/evaluation/listed_frames.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/frame_number.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/synthetic/truth_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool HoldsAnyFile(const fs::path& folder) {
  std::error_code error;
  return fs::directory_iterator(folder, error) != fs::directory_iterator();
}

// Whether the job was asked for a frame; jobs of earlier versions know positions in the dump alone.
bool WasAskedFor(const v1::Job& job, const std::string& name, int64_t position) {
  if (!job.first_frame().empty() && !job.last_frame().empty())
    return !NaturalLess(name, job.first_frame()) && !NaturalLess(job.last_frame(), name);
  const v1::RegistrationSpec& spec = job.spec();
  return position >= spec.first_frame() && (spec.end_frame() == 0 || position < spec.end_frame());
}

// Folders with a mesh, and those of frames that failed, which have a report alone.
absl::StatusOr<std::vector<std::string>> FramesOfResult(const std::string& result) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> meshes, ListFrameFolders(result));
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> reports, ListFrameFolders(result, FrameFile::kReport));
  std::set<std::string> distinct(meshes.begin(), meshes.end());
  distinct.insert(reports.begin(), reports.end());
  std::vector<std::string> names(distinct.begin(), distinct.end());
  std::ranges::sort(names, NaturalLess);
  return names;
}

// Why a truth with frames has none for this result.
absl::Status OfOtherFrames(const std::string& truth, const std::vector<std::string>& names,
                           const std::string& result, const v1::Job& job) {
  const std::string wanted = job.first_frame().empty()
                                 ? "those"
                                 : absl::StrCat("the frames ", job.first_frame(), " to ", job.last_frame());
  return absl::FailedPreconditionError(absl::StrCat(truth, ": has the frames ", names.front(), " to ",
                                                    names.back(), ", and none of ", wanted, " of ", result,
                                                    "; give the truth of the take that was registered"));
}

}  // namespace

absl::StatusOr<std::vector<ListedFrame>> ListFrames(const std::string& result, const std::string& truth,
                                                    const v1::Job& job, const FrameSource* dump,
                                                    const TakeTimes& times) {
  const bool knows_job = job.has_spec();
  const bool of_dump = truth.empty() && knows_job && dump != nullptr;
  WEFT_ASSIGN_OR_RETURN(std::vector<std::string> names,
                        of_dump         ? absl::StatusOr<std::vector<std::string>>(dump->frame_names())
                        : truth.empty() ? FramesOfResult(result)
                                        : ListTruthFrames(truth));
  std::map<std::string, int> in_dump;
  if (dump != nullptr)
    for (size_t i = 0; i < dump->frame_names().size(); ++i)
      in_dump[dump->frame_names()[i]] = static_cast<int>(i);
  // Of frames that the dump lacks neither its order nor its times tell: then the names tell of all.
  const bool by_dump =
      dump != nullptr && std::ranges::all_of(names, [&](const auto& name) { return in_dump.contains(name); });
  const FrameSteps steps(by_dump ? dump->frame_names() : names);
  std::vector<ListedFrame> frames;
  bool any_registered = false;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string& name = names[i];
    const auto at = in_dump.find(name);
    const int dump_index = at != in_dump.end() ? at->second : -1;
    const int64_t place = dump_index >= 0 ? dump_index : static_cast<int64_t>(i);
    const bool is_registered = HoldsAnyFile(fs::path(result) / name);
    if (knows_job && !WasAskedFor(job, name, place)) continue;
    any_registered |= is_registered;
    const bool has_time = by_dump && static_cast<size_t>(dump_index) < times.positions.size();
    const int64_t position = has_time ? times.positions[dump_index]
                                      : steps.Between(0, by_dump ? static_cast<size_t>(dump_index) : i);
    frames.push_back({name, position, dump_index});
  }
  const bool is_of_others = !truth.empty() && !any_registered && IsFolder(result);
  if (is_of_others && !FramesOfResult(result).value_or(std::vector<std::string>()).empty())
    return OfOtherFrames(truth, names, result, job);
  if (!frames.empty()) return frames;
  return absl::NotFoundError(
      absl::StrCat(result, ": holds no frames; give the --out folder of `weft register`"));
}

}  // namespace weft

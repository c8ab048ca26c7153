#include "services/server/daemon/work/lost_jobs.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/natural_order.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/work/pipeline/register_frame.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Names of the folders in `folder`, in the order of frames.
std::vector<std::string> FoldersIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    if (it->is_directory(ignored)) names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end(), NaturalLess);
  return names;
}

// Workers wrote it, so no link in it is followed.
bool TakeUp(const std::string& folder, const std::string& id, Catalogue& catalogue) {
  const absl::StatusOr<ConfinedFolder> out = ConfinedFolder::Open(folder);
  const absl::StatusOr<std::string> text = out.ok() ? out->Read(kJobFile) : out.status();
  v1::Job job;
  if (!text.ok() || !ParseJson(*text, out->Named(kJobFile), job).ok() || job.id() != id) return false;
  std::vector<v1::FrameInfo> frames;
  for (const std::string& name : FoldersIn(folder)) {
    const absl::StatusOr<ConfinedFolder> frame = out->Child(name, ConfinedFolder::IfMissing::kFail);
    const absl::StatusOr<std::string> json =
        frame.ok() ? frame->Read(FileName(FrameFile::kReport)) : frame.status();
    v1::FrameReport report;
    if (json.ok() && ParseJson(*json, name, report).ok() && report.frame() == name)
      frames.push_back(SummaryOf(report, /*reused=*/false));
  }
  return catalogue.AddJob(job, frames).ok();
}

// At most a few names.
std::string Named(const std::vector<std::string>& names) {
  constexpr size_t kShown = 5;
  const auto shown = names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kShown));
  return absl::StrCat(EscapedText(absl::StrJoin(names.begin(), shown, ", ")),
                      names.size() > kShown ? absl::StrCat(" and ", names.size() - kShown, " more") : "");
}

}  // namespace

std::vector<std::string> TakeUpLostJobs(const std::string& results_folder, Catalogue& catalogue) {
  std::vector<std::string> restored, unknown;
  for (const std::string& id : FoldersIn(results_folder)) {
    if (absl::StartsWith(id, kForgottenPrefix)) continue;
    const absl::Status known = catalogue.ReadJob(id).status();
    if (!absl::IsNotFound(known)) continue;
    (TakeUp(absl::StrCat(results_folder, "/", id), id, catalogue) ? restored : unknown).push_back(id);
  }
  std::vector<std::string> warnings;
  if (!restored.empty()) {
    warnings.push_back(absl::StrCat("the list of jobs lacked jobs whose results are in ", results_folder,
                                    "; restored from their job.json: ", Named(restored)));
  }
  if (!unknown.empty()) {
    warnings.push_back(absl::StrCat(results_folder, " holds results of jobs that are not in the list: ",
                                    Named(unknown), "; copy what you need, and submit those jobs again"));
  }
  return warnings;
}

}  // namespace weft

#include "services/work/pipeline/frame_extras.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/rig/camera_match.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/pcd/pcd_file.h"
#include "services/work/pipeline/frame_inputs.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// The number of a name without leading zeros; empty for names with none or several.
std::string OnlyNumber(const std::string& name) {
  const auto is_digit = [](char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); };
  const auto first = std::ranges::find_if(name, is_digit);
  const auto end = std::find_if_not(first, name.end(), is_digit);
  if (first == end || std::any_of(end, name.end(), is_digit)) return "";
  const std::string digits(first, end);
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size() - 1));
}

std::string Stem(const std::string& name) { return name.substr(0, name.rfind('.')); }

bool IsScanName(const std::string& name) {
  return !absl::StartsWith(name, ".") && (absl::EndsWithIgnoreCase(name, ".ply") || IsPcdName(name));
}

std::string Plural(size_t count, const char* one, const char* many) {
  return absl::StrCat(count, " ", count == 1 ? one : many);
}

std::string LackText(const std::vector<std::string>& lack, size_t frames, const char* what,
                     const std::string& folder) {
  return absl::StrCat(folder, ": ", lack.size(), " of ", Plural(frames, "frame has", "frames have"), " no ",
                      what, ": ", FirstNames(lack));
}

absl::Status CheckScanFolder(const std::string& folder, const std::vector<std::string>& dump_frames,
                             const std::vector<std::string>& job_frames, bool is_live,
                             std::vector<std::string>& notes) {
  WEFT_ASSIGN_OR_RETURN(const ScanFolder scans, ScanFolder::List(folder));
  const std::vector<std::string> names = scans.names();
  if (names.empty() && !is_live) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder, ": has no scan, no file there ends in .ply or .pcd; name them <frame>.ply, e.g. ",
        job_frames.front(), ".ply"));
  }
  std::set<std::string> used;
  for (const std::string& frame : dump_frames) {
    WEFT_ASSIGN_OR_RETURN(const std::string scan, scans.Of(frame));
    if (!scan.empty()) used.insert(fs::path(scan).filename().string());
  }
  std::vector<std::string> lack, strange;
  for (const std::string& frame : job_frames)
    if (scans.Of(frame).value_or("").empty()) lack.push_back(frame);
  if (is_live) return absl::OkStatus();
  if (lack.size() == job_frames.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder, ": no scan there is named after a frame. It has ", FirstNames(names), ", the frames are ",
        FirstNames(job_frames), "; name scans <frame>.ply, e.g. ", job_frames.front(), ".ply"));
  }
  for (const std::string& name : names) {
    // A second format of a scan that is used.
    const bool is_known = std::ranges::any_of(
        used, [&](const std::string& other) { return other == name || Stem(other) == Stem(name); });
    if (!is_known) strange.push_back(name);
  }
  if (!lack.empty()) notes.push_back(LackText(lack, job_frames.size(), "scan", folder));
  if (!strange.empty()) {
    notes.push_back(absl::StrCat(folder, ": ", Plural(strange.size(), "scan is", "scans are"),
                                 " of no frame: ", FirstNames(strange)));
  }
  return absl::OkStatus();
}

absl::Status CheckStartFolder(const std::string& folder, const std::vector<std::string>& job_frames,
                              bool is_live, std::vector<std::string>& notes) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> there, ListFrameFolders(folder, FrameFile::kMesh));
  std::vector<std::string> lack;
  for (const std::string& frame : job_frames)
    if (StartPath(frame, folder).empty()) lack.push_back(frame);
  if (lack.empty() || is_live) return absl::OkStatus();
  if (lack.size() < job_frames.size()) {
    notes.push_back(LackText(lack, job_frames.size(), "mesh to start from", folder));
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(folder, ": has no <frame>/mesh.ply of a frame to register, ", FirstNames(job_frames),
                   there.empty() ? "" : absl::StrCat("; it has those of ", FirstNames(there)),
                   "; give the results of an earlier registration of this take"));
}

}  // namespace

absl::StatusOr<ScanFolder> ScanFolder::List(const std::string& folder) {
  ScanFolder scans;
  scans.folder_ = folder;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (IsScanName(name)) scans.names_.push_back(name);
  }
  if (error == std::errc::no_such_file_or_directory)
    return absl::NotFoundError(absl::StrCat(folder, ": no such folder; scans are looked for there"));
  if (error == std::errc::not_a_directory)
    return absl::InvalidArgumentError(absl::StrCat(folder, ": is no folder; give that of the scans"));
  if (error)
    return absl::PermissionDeniedError(absl::StrCat(folder, ": cannot be listed (", error.message(), ")"));
  std::ranges::sort(scans.names_, NaturalLess);
  for (size_t i = 0; i < scans.names_.size(); ++i) {
    const std::string stem = Stem(scans.names_[i]);
    scans.of_stem_[stem].push_back(i);
    if (const std::string number = OnlyNumber(stem); !number.empty()) scans.of_number_[number].push_back(i);
  }
  return scans;
}

absl::StatusOr<std::string> ScanFolder::Of(const std::string& frame) const {
  const auto path_of = [this](size_t i) { return (fs::path(folder_) / names_[i]).string(); };
  auto found = of_stem_.find(frame);
  if (found == of_stem_.end()) {
    found = of_number_.find(OnlyNumber(frame));
    if (found == of_number_.end()) return "";
  }
  const std::vector<size_t>& files = found->second;
  const auto is_ply = [this](size_t i) { return !IsPcdName(names_[i]); };
  const auto plies = std::ranges::count_if(files, is_ply);
  const size_t of_format = plies > 0 ? static_cast<size_t>(plies) : files.size();
  if (of_format > 1) {
    return absl::InvalidArgumentError(absl::StrCat(folder_, ": ", names_[files[0]], " and ", names_[files[1]],
                                                   " are both scans of frame ", frame, "; remove one"));
  }
  const auto ply = std::ranges::find_if(files, is_ply);
  return path_of(ply == files.end() ? files.front() : *ply);
}

std::vector<std::string> ScanFolder::names() const { return names_; }

absl::StatusOr<std::vector<std::string>> CheckExtras(const v1::RegistrationOptions& options,
                                                     const std::vector<std::string>& dump_frames,
                                                     const std::vector<std::string>& job_frames,
                                                     bool is_live) {
  std::vector<std::string> notes;
  absl::Status status;
  if (!options.scans().empty())
    status = CheckScanFolder(options.scans(), dump_frames, job_frames, is_live, notes);
  if (status.ok() && !options.starts().empty())
    status = CheckStartFolder(options.starts(), job_frames, is_live, notes);
  if (!status.ok()) return status;
  return notes;
}

}  // namespace weft

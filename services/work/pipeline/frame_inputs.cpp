#include "services/work/pipeline/frame_inputs.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/rig_file.h"
#include "services/work/pipeline/frame_extras.h"

namespace weft {
namespace {

std::string IfThere(std::string path) { return PathExists(path) ? std::move(path) : ""; }

}  // namespace

std::string ScanPath(const std::string& frame, const std::string& scans) {
  if (scans.empty()) return "";
  for (const char* ending : {".ply", ".pcd"}) {
    std::string path = IfThere((std::filesystem::path(scans) / (frame + ending)).string());
    if (!path.empty()) return path;
  }
  const absl::StatusOr<ScanFolder> folder = ScanFolder::List(scans);
  return folder.ok() ? folder->Of(frame).value_or("") : "";
}

std::string StartPath(const std::string& frame, const std::string& starts) {
  return starts.empty() ? "" : IfThere(FramePaths(starts, frame).Of(FrameFile::kMesh));
}

absl::StatusOr<std::string> FrameFingerprint(const FrameSource& dump, size_t index,
                                             const v1::RegistrationOptions& options) {
  WEFT_ASSIGN_OR_RETURN(std::string fingerprint, dump.Fingerprint(index));
  const std::string& frame = dump.frame_names()[index];
  for (const std::string& file : {ScanPath(frame, options.scans()), StartPath(frame, options.starts())}) {
    if (file.empty()) continue;
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto written = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    absl::StrAppend(&fingerprint, "+", bytes, "-", written);
  }
  return fingerprint;
}

absl::StatusOr<FingerprintsNow> FingerprintsNow::Open(const v1::RegistrationSpec& spec) {
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(spec.rig()));
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> dump,
                        OpenDump(spec.dump(), rig, spec.options().mosaic()));
  FingerprintsNow now;
  now.options_ = spec.options();
  now.dump_ = std::move(dump);
  const std::vector<std::string>& names = now.dump_->frame_names();
  for (size_t i = 0; i < names.size(); ++i) now.index_of_.emplace(names[i], i);
  return now;
}

std::string FingerprintsNow::Of(const std::string& frame) const {
  const auto found = index_of_.find(frame);
  if (found == index_of_.end()) return "";
  const absl::StatusOr<std::string> fingerprint = FrameFingerprint(*dump_, found->second, options_);
  return fingerprint.ok() ? *fingerprint : "";
}

}  // namespace weft

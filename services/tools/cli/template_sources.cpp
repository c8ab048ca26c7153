#include "services/tools/cli/template_sources.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/path_facts.h"
#include "capture/take/frame_range.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/rig_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/cli/progress.h"
#include "services/work/pipeline/frame_cloud.h"

namespace weft {
namespace {

// `count` of the positions in `range`, from the first to the last.
std::vector<size_t> SpreadOver(const FrameRange& range, size_t count) {
  std::vector<size_t> positions;
  const size_t frames = range.end - range.first;
  count = std::min(count, frames);
  for (size_t i = 0; i < count; ++i)
    positions.push_back(range.first + (count == 1 ? 0 : i * (frames - 1) / (count - 1)));
  return positions;
}

absl::StatusOr<Cloud> FrameCloud(const Rig& rig, const std::vector<double>& camera_sigma_px,
                                 const BoardIndex& board, const FrameSource& dump, size_t index,
                                 const PipelineOptions& options, const FrameProgress& progress,
                                 const std::stop_token& stop) {
  const DecodedFrame decoded =
      DecodeFrame(kNeverKept, {rig, board, dump, index}, options.decode, 0, progress, stop);
  if (stop.stop_requested()) return absl::CancelledError("the build was cancelled");
  absl::StatusOr<Cloud> cloud =
      TriangulateFrame(kNeverKept, rig, camera_sigma_px, decoded.views, options.cloud);
  if (!cloud.ok() || !cloud->points.empty()) return cloud;
  return absl::FailedPreconditionError(
      NoCloudReason(decoded.views, decoded.reports, options.cloud.triangulation.consensus.min_views));
}

// Adds the clouds of the dump's frames to `sources`.
absl::Status AddDump(const std::string& folder, const TemplateSourceFiles& files, const Board& board,
                     const PipelineOptions& options, bool quiet, const std::stop_token& stop,
                     TemplateSources& sources) {
  if (files.rig.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": is a folder, and a dump needs its cameras: give --rig rig.json"));
  }
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(files.rig));
  WEFT_ASSIGN_OR_RETURN(const std::vector<double> camera_sigma_px, ReadCameraSigmas(files.rig));
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<FrameSource> dump, OpenDump(folder, rig, files.mosaic));
  for (const std::string& warning : dump->warnings()) PrintWarning(warning);
  WEFT_ASSIGN_OR_RETURN(const BoardIndex index, Naming(files.board, BoardIndex::Build(board)));
  WEFT_ASSIGN_OR_RETURN(const FrameRange range, FindFrameRange(files.frames, dump->frame_names(), folder));
  const std::vector<size_t> frames = SpreadOver(range, static_cast<size_t>(files.samples));
  constexpr uint64_t kSteps = 1000;  // of each frame
  Progress progress("decode", kSteps * frames.size(), ProgressVisible(quiet), ProgressUnit::kPercent);
  absl::Status last = absl::OkStatus();
  size_t found = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    const auto advance = [&](double share) {
      progress.Set(kSteps * i + static_cast<uint64_t>(share * kSteps), kSteps * frames.size());
    };
    absl::StatusOr<Cloud> cloud =
        FrameCloud(rig, camera_sigma_px, index, *dump, frames[i], options, advance, stop);
    if (absl::IsCancelled(cloud.status())) return cloud.status();
    const std::string& name = dump->frame_names()[frames[i]];
    last = cloud.status();
    if (!cloud.ok()) {
      progress.PrintLine(absl::StrCat("frame ", name, " is left out: ", cloud.status().message()));
      continue;
    }
    WEFT_RETURN_IF_ERROR(CreateFolders(files.clouds_out));
    const std::string path = (std::filesystem::path(files.clouds_out) / (name + ".ply")).string();
    WEFT_RETURN_IF_ERROR(WriteCloud(path, *cloud));
    sources.clouds.push_back(*std::move(cloud));
    sources.cloud_names.push_back(path);
    ++found;
  }
  if (found > 0) return absl::OkStatus();
  return absl::Status(last.code(),
                      absl::StrCat(folder, ": no frame has a cloud; the last one: ", last.message()));
}

}  // namespace

absl::StatusOr<TemplateSources> ReadTemplateSources(const TemplateSourceFiles& files, const Board& board,
                                                    const PipelineOptions& options, bool quiet,
                                                    const std::stop_token& stop) {
  TemplateSources sources;
  if (!files.panels.empty()) {
    WEFT_ASSIGN_OR_RETURN(sources.panel_labels, ReadPanelMask(files.panels, board.rows, board.cols));
  } else {
    sources.panel_labels = board.panels;
  }
  for (const std::string& path : files.sources) {
    if (IsFolder(path)) {
      WEFT_RETURN_IF_ERROR(AddDump(path, files, board, options, quiet, stop, sources));
      continue;
    }
    WEFT_ASSIGN_OR_RETURN(Cloud cloud, ReadCloud(path));
    sources.clouds.push_back(std::move(cloud));
    sources.cloud_names.push_back(path);
  }
  return sources;
}

}  // namespace weft

#include "services/work/pipeline/registration_inputs.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/take/frame_range.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/options/presets.h"
#include "services/formats/pcd/pcd_file.h"
#include "services/formats/pcd/pcl_program.h"
#include "services/work/pipeline/frame_extras.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

absl::Status CheckHash(const char* what, const std::string& path, const std::string& expected,
                       const std::string& found) {
  if (expected.empty() || expected == found) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(path, ": the ", what, " has hash ", found,
                                                    ", but the job was made with hash ", expected,
                                                    "; it changed since, so submit the job again"));
}

// PCD that is asked for, or among the scans, needs PCL: said now, not after the first frame was decoded.
absl::Status CheckPcd(const v1::RegistrationOptions& options, const std::vector<std::string>& frames) {
  const std::string& format = options.cloud_format();
  if (!format.empty() && format != "ply" && !WantsPcd(options)) {
    return absl::InvalidArgumentError(absl::StrCat("cloud_format: \"", format, "\" is neither ply nor pcd"));
  }
  const bool reads = std::ranges::any_of(
      frames, [&options](const std::string& frame) { return IsPcdName(ScanPath(frame, options.scans())); });
  return reads || WantsPcd(options) ? CheckPclProgram() : absl::OkStatus();
}

}  // namespace

absl::Status CheckExpectedHashes(const v1::RegistrationSpec& spec, const v1::InputHashes& hashes) {
  absl::Status status = CheckHash("rig", spec.rig(), spec.expected().rig(), hashes.rig());
  status.Update(CheckHash("board", spec.board(), spec.expected().board(), hashes.board()));
  status.Update(CheckHash("template", spec.garment(), spec.expected().garment(), hashes.garment()));
  return status;
}

absl::StatusOr<std::unique_ptr<RegistrationInputs>> LoadInputs(const v1::RegistrationSpec& spec) {
  WEFT_RETURN_IF_ERROR(CheckInputsGiven(spec));
  if (spec.out().empty())
    return absl::InvalidArgumentError("the field spec.out is empty: name a folder for results");
  WEFT_RETURN_IF_ERROR(EffectiveOptions(spec.options()).status());
  WEFT_ASSIGN_OR_RETURN(Rig rig, ReadRig(spec.rig()));
  WEFT_ASSIGN_OR_RETURN(std::vector<double> camera_sigma_px, ReadCameraSigmas(spec.rig()));
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(spec.board()));
  std::vector<std::string> warnings;
  WEFT_ASSIGN_OR_RETURN(Template garment, ReadTemplateFor(board, spec.garment(), &warnings));
  WEFT_ASSIGN_OR_RETURN(GarmentParts parts, ReadGarmentParts(spec.garment()));
  parts.board_rows = board.rows, parts.board_cols = board.cols;
  MeshTexture texture = TextureOf(garment, parts);
  v1::InputHashes hashes;
  hashes.set_rig(rig.ContentHash());
  hashes.set_board(board.ContentHash());
  hashes.set_garment(garment.ContentHash());
  WEFT_RETURN_IF_ERROR(CheckExpectedHashes(spec, hashes));

  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> dump,
                        OpenDump(spec.dump(), rig, spec.options().mosaic()));
  WEFT_RETURN_IF_ERROR(CheckPcd(spec.options(), dump->frame_names()));
  WEFT_ASSIGN_OR_RETURN(BoardIndex index, Naming(spec.board(), BoardIndex::Build(board)));
  auto model = std::make_unique<AlignmentModel>(garment);
  std::vector<CellNeighborhood> neighborhoods = FindCellNeighborhoods(garment);
  warnings.insert(warnings.end(), dump->warnings().begin(), dump->warnings().end());
  return std::make_unique<RegistrationInputs>(
      RegistrationInputs{std::move(rig), std::move(index), std::move(garment), std::move(model),
                         std::move(dump), std::move(hashes), std::move(neighborhoods), std::move(warnings),
                         std::move(camera_sigma_px), std::move(texture)});
}

absl::StatusOr<std::vector<size_t>> FramesInRange(const v1::RegistrationSpec& spec,
                                                  const std::vector<std::string>& frame_names) {
  std::vector<size_t> range;
  if (!spec.frames().empty()) {
    if (spec.first_frame() != 0 || spec.end_frame() != 0) {
      return absl::InvalidArgumentError(
          "frames: named twice, by `frames` and by `first_frame` and `end_frame`; give one of them");
    }
    WEFT_ASSIGN_OR_RETURN(const FrameRange named, FindFrameRange(spec.frames(), frame_names, spec.dump()));
    for (size_t i = named.first; i < named.end; ++i) range.push_back(i);
    return range;
  }
  const auto count = static_cast<int64_t>(frame_names.size());
  const int64_t first = spec.first_frame();
  const int64_t end = spec.end_frame() == 0 ? count : spec.end_frame();
  if (first < 0 || end > count || first >= end) {
    return absl::InvalidArgumentError(absl::StrCat(
        "frames ", first, ":", end, " of ", spec.dump(), ": the dump holds ", count, " frame(s), ",
        frame_names.front(), " to ", frame_names.back(), "; give a range A:B with 0 <= A < B <= ", count));
  }
  for (int64_t i = first; i < end; ++i) range.push_back(static_cast<size_t>(i));
  return range;
}

absl::Status AddExtraWarnings(const v1::RegistrationSpec& spec, const std::vector<size_t>& frames,
                              RegistrationInputs& inputs) {
  const std::vector<std::string>& names = inputs.dump->frame_names();
  std::vector<std::string> of_job;
  for (const size_t index : frames) of_job.push_back(names[index]);
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> notes,
                        CheckExtras(spec.options(), names, of_job, spec.live_every() > 0));
  inputs.warnings.insert(inputs.warnings.end(), notes.begin(), notes.end());
  return absl::OkStatus();
}

}  // namespace weft

#include "services/formats/synthetic/dataset_file.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "evaluation/chaos_floor.h"
#include "figure/motion_generator.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/figure/motion_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/frames_file.h"
#include "simulation/worn_garment.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

std::string PathOf(const std::string& folder) { return (fs::path(folder) / "dataset.json").string(); }

std::string FolderOf(const std::string& folder, const std::string& take) {
  return (fs::path(folder) / "takes" / take).string();
}

std::string FramesOf(const std::string& folder, const std::string& take) {
  return (fs::path(FolderOf(folder, take)) / "truth" / "frames.bin").string();
}

// Empty where the take is not complete.
absl::StatusOr<std::string> HashOfFrames(const std::string& path) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(path);
  if (absl::IsNotFound(bytes.status())) return std::string();
  if (!bytes.ok()) return bytes.status();
  return absl::StrFormat("%016x", Checksum(bytes->data(), bytes->size()));
}

absl::StatusOr<DatasetSplit> SplitNamed(std::string_view name) {
  for (const DatasetSplit split : {DatasetSplit::kTrain, DatasetSplit::kValidate, DatasetSplit::kTestKnown,
                                   DatasetSplit::kTestUnseen, DatasetSplit::kChaos})
    if (NameOf(split) == name) return split;
  return absl::InvalidArgumentError(absl::StrCat(
      "split \"", std::string(name), "\" is none of train, validate, test-known, test-unseen, chaos"));
}

// What the take is, and where its name does not follow from it, an error: names are folders.
absl::StatusOr<DatasetTake> TakeOf(const v1::DatasetTake& proto) {
  WEFT_ASSIGN_OR_RETURN(const DatasetSplit split, SplitNamed(proto.split()));
  WEFT_ASSIGN_OR_RETURN(const MotionKind motion, MotionKindNamed(proto.motion()));
  const DatasetTake take = {split, motion, proto.motion_seed(), proto.frames()};
  if (proto.name() == take.Name()) return take;
  return absl::InvalidArgumentError(
      absl::StrCat("take \"", proto.name(), "\" should be called ", take.Name()));
}

absl::Status AddTake(const DatasetPreset& preset, const DatasetTake& take, const std::string& folder,
                     v1::Dataset& out) {
  WEFT_ASSIGN_OR_RETURN(const SyntheticTakeOptions options, OptionsOf(preset, take));
  WEFT_ASSIGN_OR_RETURN(std::string hash, HashOfFrames(FramesOf(folder, take.Name())));
  const PerformanceOptions& performance = options.performance;
  v1::DatasetTake* to = out.add_takes();
  to->set_name(take.Name());
  to->set_split(std::string(NameOf(take.split)));
  to->set_motion(std::string(NameOf(take.motion)));
  to->set_motion_seed(take.seed);
  to->set_motion_hash(MotionHash(*performance.clip));
  to->set_frames(take.frames);
  to->set_step_ms(1000 * (performance.step_s > 0 ? performance.step_s : AutomaticStepS(performance)));
  to->set_frames_hash(std::move(hash));
  return absl::OkStatus();
}

// Template and board of the garment that was put on for all.
absl::Status AddGarment(const std::string& folder, v1::Dataset& out) {
  const fs::path garment = fs::path(folder) / "dressed" / "template";
  if (!PathExists(garment)) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const Template read, ReadTemplate(garment.string()));
  out.set_template_hash(read.ContentHash());
  out.set_board_hash(read.board_hash);
  out.set_vertices(static_cast<int>(read.rest.vertices_mm.size()));
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteDatasetFile(const DatasetPreset& preset, const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const SyntheticTakeOptions base, DatasetTakeBase(preset));
  v1::Dataset out;
  out.set_name(std::string(preset.name));
  out.set_made_by("weft " WEFT_VERSION);
  out.set_command(absl::StrCat("weft dataset make ", std::string(preset.name), " --out"));
  absl::Status status = AddGarment(folder, out);
  out.set_cell_mm(base.performance.cell_mm);
  out.set_fps(base.performance.fps);
  out.set_seed(base.seed);
  BodyToProto({"", base.performance.body}, *out.mutable_body());
  for (const DatasetTake& take : preset.takes)
    if (status.ok()) status = AddTake(preset, take, folder, out);
  if (!status.ok()) return status;
  return WriteJsonFile(PathOf(folder), out);
}

absl::StatusOr<v1::Dataset> ParseDataset(std::string_view json, const std::string& source_name) {
  v1::Dataset out;
  WEFT_RETURN_IF_ERROR(ParseJson(json, source_name, out));
  std::vector<DatasetTake> takes;
  absl::Status status;
  for (const v1::DatasetTake& proto : out.takes()) {
    const absl::StatusOr<DatasetTake> take = TakeOf(proto);
    status.Update(take.status());
    if (take.ok()) takes.push_back(*take);
  }
  if (status.ok()) status = CheckSplits(takes);
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(status.message())));
  return out;
}

absl::StatusOr<v1::Dataset> ReadDatasetFile(const std::string& folder) {
  const std::string path = PathOf(folder);
  const absl::StatusOr<std::string> json = ReadWholeFile(path, kMaxJsonBytes);
  if (absl::IsNotFound(json.status()))
    return absl::NotFoundError(
        absl::StrCat(path, ": is missing, so this is no data set; `weft dataset make` writes it"));
  if (!json.ok()) return json.status();
  return ParseDataset(*json, path);
}

absl::Status CheckDatasetFrames(const v1::Dataset& dataset, const std::string& folder) {
  for (const v1::DatasetTake& take : dataset.takes()) {
    if (take.frames_hash().empty()) continue;
    const std::string path = FramesOf(folder, take.name());
    WEFT_ASSIGN_OR_RETURN(const std::string hash, HashOfFrames(path));
    if (hash != take.frames_hash())
      return absl::DataLossError(absl::StrCat(
          path, hash.empty() ? ": is missing" : ": is not the file that was made (its hash differs)",
          "; delete the folder of the take and make the data set again"));
    WEFT_ASSIGN_OR_RETURN(const FramesReader frames, FramesReader::Open(path));
    if (frames.head().template_hash != dataset.template_hash() || frames.frames() != take.frames())
      return absl::DataLossError(absl::StrCat(path, ": holds ", frames.frames(), " frames of template ",
                                              frames.head().template_hash, ", the data set says ",
                                              take.frames(), " of ", dataset.template_hash()));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<TakeFloor>> MeasureFloor(const v1::Dataset& dataset, const std::string& folder) {
  std::vector<TakeFloor> out;
  for (const v1::DatasetTake& chaos : dataset.takes()) {
    if (chaos.split() != NameOf(DatasetSplit::kChaos) || chaos.frames_hash().empty()) continue;
    const auto first = std::ranges::find_if(dataset.takes(), [&](const auto& take) {
      return take.split() != chaos.split() && take.motion() == chaos.motion() &&
             take.motion_seed() == chaos.motion_seed() && !take.frames_hash().empty();
    });
    if (first == dataset.takes().end()) continue;
    absl::StatusOr<FramesReader> a = FramesReader::Open(FramesOf(folder, first->name()));
    absl::StatusOr<FramesReader> b = FramesReader::Open(FramesOf(folder, chaos.name()));
    if (!a.ok()) return a.status();
    if (!b.ok()) return b.status();
    WEFT_ASSIGN_OR_RETURN(const Template garment,
                          ReadTemplate((fs::path(FolderOf(folder, first->name())) / "template").string()));
    ChaosFloor floor;
    for (int k = 0; k < std::min(a->frames(), b->frames()); ++k) {
      WEFT_ASSIGN_OR_RETURN(const ClothFrame at_a, a->Read(k));
      WEFT_ASSIGN_OR_RETURN(const ClothFrame at_b, b->Read(k));
      if (at_a.vertices_mm.size() != at_b.vertices_mm.size() ||
          at_a.vertices_mm.size() != garment.rest.vertices_mm.size())
        return absl::InvalidArgumentError(absl::StrCat(FolderOf(folder, chaos.name()), ": has ",
                                                       at_b.vertices_mm.size(), " vertices, ", first->name(),
                                                       " has ", at_a.vertices_mm.size()));
      floor.Add(1e-9 * static_cast<double>(at_a.time_ns), at_a.vertices_mm, at_b.vertices_mm,
                garment.rest.faces);
    }
    if (floor.frames() > 0)
      out.push_back({first->name(), floor.frames(), *floor.DistanceMm(), *floor.NormalsDeg(),
                     floor.ErrorJitterMm().value_or(ErrorSummary()).mean});
  }
  return out;
}

}  // namespace weft

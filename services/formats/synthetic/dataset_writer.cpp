#include "services/formats/synthetic/dataset_writer.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/synthetic/cloth_writer.h"
#include "services/formats/synthetic/dataset_file.h"
#include "services/formats/synthetic/take_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

std::string TableOf(const DatasetPreset& preset) {
  std::string out = "take,split,motion,seed,frames\n";
  for (const DatasetTake& take : preset.takes)
    absl::StrAppend(&out, take.Name(), ",", std::string(NameOf(take.split)), ",",
                    std::string(NameOf(take.motion)), ",", take.seed, ",", take.frames, "\n");
  return out;
}

std::string RecipeFor(const DatasetPreset& preset, const std::string& what) {
  return absl::StrCat("weft " WEFT_VERSION " dataset make ", std::string(preset.name), ": ", what);
}

// Another set's takes.csv is not overwritten.
absl::Status WriteTable(const DatasetPreset& preset, const std::string& out) {
  WEFT_RETURN_IF_ERROR(CreateFolders(out));
  const std::string path = (fs::path(out) / "takes.csv").string(), table = TableOf(preset);
  const absl::StatusOr<std::string> there = ReadWholeFile(path);
  if (there.ok() && *there == table) return absl::OkStatus();
  std::error_code error;
  if (there.ok() || !fs::is_empty(out, error))
    return absl::AlreadyExistsError(absl::StrCat(out, ": holds something else than the data set ",
                                                 std::string(preset.name), "; choose another folder"));
  return WriteFileAtomically(path, table);
}

// The garment is put on in a take of its own, which ends after its first frame: all begin in the same pose.
absl::Status PutOn(const DatasetPreset& preset, const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const TakeFolder take,
                        TakeFolder::Open(folder, RecipeFor(preset, "the garment, put on")));
  if (PathExists(take.FramesFile() + ".state")) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(SyntheticTakeOptions options, OptionsOf(preset, preset.takes.front()));
  std::stop_source after_one;
  const absl::Status status =
      WriteClothTake(
          options, take, {}, [&](int) { after_one.request_stop(); }, after_one.get_token())
          .status();
  return absl::IsCancelled(status) ? absl::OkStatus() : status;
}

// What was put on is where a new take begins.
absl::Status BeginWith(const std::string& dressed, const TakeFolder& take) {
  std::error_code error;
  if (fs::exists(take.FramesFile() + ".part", error)) return absl::OkStatus();
  for (const fs::directory_entry& entry : fs::directory_iterator(dressed, error)) {
    if (entry.path().filename() == "truth" || entry.path().filename() == "recipe.txt") continue;
    fs::copy(entry.path(), fs::path(take.path()) / entry.path().filename(),
             fs::copy_options::recursive | fs::copy_options::overwrite_existing, error);
    if (error) break;
  }
  // The state comes last: a take without it begins anew.
  const std::string from = (fs::path(dressed) / "truth" / "frames.bin").string();
  for (const char* part : {".part", ".state"})
    if (!error)
      fs::copy_file(from + part, take.FramesFile() + part, fs::copy_options::overwrite_existing, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(take.path(), ": the dressed garment cannot be copied from ",
                                             dressed, " (", error.message(), ")"));
}

}  // namespace

absl::StatusOr<DatasetSummary> MakeDataset(
    const DatasetPreset& preset, const std::string& out, double minutes,
    const std::function<void(const std::string& take, int done, int frames)>& on_frame,
    const std::stop_token& stop) {
  absl::Status status = CheckSplits(preset.takes);
  if (status.ok()) status = WriteTable(preset, out);
  const std::string dressed = (fs::path(out) / "dressed").string();
  const Stopwatch watch;
  if (status.ok()) status = PutOn(preset, dressed);
  if (!status.ok()) return status;
  std::stop_source over;
  const std::stop_callback on_stop(stop, [&] { over.request_stop(); });
  absl::Status broken;
  DatasetSummary summary;
  summary.takes = static_cast<int>(preset.takes.size());
  for (const DatasetTake& spec : preset.takes) {
    const std::string name = spec.Name(), folder = (fs::path(out) / "takes" / name).string();
    if (over.stop_requested() && !PathExists(folder)) continue;
    const absl::StatusOr<TakeFolder> take = TakeFolder::Open(folder, RecipeFor(preset, name));
    if (absl::IsUnavailable(take.status())) {
      ++summary.elsewhere;
      continue;
    }
    if (!take.ok()) return take.status();
    if (!take->IsComplete()) {
      if (over.stop_requested()) continue;
      const absl::StatusOr<SyntheticTakeOptions> options = OptionsOf(preset, spec);
      status = options.status();
      if (status.ok()) status = BeginWith(dressed, *take);
      if (!status.ok()) return status;
      const auto after_frame = [&](int done) {
        if (on_frame) on_frame(name, done, spec.frames);
        if (minutes <= 0 || watch.Seconds() < 60 * minutes) return;
        summary.is_late = true;
        over.request_stop();
      };
      status = WriteClothTake(*options, *take, {}, after_frame, over.get_token()).status();
      if (absl::IsCancelled(status) && summary.is_late) continue;
      if (absl::IsInternal(status)) {
        // The others can still be made.
        if (broken.ok())
          broken = absl::InternalError(absl::StrCat(name, ": ", std::string(status.message())));
        continue;
      }
      if (!status.ok()) return status;
    }
    ++summary.complete;
    summary.frames += spec.frames;
  }
  WEFT_RETURN_IF_ERROR(WriteDatasetFile(preset, out));
  if (!broken.ok()) return broken;
  return summary;
}

}  // namespace weft

// weft dataset: takes for training and testing.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/stopwatch.h"
#include "services/formats/synthetic/dataset_file.h"
#include "services/formats/synthetic/dataset_writer.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/progress.h"

namespace weft {
namespace {

struct DatasetMakeOptions {
  std::string name;
  std::string out;
  double minutes = 0;
  int threads = 0;
};

absl::Status MakeDatasetFolder(const DatasetMakeOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const DatasetPreset preset, DatasetPresetNamed(options.name));
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  options.threads > 0
                                      ? static_cast<size_t>(options.threads)
                                      : static_cast<size_t>(tbb::info::default_concurrency()));
  const StopOnSignal stop;  // before the first thread
  const Stopwatch watch;
  const absl::StatusOr<DatasetSummary> summary = WithStageBars(quiet, options.threads, [&](StageBars& bars) {
    const auto tell = [&bars](const std::string& take, int done, int frames) {
      bars.Set(take, static_cast<uint64_t>(done), static_cast<uint64_t>(frames));
    };
    return MakeDataset(preset, options.out, options.minutes, tell, stop.token());
  });
  if (!summary.ok()) return summary.status();
  std::printf("%s: %d of %d takes are complete, %d frames; %.1f s\n", options.out.c_str(), summary->complete,
              summary->takes, summary->frames, watch.Seconds());
  if (summary->elsewhere > 0) std::printf("other processes work on %d takes\n", summary->elsewhere);
  if (summary->is_late) std::printf("the time is over; the same command goes on\n");
  return absl::OkStatus();
}

std::string DatasetsText() {
  std::string out = "Which set:";
  for (const DatasetPreset& preset : DatasetPresets())
    absl::StrAppend(&out, "\n", std::string(preset.name), ": ", std::string(preset.about));
  return out;
}

absl::Status ListDataset(const std::string& name) {
  WEFT_ASSIGN_OR_RETURN(const DatasetPreset preset, DatasetPresetNamed(name));
  std::printf("%-26s %-12s %-9s %6s\n", "take", "split", "motion", "frames");
  for (const DatasetTake& take : preset.takes)
    std::printf("%-26s %-12s %-9s %6d\n", take.Name().c_str(), std::string(NameOf(take.split)).c_str(),
                std::string(NameOf(take.motion)).c_str(), take.frames);
  return absl::OkStatus();
}

void PrintFloor(const std::vector<TakeFloor>& floor) {
  if (floor.empty()) {
    std::printf("chaos floor: not known before a take of the split chaos is complete\n");
    return;
  }
  std::printf(
      "chaos floor: the same motion once more with a shorter time step, after the first half second\n");
  std::printf("%-26s %6s %9s %9s %9s %14s %11s\n", "take", "frames", "mean mm", "median", "at 95 %",
              "normals deg", "jitter mm");
  for (const TakeFloor& take : floor)
    std::printf("%-26s %6d %9.3f %9.3f %9.3f %14.2f %11.3f\n", take.take.c_str(), take.frames,
                take.distance_mm.mean, take.distance_mm.median, take.distance_mm.p95, take.normals_deg.mean,
                take.error_jitter_mm);
}

absl::Status ShowDataset(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const v1::Dataset dataset, ReadDatasetFile(folder));
  WEFT_ASSIGN_OR_RETURN(const std::vector<TakeFloor> floor, MeasureFloor(dataset, folder));
  std::printf("%s: %s, made by %s, %d vertices of %g mm cells, %g frames a second, template %s\n",
              folder.c_str(), dataset.name().c_str(), dataset.made_by().c_str(), dataset.vertices(),
              dataset.cell_mm(), dataset.fps(), dataset.template_hash().c_str());
  struct Count {
    int takes = 0, complete = 0, frames = 0;
    std::set<std::string> motions;
  };
  std::map<std::string, Count> splits;
  for (const v1::DatasetTake& take : dataset.takes()) {
    Count& count = splits[take.split()];
    ++count.takes;
    count.motions.insert(take.motion());
    if (take.frames_hash().empty()) continue;
    ++count.complete;
    count.frames += take.frames();
  }
  for (const auto& [split, count] : splits)
    std::printf("%-12s %d of %d takes are complete, %d frames: %s\n", split.c_str(), count.complete,
                count.takes, count.frames, absl::StrJoin(count.motions, ", ").c_str());
  PrintFloor(floor);
  return absl::OkStatus();
}

absl::Status CheckDataset(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const v1::Dataset dataset, ReadDatasetFile(folder));
  WEFT_RETURN_IF_ERROR(CheckDatasetFrames(dataset, folder));
  std::printf("%s: all complete takes are as they were made, and no test leaks into training\n",
              folder.c_str());
  return absl::OkStatus();
}

void AddFolderCommand(CLI::App& dataset, CommandLine& line, const std::string& name, const std::string& about,
                      absl::Status (*run)(const std::string&)) {
  const auto [command, folder] =
      AddCommand<std::string>(dataset, line, run, name, about, "  weft dataset " + name + " shirt-drive");
  AddRequired(*command, "folder DIR", *folder, "The folder of the set");
}

}  // namespace

void AddDatasetCommand(CLI::App& app, CommandLine& line) {
  CLI::App* dataset = AddGroup(
      app, "dataset",
      "Sets of simulated takes without pictures, for training and testing: who moves how, split by motion.",
      "  weft dataset list shirt-drive\n"
      "  weft dataset make shirt-drive --out shirt-drive --minutes 20\n"
      "  weft dataset info shirt-drive");

  const auto [make, options] = AddCommand<DatasetMakeOptions>(
      *dataset, line, MakeDatasetFolder, "make",
      "Make a set, or go on with it. Several processes may work on one folder.",
      "  weft dataset make shirt-drive --threads 1 --out shirt-drive");
  AddRequired(*make, "set NAME", options->name, DatasetsText());
  AddRequired(*make, "--out DIR", options->out, "The folder of the set");
  AddOption(*make, "--minutes MIN", options->minutes, "Stop after this time; 0 for none",
            CLI::Range(0.0, 1e6));
  AddOption(*make, "--threads N", options->threads, "Threads to use; 0 for all", CLI::Range(0, 4096));

  const auto [list, name] = AddCommand<std::string>(
      *dataset, line, ListDataset, "list", "List the takes of a set.", "  weft dataset list shirt-drive");
  AddRequired(*list, "set NAME", *name, DatasetsText());

  AddFolderCommand(*dataset, line, "info",
                   "Show what a set holds, and its chaos floor: how far two simulations of one motion come "
                   "apart, which no method that knows the motion alone can be expected to undercut.",
                   ShowDataset);
  AddFolderCommand(
      *dataset, line, "check",
      "Compare all complete takes with the hashes of dataset.json, and its splits with the rules.",
      CheckDataset);
  AddDatasetMeshesCommand(*dataset, line);
}

}  // namespace weft

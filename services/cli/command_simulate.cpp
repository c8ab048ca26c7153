// weft simulate: a synthetic take with ground truth.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/cli/commands.h"
#include "services/cli/progress.h"
#include "services/pipeline/stop_on_signal.h"
#include "services/synthetic/take_writer.h"

namespace weft {
namespace {

struct SimulateOptions {
  std::string preset = "quickstart";
  std::string out;
  int frames = 0;
  uint64_t seed = 1;
  int threads = 0;
};

absl::Status Simulate(const SimulateOptions& options, bool quiet) {
  // Before the work of minutes, not after it.
  std::error_code error;
  if (std::filesystem::exists(options.out, error) && !std::filesystem::is_empty(options.out, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat(options.out, ": exists and is not an empty folder; remove it or choose another"));
  }
  absl::StatusOr<SyntheticTakeOptions> setup = SyntheticPreset(options.preset, options.seed);
  if (!setup.ok()) return setup.status();
  if (options.frames > 0) setup->motion.frames = options.frames;
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  options.threads > 0
                                      ? static_cast<size_t>(options.threads)
                                      : static_cast<size_t>(tbb::info::default_concurrency()));

  const auto start = std::chrono::steady_clock::now();
  const bool visible = ProgressVisible(quiet);
  std::optional<absl::StatusOr<SyntheticTake>> take;
  {
    Progress progress("cloth ", static_cast<uint64_t>(setup->motion.frames), visible);
    take = SyntheticTake::Make(*setup, [&progress](int) { progress.Advance(); });
  }
  if (!take->ok()) return take->status();
  const StopOnSignal stop;  // from here on there is something to clear away
  absl::StatusOr<TakeSummary> summary;
  {
    const uint64_t views = static_cast<uint64_t>((*take)->frames()) * (*take)->rig().cameras.size();
    Progress progress("render", views, visible);
    summary = WriteSyntheticTake(
        **take, options.out, [&progress] { progress.Advance(); }, stop.token());
  }
  if (!summary.ok()) return summary.status();
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf(
      "%s: %d frames, %d cameras, %d cells; %.0f cells in good sight a view, %.1f px a cell in the median; "
      "%.1f s\n",
      options.out.c_str(), summary->frames, summary->cameras, summary->cells, summary->scoreable_per_view,
      summary->median_pitch_px, took_s);
  return absl::OkStatus();
}

}  // namespace

void AddSimulateCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "simulate",
      "Film a synthetic garment: a printed cloth in motion before calibrated cameras, with ground truth. The "
      "folder is a dump that `weft register` takes, with its rig, board and template beside it.",
      "  weft simulate --preset quickstart --out take\n"
      "  weft register take --rig take/rig.json --board take/board.json --template take/template --out "
      "result --observations\n"
      "  weft evaluate result --truth take/truth");
  auto options = std::make_shared<SimulateOptions>();
  command
      ->add_option("--preset", options->preset,
                   absl::StrCat("What to film: ", absl::StrJoin(SyntheticPresetNames(), ", ")))
      ->type_name("NAME");
  command->add_option("--out", options->out, "The folder to write; it must not exist yet or be empty")
      ->required()
      ->type_name("DIR");
  command->add_option("--frames", options->frames, "Number of frames; 0 for the preset's own")
      ->type_name("N")
      ->check(CLI::Range(0, 10000));
  command
      ->add_option("--seed", options->seed,
                   "Everything random follows from it: board, rig, motion, noise. The same seed gives the "
                   "same files")
      ->type_name("S");
  command->add_option("--threads", options->threads, "Threads to use; 0 for all")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
  command->callback(
      [options, &line] { line.run = [options, &line] { return Simulate(*options, line.quiet); }; });
}

}  // namespace weft

// weft simulate: a synthetic take with ground truth.
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/stopwatch.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/figure/motion_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/synthetic/cloth_writer.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/progress.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

struct SimulateOptions {
  std::string preset = "quickstart";
  std::string out;
  std::string rig;
  std::string motion_file;  // instead of a named motion
  std::string body_file;    // instead of the average one
  bool no_pictures = false;
  uint64_t seed = 1;
  int threads = 0;
  TakeFileOptions files;
  // What the arguments change in the preset, in their order, and how they read.
  std::vector<std::function<void(SyntheticTakeOptions&)>> changes;
  std::string changes_text;
};

constexpr std::array kNamedMotions = {PerformanceMotion::kBreathing, PerformanceMotion::kTwist,
                                      PerformanceMotion::kJogging, PerformanceMotion::kPinch,
                                      PerformanceMotion::kTwistAndPinch};

// A file of `weft motion`.
absl::Status SetMotion(const std::string& path, PerformanceOptions& performance) {
  if (path.empty()) return absl::OkStatus();
  absl::StatusOr<Motion> clip = ReadMotion(path);
  if (absl::IsNotFound(clip.status())) {
    std::string names;
    for (const PerformanceMotion m : kNamedMotions) absl::StrAppend(&names, std::string(NameOf(m)), ", ");
    return absl::InvalidArgumentError(
        absl::StrCat("--motion: \"", path, "\" is none of ", names, "and no file of `weft motion make`"));
  }
  if (!clip.ok()) return clip.status();
  performance.clip = std::make_shared<const Motion>(*std::move(clip));
  return absl::OkStatus();
}

absl::StatusOr<SyntheticTakeOptions> SetUp(const SimulateOptions& options) {
  WEFT_ASSIGN_OR_RETURN(SyntheticTakeOptions setup, SyntheticPreset(options.preset, options.seed));
  WEFT_RETURN_IF_ERROR(SetMotion(options.motion_file, setup.performance));
  if (!options.body_file.empty()) {
    WEFT_ASSIGN_OR_RETURN(const NamedBody body, ReadBody(options.body_file));
    setup.performance.body = body.shape;
  }
  if (!options.rig.empty()) {
    WEFT_ASSIGN_OR_RETURN(setup.given_rig, ReadRig(options.rig));
  }
  for (const auto& change : options.changes) change(setup);
  absl::Status status = setup.Validate();
  status.Update(options.files.Validate(setup.camera.sensor.bits));
  if (!status.ok()) return status;
  return setup;
}

// All that the files follow from. Threads are not part of it.
std::string RecipeOf(const SimulateOptions& options, const SyntheticTakeOptions& setup) {
  std::string out =
      absl::StrCat("weft " WEFT_VERSION " simulate --preset ", options.preset, " --seed ", options.seed,
                   options.changes_text, " --image-format ", options.files.image_ending);
  if (options.files.image_ending == "jpg")
    absl::StrAppend(&out, " --jpeg-quality ", options.files.jpeg_quality);
  if (setup.given_rig) absl::StrAppend(&out, " rig ", setup.given_rig->ContentHash());
  if (setup.performance.clip) absl::StrAppend(&out, " motion ", MotionHash(*setup.performance.clip));
  if (setup.performance.body != BodyShape())
    absl::StrAppend(&out, " body ", BodyHash(setup.performance.body));
  if (options.no_pictures) absl::StrAppend(&out, " --no-pictures");
  return out;
}

// Nothing is half-written yet, so there is nothing to clear away.
void ShowCloth(double share, StageBars& bars, const std::stop_token& stop) {
  if (stop.stop_requested()) kill(getpid(), SIGINT);
  bars.SetShare("cloth ", share);
}

// Takes without pictures.
absl::Status SimulateCloth(const std::string& out, const SyntheticTakeOptions& setup,
                           const TakeFolder& folder, bool quiet, const std::stop_token& stop) {
  const Stopwatch watch;
  const auto work = [&](StageBars& bars) {
    const auto frames = static_cast<uint64_t>(setup.performance.frames);
    return WriteClothTake(
        setup, folder, [&](double share) { ShowCloth(share, bars, stop); },
        [&](int done) { bars.Set("motion", static_cast<uint64_t>(done), frames); }, stop);
  };
  const absl::StatusOr<ClothSummary> summary = WithStageBars(quiet, 0, work);
  if (!summary.ok()) return summary.status();
  const int made = summary->frames - summary->resumed_at;
  std::printf("%s: %d frames of %d vertices, %.1f KiB a frame; %d frames made now in %.1f s\n", out.c_str(),
              summary->frames, summary->vertices, static_cast<double>(summary->bytes_per_frame) / 1024, made,
              watch.Seconds());
  if (summary->intersecting_frames == 0)
    std::printf("none of these frames has self-intersections\n");
  else
    std::printf("%d of these frames have self-intersections\n", summary->intersecting_frames);
  return absl::OkStatus();
}

absl::Status Simulate(const SimulateOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const SyntheticTakeOptions setup, SetUp(options));
  WEFT_ASSIGN_OR_RETURN(const TakeFolder folder, TakeFolder::Open(options.out, RecipeOf(options, setup)));
  if (folder.IsComplete()) {
    std::printf("%s: is complete, all %d frames\n", options.out.c_str(), setup.performance.frames);
    return absl::OkStatus();
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  options.threads > 0
                                      ? static_cast<size_t>(options.threads)
                                      : static_cast<size_t>(tbb::info::default_concurrency()));

  const StopOnSignal stop;  // before the first thread
  if (options.no_pictures) return SimulateCloth(options.out, setup, folder, quiet, stop.token());
  const Stopwatch watch;
  std::optional<absl::StatusOr<SyntheticTake>> take;
  {
    StageBars bars(quiet);
    take = SyntheticTake::Make(setup, [&](double share) { ShowCloth(share, bars, stop.token()); });
  }
  if (!take->ok()) return take->status();
  absl::StatusOr<TakeSummary> summary;
  {
    const uint64_t views = static_cast<uint64_t>((*take)->frames()) * (*take)->rig().cameras.size();
    Progress progress("render", views, ProgressVisible(quiet));
    summary = WriteSyntheticTake(
        **take, folder, options.files, [&progress] { progress.Advance(); }, stop.token());
  }
  if (!summary.ok()) return summary.status();
  std::printf(
      "%s: %d frames, %d cameras, %d cells; %.0f cells in good sight a view, %.1f px a cell in the median; "
      "%.1f s\n",
      options.out.c_str(), summary->frames, summary->cameras, summary->cells, summary->scoreable_per_view,
      summary->median_pitch_px, watch.Seconds());
  if (summary->intersecting_frames == 0)
    std::printf("no frame has self-intersections\n");
  else
    std::printf("%d frames have self-intersections\n", summary->intersecting_frames);
  if (summary->lost_pictures > 0) std::printf("%d pictures lost on request\n", summary->lost_pictures);
  return absl::OkStatus();
}

// Declares options that change the preset.
class Changes {
 public:
  Changes(CLI::App& command, std::shared_ptr<SimulateOptions> options)
      : command_(command), options_(std::move(options)) {}

  template <typename Value, typename Change>
  CLI::Option* Add(const std::string& name, const std::string& unit, const std::string& about,
                   Change change) {
    const std::function<void(const Value&)> note = [options = options_, name, change](const Value& value) {
      absl::StrAppend(&options->changes_text, " ", name, " ", value);
      options->changes.push_back([change, value](SyntheticTakeOptions& o) { change(o, value); });
    };
    return command_.add_option_function<Value>(name, note, about)->type_name(unit)->group(group_);
  }
  template <typename Enum>
  void AddChoice(const std::string& name, const std::string& about,
                 const std::vector<std::pair<std::string, Enum>>& choices,
                 const std::function<void(SyntheticTakeOptions&, Enum)>& change) {
    std::vector<std::string> names;
    for (const auto& choice : choices) names.push_back(choice.first);
    Add<std::string>(name, "NAME", about,
                     [choices, change](SyntheticTakeOptions& o, const std::string& given) {
                       for (const auto& [choice, value] : choices)
                         if (choice == given) change(o, value);
                     })
        ->check(OneOf(names));
  }
  // A named motion, or a file of one.
  void AddMotion() {
    const std::function<void(const std::string&)> note = [options = options_](const std::string& given) {
      for (const PerformanceMotion m : kNamedMotions) {
        if (NameOf(m) != given) continue;
        absl::StrAppend(&options->changes_text, " --motion ", given);
        options->changes.push_back([m](SyntheticTakeOptions& o) { o.performance.motion = m; });
        return;
      }
      options->motion_file = given;
    };
    command_
        .add_option_function<std::string>("--motion", note,
                                          "What the person in the garment does: breathing, twist, jogging, "
                                          "pinch, twist-and-pinch, or a file of `weft motion make`")
        ->type_name("NAME|FILE")
        ->group(group_);
  }
  void Group(const std::string& group) { group_ = group; }

 private:
  CLI::App& command_;
  std::shared_ptr<SimulateOptions> options_;
  std::string group_;
};

using Take = SyntheticTakeOptions;

void AddPerformanceOptions(Changes& changes) {
  changes.Group("Garment and motion");
  std::vector<std::pair<std::string, GarmentKind>> garments;
  for (const GarmentKind k : {GarmentKind::kSheet, GarmentKind::kTube, GarmentKind::kSkirt,
                              GarmentKind::kTShirt, GarmentKind::kPleatedSkirt, GarmentKind::kGatheredSkirt,
                              GarmentKind::kCurlingSheet, GarmentKind::kShirtAndSkirt})
    garments.emplace_back(NameOf(k), k);
  changes.AddChoice<GarmentKind>("--garment", "What is filmed", garments,
                                 [](Take& o, GarmentKind k) { o.performance.garment = k; });
  changes.Add<std::string>(
      "--show", "NAME", "Of several garments worn together, the one that is filmed; the others move unseen",
      [](Take& o, const std::string& v) { o.show = v; });
  changes.AddMotion();
  changes.Add<double>("--cell-mm", "MM", "Pitch of the printed cells; the number of cells follows",
                      [](Take& o, double v) { o.performance.cell_mm = v; });
  changes
      .Add<int>("--frames", "N", "Number of frames; 0 for the preset's own",
                [](Take& o, int v) {
                  if (v > 0) o.performance.frames = v;
                })
      ->check(CLI::Range(0, 100000));
  changes.Add<double>("--fps", "HZ", "Frames per second", [](Take& o, double v) { o.performance.fps = v; });
}

void AddRigOptions(Changes& changes) {
  changes.Group("Cameras");
  changes.Add<int>("--cameras", "N", "Number of cameras around the garment",
                   [](Take& o, int v) { o.rig.cameras = v; });
  changes.Add<int>("--width-px", "PX", "Width of the pictures", [](Take& o, int v) { o.rig.width_px = v; });
  changes.Add<int>("--height-px", "PX", "Height of the pictures",
                   [](Take& o, int v) { o.rig.height_px = v; });
  changes.Add<double>(
      "--crop-margin-mm", "MM",
      "With --rig: crop the pictures to the garment of the first frame and this much around it",
      [](Take& o, double v) { o.crop_margin_mm = v; });
}

void AddLensOptions(Changes& changes) {
  changes.Group("Lens and shutter");
  changes.Add<double>("--blur-px", "SIGMA", "Point spread of the lens, Gaussian",
                      [](Take& o, double v) { o.camera.lens.point_spread_sigma_px = v; });
  changes.Add<double>("--f-number", "N", "Aperture, for defocus; 0 for everything in focus",
                      [](Take& o, double v) { o.camera.lens.f_number = v; });
  changes.Add<double>("--focus-mm", "MM", "Distance in focus; 0 for the middle of the garment",
                      [](Take& o, double v) { o.camera.lens.focus_distance_mm = v; });
  changes.Add<double>("--focus-error-mm", "MM", "Error of a camera's focus, up to this, each way",
                      [](Take& o, double v) { o.camera.lens.focus_error_mm = v; });
  changes.Add<double>("--vignetting", "SHARE", "Share of the light that the corners lose",
                      [](Take& o, double v) { o.camera.lens.vignetting = v; });
  changes.Add<double>("--exposure-ms", "MS", "Time that the shutter is open, for motion blur; 0 freezes",
                      [](Take& o, double v) { o.shutter.exposure_ms = v; });
  changes.Add<double>("--time-offset-ms", "MS", "A camera's trigger against the others, up to this, each way",
                      [](Take& o, double v) { o.shutter.time_offset_ms = v; });
  changes.Add<double>("--drop-rate", "SHARE", "Share of the pictures that are lost",
                      [](Take& o, double v) { o.shutter.drop_rate = v; });
}

void AddSensorOptions(Changes& changes) {
  changes.Group("Sensor");
  changes.AddChoice<Readout>(
      "--readout",
      "binned: each pixel is a quad of the Bayer mosaic; color: interpolated from it; mosaic: raw",
      {{"color", Readout::kColor}, {"mosaic", Readout::kMosaic}, {"binned", Readout::kBinned}},
      [](Take& o, Readout v) { o.camera.sensor.readout = v; });
  changes.Add<int>("--bits", "N", "Bits of a value, 8 to 12; more than 8 are stored as 16",
                   [](Take& o, int v) { o.camera.sensor.bits = v; });
  changes.Add<double>("--gain", "FACTOR", "Brightness of the pictures, relative to the preset",
                      [](Take& o, double v) { o.camera.sensor.exposure *= v; });
  changes.Add<double>("--gamma", "G", "Of the values; 1 for a linear camera",
                      [](Take& o, double v) { o.camera.sensor.gamma = v; });
  changes.Add<double>("--full-well", "ELECTRONS", "Electrons at white; photon noise follows",
                      [](Take& o, double v) { o.camera.sensor.full_well_electrons = v; });
  changes.Add<double>("--read-noise", "ELECTRONS", "Noise of the electronics",
                      [](Take& o, double v) { o.camera.sensor.read_noise_electrons = v; });
  changes.Add<double>("--sharpening", "SHARE", "Sharpening in the camera",
                      [](Take& o, double v) { o.camera.sensor.sharpening = v; });
  changes.Add<double>("--color-variation", "SIGMA", "Difference of the colours between cameras",
                      [](Take& o, double v) { o.camera.sensor.color_variation = v; });
  changes.Add<double>("--exposure-variation", "SIGMA", "Difference of the brightness between cameras",
                      [](Take& o, double v) { o.camera.sensor.exposure_variation = v; });
}

std::string PresetText() {
  std::string out = "What to film:";
  for (const TakePreset& p : TakePresets()) absl::StrAppend(&out, "\n", p.name, ": ", p.about);
  return out;
}

}  // namespace

void AddSimulateCommand(CLI::App& app, CommandLine& line) {
  const auto [command, options] = AddCommand<SimulateOptions>(
      app, line, Simulate, "simulate",
      "Film a synthetic garment: a printed cloth in motion before calibrated cameras, with ground truth. The "
      "folder is a dump that `weft register` takes, with its rig, board and template beside it.",
      "  weft simulate --preset quickstart --out take\n"
      "  weft register take --rig take/rig.json --board take/board.json --template take/template --out "
      "result --observations\n"
      "  weft evaluate result --truth take/truth");
  AddOption(*command, "--preset NAME", options->preset, PresetText());
  AddRequired(*command, "--out DIR", options->out,
              "The folder to write, new or empty; a take that was stopped is resumed when the same command "
              "is given again");
  AddOption(
      *command, "--rig FILE", options->rig,
      "Cameras to film with, e.g. of `weft rig import`; the garment hangs in their field of view, y is down");
  AddOption(*command, "--body FILE", options->body_file,
            "Who wears the T-shirt, a file of `weft body make`; without, an average person");
  AddOption(
      *command, "--seed S", options->seed,
      "Everything random follows from it: board, rig, motion, noise. The same seed gives the same files");
  command->add_flag("--no-pictures", options->no_pictures,
                    "The true cloth only, in truth/frames.bin: for training and for statistics of motion");
  AddOption(*command, "--threads N", options->threads, "Threads to use; 0 for all", CLI::Range(0, 4096));
  AddOption(*command, "--image-format NAME", options->files.image_ending, "png, jpg or tif");
  AddOption(*command, "--jpeg-quality Q", options->files.jpeg_quality, "Of jpg, 1 to 100");
  Changes changes(*command, options);
  AddPerformanceOptions(changes);
  AddRigOptions(changes);
  AddLensOptions(changes);
  AddSensorOptions(changes);
}

}  // namespace weft

#include "services/work/pipeline/stage_keys.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/file/checksum.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/frame_neighbors.h"

namespace weft {
namespace {

// Counts up when scans are read in another way: frames without a scan stay as they are. 2: points of no
// normal and normals that point inwards.
constexpr int kScanReading = 2;

// The effective options of each stage as text that differs where they do.
struct OptionTexts {
  std::string decode, triangulate, second_pass, align, refine;
  bool has_second_pass, refines;
};

OptionTexts TextsOf(const v1::RegistrationOptions& asked) {
  const v1::RegistrationOptions options = Canonical(asked);
  OptionTexts texts;
  const auto of = [&options](const char* stage) { return StageOptionsText(options.pipeline(), stage); };
  const std::string alignment = of("alignment");
  texts.has_second_pass = options.pipeline().second_pass().enabled();
  texts.refines = !options.frames_alone();
  texts.decode = absl::StrCat(of("decode"), "\nmosaic ", options.mosaic());
  texts.triangulate = of("triangulation");
  texts.align = absl::StrCat(alignment, "\nscans ", options.scans(), "\nstarts ", options.starts());
  if (!options.scans().empty()) absl::StrAppend(&texts.align, "\nscan reading ", kScanReading);
  // The mesh that predicts the cells has no options.
  texts.second_pass = of("second_pass");
  texts.refine = absl::StrCat(of("temporal"), "\n", alignment);  // they share the solver
  return texts;
}

// What the hash of a stage's inputs stands for.
const char* InputName(Stage stage) {
  switch (stage) {
    case Stage::kDecode:
      return "board";
    case Stage::kTriangulate:
      return "rig";
    default:
      return "template";
  }
}

// Of the same stage.
bool AreSame(const v1::StageKey& was, const v1::StageKey& now) {
  return was.version() == now.version() && was.inputs() == now.inputs() && was.options() == now.options();
}

std::string WhyDifferent(const v1::StageKey& was, const v1::StageKey& now, Stage stage) {
  if (was.inputs() != now.inputs() && !was.inputs().empty() && !now.inputs().empty()) {
    return absl::StrCat(now.stage(), " has another ", InputName(stage));
  }
  if (was.version() == 0) return absl::StrCat(now.stage(), " was not done");
  if (now.version() == 0) return absl::StrCat(now.stage(), " is not done any more");
  if (was.version() != now.version()) {
    return absl::StrCat(now.stage(), " has version ", now.version(), ", was ", was.version());
  }
  return absl::StrCat(now.stage(), " has other options");
}

}  // namespace

StageKeys KeysOf(const v1::InputHashes& inputs, const v1::RegistrationOptions& options) {
  const OptionTexts texts = TextsOf(options);
  StageKeys keys;
  const auto add = [&keys](Stage stage, bool is_done, const std::string& reads, const std::string& text) {
    v1::StageKey& key = *keys.Add();
    key.set_stage(StageName(stage));
    if (!is_done) return;
    key.set_version(AlgorithmVersion(stage));
    key.set_inputs(reads);
    key.set_options(HashOf(text));
  };
  add(Stage::kDecode, true, inputs.board(), texts.decode);
  add(Stage::kTriangulate, true, inputs.rig(), texts.triangulate);
  add(Stage::kSecondPass, texts.has_second_pass, inputs.garment(), texts.second_pass);
  add(Stage::kAlign, true, inputs.garment(), texts.align);
  add(Stage::kRefine, texts.refines, "", texts.refine);
  return keys;
}

v1::StageKey KeyOf(Stage stage, const v1::InputHashes& inputs, const v1::RegistrationOptions& options) {
  return KeysOf(inputs, options)[static_cast<int>(stage)];
}

std::string HashOf(const std::string& text) {
  return absl::StrFormat("%016x", Checksum(text.data(), text.size()));
}

bool AreEqual(const StageKeys& a, const StageKeys& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const v1::StageKey& x, const v1::StageKey& y) {
    return x.stage() == y.stage() && AreSame(x, y);
  });
}

std::optional<StageDifference> FirstDifference(const StageKeys& was, const StageKeys& now) {
  if (was.empty()) return StageDifference{Stage::kDecode, "it is of version 0.1.2 or before"};
  // A neighbour's report is read from its file and may be that of a driven frame.
  if (now.size() != kStages) return StageDifference{Stage::kDecode, "the other one is no registration"};
  for (int i = 0; i < kStages; ++i) {
    const Stage stage = static_cast<Stage>(i);
    if (i >= was.size() || was[i].stage() != now[i].stage()) {
      return StageDifference{stage,
                             absl::StrCat(now[i].stage(), " was not known to the version that wrote it")};
    }
    if (!AreSame(was[i], now[i])) return StageDifference{stage, WhyDifferent(was[i], now[i], stage)};
  }
  return std::nullopt;
}

std::string RedoneText(const std::string& from, const std::string& why) {
  std::string kept;
  if (from == StageName(Stage::kAlign)) kept = "; observations and cloud are kept";
  if (from == StageName(Stage::kRefine)) kept = "; observations, cloud and unrefined mesh are kept";
  return absl::StrCat("computed again from ", from, " on, since ", why, kept);
}

}  // namespace weft

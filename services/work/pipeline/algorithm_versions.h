// Versions of the algorithms: what tells results of different code apart.
#pragma once

namespace weft {

// In the order of their work. What a stage computes depends on those before it.
enum class Stage { kDecode, kTriangulate, kSecondPass, kAlign, kRefine };
inline constexpr int kStages = 5;

constexpr const char* StageName(Stage stage) {
  constexpr const char* kNames[kStages] = {"decode", "triangulate", "second_pass", "align", "refine"};
  return kNames[static_cast<int>(stage)];
}

// Whoever changes what a stage computes raises its version here, writes the new hashes with
// tests/system/algorithms_test.py --write, and adds a line to CHANGELOG.md. Results that were computed with
// another version are computed again from that stage on.
//
// The second pass looks where an alignment expects cells: its version also stands for what it sees of that.
constexpr int AlgorithmVersion(Stage stage) {
  constexpr int kVersions[kStages] = {
      7,  // decode
      5,  // triangulate
      8,  // second_pass
      4,  // align
      4,  // refine
  };
  return kVersions[static_cast<int>(stage)];
}

// The stages of the pipeline that a kind of work uses: its keys are made of them (stage_keys.h), and what
// computes a stage asks for it. So results of a stage that the key leaves out do not compile.
template <Stage... kUsed>
struct StageList {};

template <Stage kStage>
struct Computes {
  template <Stage... kUsed>
  requires((kUsed == kStage) || ...) constexpr Computes(StageList<kUsed...>) {
  }  // NOLINT: each list that has the stage will do
};

inline constexpr StageList<Stage::kDecode, Stage::kTriangulate, Stage::kSecondPass, Stage::kAlign,
                           Stage::kRefine>
    kAllStages;
// Of results that nobody takes up again, so that they have no key.
inline constexpr auto kNeverKept = kAllStages;

// Of driving by an avatar (services/work/animation): raised when the same inputs give other results, or their
// reports tell other things of the driver. Decoding has its own.
inline constexpr int kDriveVersion = 8;

}  // namespace weft

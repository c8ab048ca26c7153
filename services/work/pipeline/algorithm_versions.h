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

// Of driving by an avatar (services/work/animation): raised when the same inputs give other results, or their
// reports tell other things of the driver. Decoding has its own.
inline constexpr int kDriveVersion = 8;

}  // namespace weft

// The training of an avatar's net.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "learning/sample_file.h"

namespace weft::learning {

struct NetTraining {
  double minutes = 60;
  int64_t steps = 0;  // 0: as many as the minutes allow
  int batch = 8;
  double rate = 1e-3;
  std::vector<int64_t> widths = {16, 32, 48, 64};
  uint64_t seed = 1;
  // File that is written every few minutes and when the training is stopped; one that is there is gone on
  // from. Empty: none.
  std::string checkpoint;
};

// Mean distance from the truth over the panels, of the mesh that the net was told of and of the one that it
// made.
struct HeldOutScore {
  Split split = Split::kValidate;
  int cameras = 0;
  double before_mm = 0, after_mm = 0;
};

struct NetProgress {
  double minutes = 0;
  int64_t step = 0;
  double loss = 0;  // mean since the last report
  std::vector<HeldOutScore> scores;
};

struct TrainedNet {
  bool is_finished = false;  // not so when it was stopped; the rest is empty then
  std::string onnx;
  // "weftnet1", then a random image and the net's answer to it: three u32 for channels, height and width,
  // floats.
  std::string sample;
};

// AdamW, the rate falling as a cosine. `on_progress` is called before the
// first step, about once a minute, and at the end. The same bytes for the same file, options (with steps
// instead of minutes), machine and number of threads. Throws std::runtime_error for a file without samples to
// learn from.
TrainedNet TrainNet(const SampleFile& file, const NetTraining& training,
                    const std::function<void(const NetProgress&)>& on_progress,
                    const std::function<bool()>& stopped);

}  // namespace weft::learning

// The training of an avatar's net.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "learning/sample_file.h"

namespace weft::learning {

// What a net learns.
enum class NetLoss {
  // Huber's of the offsets, and the deviation that they leave as an answer more.
  kOffsetsAndDeviation,
  // Squared distances of vertices and of normals (Halimi et al. 2022, section 6.3). Of the samples' features
  // the last kTangents are the tangents of the mesh along and down the atlas, which the net is not told.
  kVerticesAndNormals,
};
inline constexpr int kTangents = 6;

struct NetTraining {
  NetLoss loss = NetLoss::kOffsetsAndDeviation;
  int64_t steps = 8000;
  double minutes = 0;  // it ends after these at the latest, earlier runs included; 0: it takes its time
  int batch = 4;
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
  int cameras = 0, samples = 0;
  double before_mm = 0, after_mm = 0;
};

struct NetProgress {
  double share = 0;  // of the training
  double minutes = 0;
  int64_t step = 0;
  double loss = 0;                   // mean since the last report
  std::vector<HeldOutScore> scores;  // now and then
};

struct TrainedNet {
  bool is_finished = false;  // not so when it was stopped; the rest is empty then
  int64_t steps = 0;         // fewer than asked for where the time ended first
  std::string onnx;
  // "weftnet1", then a random image and the net's answer to it: three u32 for channels, height and width,
  // floats.
  std::string sample;
};

// AdamW, the rate falling as a cosine of the steps, or of the time where that ends sooner. `on_progress` is
// called every few seconds; before the first step, about once a minute, and at the end with scores. The same
// bytes for the same file, options without minutes, machine and number of threads, also when it is stopped
// and goes on. Throws std::runtime_error for a file without samples to learn from.
TrainedNet TrainNet(const SampleFile& file, const NetTraining& training,
                    const std::function<void(const NetProgress&)>& on_progress,
                    const std::function<bool()>& stopped);

}  // namespace weft::learning

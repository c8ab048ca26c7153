// The training of an avatar's net.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "learning/sample_file.h"
#include "learning/training_loop.h"

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
  TrainingOptions options;
  NetLoss loss = NetLoss::kOffsetsAndDeviation;
  std::vector<int64_t> widths = {16, 32, 48, 64};
};

// Its files: "net.onnx", and "sample.bin": "weftnet1", then a random image and the net's answer to it: three
// u32 for channels, height and width, floats. Scores are over the panels, of the mesh that the net was told
// of and of the one that it made, by the number of cameras.
inline constexpr char kNetFile[] = "net.onnx", kNetSampleFile[] = "sample.bin";

// `file` must outlive it. Throws std::runtime_error for a file without samples to learn from.
std::unique_ptr<Learner> MakeNetLearner(const SampleFile& file, const NetTraining& training);

}  // namespace weft::learning

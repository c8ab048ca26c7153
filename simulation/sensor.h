// From the light on a sensor to the numbers of a picture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/image/frame.h"
#include "simulation/lens.h"

namespace weft {

// kBinned: a pixel is a quad of the Bayer mosaic and measures all three colours, as in cameras that are
// read out at half their resolution. kColor: the mosaic is interpolated (Malvar et al. 2004, linear, 5 x
// 5). kMosaic: raw.
enum class Readout { kBinned, kColor, kMosaic };

struct SensorOptions {
  Readout readout = Readout::kBinned;
  PixelFormat mosaic = PixelFormat::kBayerRg8;  // order of the colours
  int bits = 8;                                 // of a value, 8 to 12
  double exposure = 1.35;                       // linear value 1 / exposure is white
  double gamma = 2.2;                           // of the values; 1 for a linear camera
  double full_well_electrons = 20000;           // electrons at white; photon noise follows
  double read_noise_electrons = 14;
  bool noise = true;
  double exposure_variation = 0;  // standard deviation of a camera's exposure, relative
  double color_variation = 0;     // the same for the entries of its colour matrix around the identity
  double sharpening = 0;          // share of the difference from a blur of 1 px that the camera adds
  uint64_t seed = 1;              // of noise and variation; camera and frame are mixed in

  absl::Status Validate() const;
};

// Values of a picture, [height][width][channels], 0 to 2^bits - 1.
struct Picture {
  std::string camera_id;
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  std::optional<PixelFormat> mosaic;  // set for a raw picture, which has one channel; else three
  std::vector<uint16_t> values;

  int channels() const { return mosaic ? 1 : 3; }
};

// Colour response, exposure, photon and read noise, mosaic, sharpening, gamma, bits, in this order. The noise
// of a pixel depends on seed, camera id, frame number and place only. Parallel over rows in the calling
// thread's TBB arena.
Picture DevelopImage(const LinearImage& image, const SensorOptions& options, const std::string& camera_id,
                     int64_t frame_number);

// With 8 bits a channel; more are scaled down.
Frame ToFrame(const Picture& picture);

}  // namespace weft

#include "simulation/renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

// Pictures are traced in blocks of 4 x 4 pixels, one packet of rays each. Rays are exact at the corners of
// the blocks and interpolated between them: with real lenses that is within a thousandth of a pixel.
constexpr int kBlock_px = 4;
static_assert(kBlock_px * kBlock_px == RayScene::kPacket);

// Undistorted points (plane z = 1) at the corners of all blocks, NaN where the lens model has no inverse.
struct LensGrid {
  int cols = 0;
  std::vector<Eigen::Vector2f> points;

  LensGrid(const CameraModel& camera, int blocks_x, int blocks_y) : cols(blocks_x + 1) {
    points.resize(static_cast<size_t>(cols) * (blocks_y + 1));
    tbb::parallel_for(tbb::blocked_range<int>(0, blocks_y + 1), [&](const auto& range) {
      for (int j = range.begin(); j < range.end(); ++j)
        for (int i = 0; i < cols; ++i) {
          const auto p = camera.Undistort({i * kBlock_px - 0.5, j * kBlock_px - 0.5});
          points[static_cast<size_t>(j) * cols + i] =
              p ? Eigen::Vector2f(p->cast<float>())
                : Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
        }
    });
  }
  const Eigen::Vector2f& at(int i, int j) const { return points[static_cast<size_t>(j) * cols + i]; }
};

// Light of one block, summed over its sub-pixel samples.
void TraceBlock(const StudioScene& scene, const CameraModel& camera, const LensGrid& lens, int bx, int by,
                int samples_per_axis, std::array<Eigen::Vector3f, RayScene::kPacket>* sums) {
  const Eigen::Matrix3f world_from_camera = camera.rotation.transpose().cast<float>();
  const Eigen::Vector3f origin = camera.CenterWorld().cast<float>();
  const Eigen::Vector2f p00 = lens.at(bx, by), p10 = lens.at(bx + 1, by), p01 = lens.at(bx, by + 1),
                        p11 = lens.at(bx + 1, by + 1);
  sums->fill(Eigen::Vector3f::Zero());
  RayScene::Directions directions;
  std::array<RayHit, RayScene::kPacket> hits;
  for (int s = 0; s < samples_per_axis * samples_per_axis; ++s) {
    const float sx = (static_cast<float>(s % samples_per_axis) + 0.5f) / static_cast<float>(samples_per_axis);
    const float sy = (static_cast<float>(s / samples_per_axis) + 0.5f) / static_cast<float>(samples_per_axis);
    for (int k = 0; k < RayScene::kPacket; ++k) {
      const float u = (static_cast<float>(k % kBlock_px) + sx) / kBlock_px;
      const float v = (static_cast<float>(k / kBlock_px) + sy) / kBlock_px;
      const Eigen::Vector2f p = (1 - v) * ((1 - u) * p00 + u * p10) + v * ((1 - u) * p01 + u * p11);
      directions[k] = world_from_camera * Eigen::Vector3f(p.x(), p.y(), 1);
    }
    scene.rays().CastPacket(origin, directions, &hits);
    for (int k = 0; k < RayScene::kPacket; ++k) {
      const bool known = !std::isnan(directions[k].x());
      (*sums)[k] += scene.Radiance(hits[k], known ? directions[k] : world_from_camera.col(2));
    }
  }
}

std::vector<float> GaussianKernel(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<double> weights(2 * radius + 1);
  double sum = 0;
  for (int i = -radius; i <= radius; ++i)
    sum += weights[i + radius] = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
  std::vector<float> out;
  out.reserve(weights.size());
  for (const double w : weights) out.push_back(static_cast<float>(w / sum));
  return out;
}

// One axis of the blur: `out` row y is the weighted sum over taps of `in` at (x, y) + tap * (step_x, step_y).
void BlurAxis(const LinearImage& in, const std::vector<float>& kernel, int step_x, int step_y,
              LinearImage* out) {
  const int radius = static_cast<int>(kernel.size() / 2);
  tbb::parallel_for(tbb::blocked_range<int>(0, in.height_px), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y) {
      float* const row = out->at(0, y);
      std::fill(row, row + 3 * static_cast<size_t>(in.width_px), 0.0f);
      for (int t = -radius; t <= radius; ++t) {
        const float weight = kernel[t + radius];
        const float* const source = in.at(0, std::clamp(y + t * step_y, 0, in.height_px - 1));
        const int shift = t * step_x;
        const int begin = std::clamp(-shift, 0, in.width_px);
        const int end = std::clamp(in.width_px - shift, begin, in.width_px);
        const auto add = [&](int x, int from) {
          for (int i = 0; i < 3; ++i) row[3 * x + i] += weight * source[3 * from + i];
        };
        for (int x = 0; x < begin; ++x) add(x, 0);
        for (int i = 3 * begin; i < 3 * end; ++i) row[i] += weight * source[i + 3 * shift];
        for (int x = end; x < in.width_px; ++x) add(x, in.width_px - 1);
      }
    }
  });
}

// Channel (0 red, 1 green, 2 blue) of a mosaic's pixel.
int MosaicChannel(PixelFormat format, int x, int y) {
  const int place = 2 * (y & 1) + (x & 1);
  switch (format) {
    case PixelFormat::kBayerRg8:
      return std::array<int, 4>{0, 1, 1, 2}[place];
    case PixelFormat::kBayerGr8:
      return std::array<int, 4>{1, 0, 2, 1}[place];
    case PixelFormat::kBayerGb8:
      return std::array<int, 4>{1, 2, 0, 1}[place];
    case PixelFormat::kBayerBg8:
      return std::array<int, 4>{2, 1, 1, 0}[place];
    default:
      return 1;
  }
}

uint8_t DevelopValue(double light, const SensorOptions& o, uint64_t key, uint64_t place) {
  double value = light * o.exposure;
  if (o.noise) {
    const double electrons = value * o.full_well_electrons;
    const double sigma = std::sqrt(electrons + o.read_noise_electrons * o.read_noise_electrons);
    value += sigma / o.full_well_electrons * NormalOf(key, place);
  }
  value = std::clamp(value, 0.0, 1.0);
  if (o.gamma != 1) value = std::pow(value, 1 / o.gamma);
  return static_cast<uint8_t>(std::lround(255 * value));
}

}  // namespace

absl::Status SensorOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("sensor: ", field, " is ", value, ", expected ", expected));
  };
  if (samples_per_axis < 1 || samples_per_axis > 16)
    return bad("samples_per_axis", samples_per_axis, "1 to 16");
  if (!(point_spread_sigma_px >= 0 && point_spread_sigma_px <= 50))
    return bad("point_spread_sigma_px", point_spread_sigma_px, "0 to 50");
  if (!(exposure > 0)) return bad("exposure", exposure, "a positive number");
  if (!(gamma >= 1 && gamma <= 4)) return bad("gamma", gamma, "1 to 4");
  if (!(full_well_electrons >= 10)) return bad("full_well_electrons", full_well_electrons, "at least 10");
  if (!(read_noise_electrons >= 0)) return bad("read_noise_electrons", read_noise_electrons, "0 or more");
  if (mosaic && (*mosaic == PixelFormat::kGrey8 || *mosaic == PixelFormat::kRgb8))
    return absl::InvalidArgumentError("sensor: mosaic must be one of the Bayer formats");
  return absl::OkStatus();
}

absl::StatusOr<LinearImage> TraceView(const StudioScene& scene, const CameraModel& camera,
                                      int samples_per_axis) {
  if (absl::Status status = camera.Validate(); !status.ok()) return status;
  if (samples_per_axis < 1) return absl::InvalidArgumentError("sensor: samples_per_axis must be at least 1");
  LinearImage image;
  image.width_px = camera.width_px, image.height_px = camera.height_px;
  image.rgb.resize(3 * static_cast<size_t>(image.width_px) * image.height_px);
  const int blocks_x = (image.width_px + kBlock_px - 1) / kBlock_px;
  const int blocks_y = (image.height_px + kBlock_px - 1) / kBlock_px;
  const LensGrid lens(camera, blocks_x, blocks_y);
  const float scale = 1.0f / static_cast<float>(samples_per_axis * samples_per_axis);
  tbb::parallel_for(tbb::blocked_range<int>(0, blocks_y), [&](const auto& range) {
    std::array<Eigen::Vector3f, RayScene::kPacket> sums;
    for (int by = range.begin(); by < range.end(); ++by)
      for (int bx = 0; bx < blocks_x; ++bx) {
        TraceBlock(scene, camera, lens, bx, by, samples_per_axis, &sums);
        for (int k = 0; k < RayScene::kPacket; ++k) {
          const int x = bx * kBlock_px + k % kBlock_px, y = by * kBlock_px + k / kBlock_px;
          if (x >= image.width_px || y >= image.height_px) continue;
          for (int i = 0; i < 3; ++i) image.at(x, y)[i] = scale * sums[k][i];
        }
      }
  });
  return image;
}

void BlurImage(double sigma_px, LinearImage* image) {
  if (!(sigma_px > 0)) return;
  const std::vector<float> kernel = GaussianKernel(sigma_px);
  LinearImage across = *image;
  BlurAxis(*image, kernel, 1, 0, &across);
  BlurAxis(across, kernel, 0, 1, image);
}

Frame DevelopImage(const LinearImage& image, const SensorOptions& options, const std::string& camera_id,
                   int64_t frame_number) {
  const uint64_t key = MixBits(KeyOf(options.seed, camera_id) ^ MixBits(static_cast<uint64_t>(frame_number)));
  Frame frame;
  frame.camera_id = camera_id;
  frame.width_px = image.width_px, frame.height_px = image.height_px;
  frame.format = options.mosaic.value_or(PixelFormat::kRgb8);
  frame.origin = "simulation";
  const size_t channels = options.mosaic ? 1 : 3;
  auto pixels = std::make_shared<std::vector<uint8_t>>(channels * image.width_px * image.height_px);
  tbb::parallel_for(tbb::blocked_range<int>(0, image.height_px), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y)
      for (int x = 0; x < image.width_px; ++x) {
        const size_t place = static_cast<size_t>(y) * image.width_px + x;
        for (size_t i = 0; i < channels; ++i) {
          const size_t channel = options.mosaic ? MosaicChannel(*options.mosaic, x, y) : i;
          (*pixels)[channels * place + i] =
              DevelopValue(image.at(x, y)[channel], options, key, 3 * place + channel);
        }
      }
  });
  frame.pixels = std::move(pixels);
  return frame;
}

absl::StatusOr<Frame> RenderView(const StudioScene& scene, const CameraModel& camera,
                                 const SensorOptions& options, int64_t frame_number) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  absl::StatusOr<LinearImage> image = TraceView(scene, camera, options.samples_per_axis);
  if (!image.ok()) return image.status();
  BlurImage(options.point_spread_sigma_px, &*image);
  return DevelopImage(*image, options, camera.id, frame_number);
}

}  // namespace weft

#include "simulation/sensor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr double kSharpeningSigmaPx = 1;

// Channels (0 red, 1 green, 2 blue) of the mosaic's first 2 x 2 pixels.
std::array<int, 4> MosaicChannels(PixelFormat format) {
  switch (format) {
    case PixelFormat::kBayerGr8:
      return {1, 0, 2, 1};
    case PixelFormat::kBayerGb8:
      return {1, 2, 0, 1};
    case PixelFormat::kBayerBg8:
      return {2, 1, 1, 0};
    default:
      return {0, 1, 1, 2};
  }
}

// From light to what this camera measures of it, exposure included.
Eigen::Matrix3f ResponseOf(const SensorOptions& o, const std::string& camera_id) {
  const uint64_t key = KeyOf(o.seed, camera_id + " response");
  Eigen::Matrix3f response = Eigen::Matrix3f::Identity();
  for (int i = 0; i < 9; ++i)
    response(i / 3, i % 3) += static_cast<float>(o.color_variation * NormalOf(key, static_cast<uint64_t>(i)));
  const double exposure = o.exposure * std::max(0.1, 1 + o.exposure_variation * NormalOf(key, 9));
  return static_cast<float>(exposure) * response;
}

// Standard normal numbers from 16 random bits each: the quantiles of as many equal shares.
class NormalQuantiles {
 public:
  NormalQuantiles() : of_share_(kShares) {
    // Upwards from the middle by Newton's method on the distribution function; the lower half mirrors it.
    double x = 0;
    for (int i = kShares / 2; i < kShares; ++i) {
      const double share = (i + 0.5) / kShares;
      for (int k = 0; k < 4; ++k)
        x += (share - 1 + 0.5 * std::erfc(x / std::numbers::sqrt2)) * std::sqrt(2 * std::numbers::pi) *
             std::exp(x * x / 2);
      of_share_[i] = static_cast<float>(x);
      of_share_[kShares - 1 - i] = -of_share_[i];
    }
  }
  float operator[](uint64_t bits) const { return of_share_[bits & (kShares - 1)]; }

 private:
  static constexpr int kShares = 1 << 16;
  std::vector<float> of_share_;
};

// Four standard normal numbers of a place.
std::array<float, 4> NoiseOf(uint64_t key, uint64_t place) {
  static const NormalQuantiles quantiles;
  const uint64_t bits = MixBits(key ^ MixBits(place));
  return {quantiles[bits], quantiles[bits >> 16], quantiles[bits >> 32], quantiles[bits >> 48]};
}

// One measured value, relative to white.
float Measure(float value, const SensorOptions& o, float noise) {
  if (!o.noise) return value;
  const auto well = static_cast<float>(o.full_well_electrons);
  const auto read = static_cast<float>(o.read_noise_electrons);
  const float sigma = std::sqrt(std::max(0.0f, value) * well + read * read);
  return std::min(value + sigma / well * noise, 1.0f);
}

template <typename Row>
void ForRows(int height_px, const Row& row) {
  tbb::parallel_for(tbb::blocked_range<int>(0, height_px, 16), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y) row(y);
  });
}

// Raw values [height][width].
std::vector<float> MeasureMosaic(const LinearImage& image, const SensorOptions& o,
                                 const Eigen::Matrix3f& response, uint64_t key) {
  const std::array<int, 4> channels = MosaicChannels(o.mosaic);
  std::vector<float> raw(static_cast<size_t>(image.width_px) * image.height_px);
  ForRows(image.height_px, [&](int y) {
    for (int x = 0; x < image.width_px; ++x) {
      const size_t place = static_cast<size_t>(y) * image.width_px + x;
      const Eigen::Map<const Eigen::Vector3f> light(image.at(x, y));
      raw[place] =
          Measure(response.row(channels[2 * (y & 1) + (x & 1)]).dot(light), o, NoiseOf(key, place)[0]);
    }
  });
  return raw;
}

LinearImage MeasureBinned(const LinearImage& image, const SensorOptions& o, const Eigen::Matrix3f& response,
                          uint64_t key) {
  LinearImage out{image.width_px, image.height_px, std::vector<float>(image.rgb.size())};
  ForRows(image.height_px, [&](int y) {
    for (int x = 0; x < image.width_px; ++x) {
      const size_t place = static_cast<size_t>(y) * image.width_px + x;
      const Eigen::Vector3f value = response * Eigen::Map<const Eigen::Vector3f>(image.at(x, y));
      const std::array<float, 4> noise = NoiseOf(key, place);
      for (int i = 0; i < 3; ++i) out.rgb[3 * place + i] = Measure(value[i], o, noise[i]);
    }
  });
  return out;
}

// Malvar, He and Cutler 2004: bilinear interpolation corrected by the second derivative of the channel that
// the pixel measures. The border is mirrored, which keeps the pattern.
LinearImage Demosaic(const std::vector<float>& raw, int width_px, int height_px, PixelFormat mosaic) {
  const std::array<int, 4> channels = MosaicChannels(mosaic);
  LinearImage out{width_px, height_px, std::vector<float>(3 * raw.size())};
  const auto mirrored = [](int i, int n) {
    if (n < 3) return std::clamp(i, 0, n - 1);
    return i < 0 ? -i : (i >= n ? 2 * n - 2 - i : i);
  };
  ForRows(height_px, [&](int y) {
    std::array<const float*, 5> rows;
    for (int k = 0; k < 5; ++k)
      rows[k] = &raw[static_cast<size_t>(mirrored(y + k - 2, height_px)) * width_px];
    for (int x = 0; x < width_px; ++x) {
      const int w2 = mirrored(x - 2, width_px), w1 = mirrored(x - 1, width_px);
      const int e1 = mirrored(x + 1, width_px), e2 = mirrored(x + 2, width_px);
      const float here = rows[2][x];
      const float ns1 = rows[1][x] + rows[3][x], ns2 = rows[0][x] + rows[4][x];
      const float we1 = rows[2][w1] + rows[2][e1], we2 = rows[2][w2] + rows[2][e2];
      const float corners = rows[1][w1] + rows[1][e1] + rows[3][w1] + rows[3][e1];
      const int own = channels[2 * (y & 1) + (x & 1)];
      const int beside = channels[2 * (y & 1) + ((x + 1) & 1)];
      float* const pixel = out.at(x, y);
      pixel[own] = here;
      if (own == 1) {  // green: one of red and blue lies beside, the other above and below
        pixel[beside] = (5 * here + 4 * we1 - we2 - corners + 0.5f * ns2) / 8;
        pixel[2 - beside] = (5 * here + 4 * ns1 - ns2 - corners + 0.5f * we2) / 8;
      } else {
        pixel[1] = (4 * here + 2 * (ns1 + we1) - (ns2 + we2)) / 8;
        pixel[2 - own] = (6 * here + 2 * corners - 1.5f * (ns2 + we2)) / 8;
      }
    }
  });
  return out;
}

// Gamma and bits, by a table that is finer than the values.
class ToneCurve {
 public:
  ToneCurve(double gamma, int bits) : most_((1 << bits) - 1) {
    if (gamma == 1) return;
    table_.resize(kSteps + 2);
    for (int i = 0; i < kSteps + 2; ++i)
      table_[i] = static_cast<float>(std::pow(std::min(1.0, static_cast<double>(i) / kSteps), 1 / gamma));
    gamma_ = gamma;
  }
  uint16_t operator()(float value) const {
    value = std::clamp(value, 0.0f, 1.0f);
    if (value < kDark && gamma_ != 1) {
      value = static_cast<float>(std::pow(value, 1 / gamma_));  // too steep for the table
    } else if (gamma_ != 1) {
      const float at = value * kSteps;
      const auto i = static_cast<int>(at);
      value = table_[i] + (at - static_cast<float>(i)) * (table_[i + 1] - table_[i]);
    }
    return static_cast<uint16_t>(value * static_cast<float>(most_) + 0.5f);
  }

 private:
  static constexpr int kSteps = 8192;
  static constexpr float kDark = 0.004f;
  int most_;
  double gamma_ = 1;
  std::vector<float> table_;
};

void Sharpen(double share, LinearImage* image) {
  if (!(share > 0)) return;
  LinearImage soft = *image;
  BlurGaussian(kSharpeningSigmaPx, &soft);
  const auto s = static_cast<float>(share);
  for (size_t i = 0; i < image->rgb.size(); ++i) image->rgb[i] += s * (image->rgb[i] - soft.rgb[i]);
}

}  // namespace

absl::Status SensorOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("sensor: ", field, " is ", value, ", expected ", expected));
  };
  if (mosaic == PixelFormat::kGrey8 || mosaic == PixelFormat::kRgb8)
    return absl::InvalidArgumentError("sensor: mosaic must be one of the Bayer formats");
  if (bits < 8 || bits > 12) return bad("bits", bits, "8 to 12");
  if (!(exposure > 0)) return bad("exposure", exposure, "a positive number");
  if (!(gamma >= 1 && gamma <= 4)) return bad("gamma", gamma, "1 to 4");
  if (!(full_well_electrons >= 10)) return bad("full_well_electrons", full_well_electrons, "at least 10");
  if (!(read_noise_electrons >= 0)) return bad("read_noise_electrons", read_noise_electrons, "0 or more");
  if (!(exposure_variation >= 0 && exposure_variation <= 0.5))
    return bad("exposure_variation", exposure_variation, "0 to 0.5");
  if (!(color_variation >= 0 && color_variation <= 0.3))
    return bad("color_variation", color_variation, "0 to 0.3");
  if (!(sharpening >= 0 && sharpening <= 5)) return bad("sharpening", sharpening, "0 to 5");
  return absl::OkStatus();
}

Picture DevelopImage(const LinearImage& image, const SensorOptions& options, const std::string& camera_id,
                     int64_t frame_number) {
  const uint64_t key = MixBits(KeyOf(options.seed, camera_id) ^ MixBits(static_cast<uint64_t>(frame_number)));
  const Eigen::Matrix3f response = ResponseOf(options, camera_id);
  const ToneCurve tone(options.gamma, options.bits);
  Picture out;
  out.camera_id = camera_id;
  out.width_px = image.width_px, out.height_px = image.height_px;
  out.bits = options.bits;
  const auto row_values = static_cast<size_t>(image.width_px);
  if (options.readout == Readout::kMosaic) {
    const std::vector<float> raw = MeasureMosaic(image, options, response, key);
    out.mosaic = options.mosaic;
    out.values.resize(raw.size());
    ForRows(image.height_px, [&](int y) {
      for (size_t i = row_values * y; i < row_values * (y + 1); ++i) out.values[i] = tone(raw[i]);
    });
    return out;
  }
  LinearImage measured = options.readout == Readout::kBinned
                             ? MeasureBinned(image, options, response, key)
                             : Demosaic(MeasureMosaic(image, options, response, key), image.width_px,
                                        image.height_px, options.mosaic);
  Sharpen(options.sharpening, &measured);
  out.values.resize(measured.rgb.size());
  ForRows(image.height_px, [&](int y) {
    for (size_t i = 3 * row_values * y; i < 3 * row_values * (y + 1); ++i)
      out.values[i] = tone(measured.rgb[i]);
  });
  return out;
}

Frame ToFrame(const Picture& picture) {
  Frame frame;
  frame.camera_id = picture.camera_id;
  frame.width_px = picture.width_px, frame.height_px = picture.height_px;
  frame.format = picture.mosaic.value_or(PixelFormat::kRgb8);
  frame.origin = "simulation";
  auto pixels = std::make_shared<std::vector<uint8_t>>(picture.values.size());
  const unsigned most = (1U << picture.bits) - 1;
  for (size_t i = 0; i < picture.values.size(); ++i)
    (*pixels)[i] = static_cast<uint8_t>((picture.values[i] * 255U + most / 2) / most);
  frame.pixels = std::move(pixels);
  return frame;
}

}  // namespace weft

#include "services/work/animation/net_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "animation/sparse_view/driving_features.h"
#include "tests/services/work/animation/waving_takes.h"

namespace weft {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr uint32_t kOffsetChannels = 3;

// The file of samples, read as docs/file-formats.md has it.
struct SampleFile {
  struct Sample {
    uint32_t split = 0, take = 0, frame = 0, cameras = 0;
    std::vector<float> offsets;  // in the net's unit
  };
  uint32_t features = 0, answers = 0, height = 0, width = 0, texels = 0;
  std::vector<Sample> samples;

  explicit SampleFile(const std::string& bytes) {
    size_t at = 8;
    const auto take = [&] {
      uint32_t out = 0;
      std::memcpy(&out, bytes.data() + at, sizeof(out));
      at += sizeof(out);
      return out;
    };
    EXPECT_EQ(bytes.substr(0, 8), "weftsmp1");
    features = take(), answers = take(), height = take(), width = take(), texels = take();
    at += 5 * size_t{texels};
    const size_t image_bytes = 2 * size_t{texels} * (features + answers);
    EXPECT_EQ((bytes.size() - at) % (16 + image_bytes), 0u);
    while (at + 16 + image_bytes <= bytes.size()) {
      Sample sample;
      sample.split = take(), sample.take = take(), sample.frame = take(), sample.cameras = take();
      for (size_t k = size_t{texels} * features; k < size_t{texels} * (features + answers); ++k) {
        Eigen::half value;
        std::memcpy(&value, bytes.data() + at + 2 * k, 2);
        sample.offsets.push_back(static_cast<float>(value));
      }
      at += image_bytes;
      samples.push_back(std::move(sample));
    }
  }
};

class NetSamplesTest : public testing::Test {
 protected:
  NetSamplesTest() {
    request_.training = {.components = 6, .calibration_frames = 6};
    request_.out = folder_ / "samples.bin";
  }
  absl::Status Make(const std::vector<std::string>& sources, const std::vector<std::string>& held_out) {
    auto opened = TrainingTakes::Open(sources, held_out, "", 0);
    EXPECT_TRUE(opened.ok()) << opened.status();
    return MakeNetSamples(
        *opened, request_,
        [this](std::string_view stage, double share) { shares_[std::string(stage)].push_back(share); },
        stop_.get_token());
  }
  SampleFile Samples() const { return SampleFile(ReadBytes(request_.out)); }

  WavingTakes& takes_ = WavingTakes::Get();
  const TempFolder folder_;
  NetSampleRequest request_;
  std::map<std::string, std::vector<double>> shares_;
  std::stop_source stop_;
};

// Spaces: of all, of first halves, of last halves, and without each of the two motions.
TEST_F(NetSamplesTest, FramesAreDrivenBySpacesThatNeverSawThem) {
  const absl::Status status = Make({takes_.walk, takes_.turn}, {takes_.held});
  ASSERT_TRUE(status.ok()) << status;
  const SampleFile file = Samples();
  EXPECT_EQ(file.features, static_cast<uint32_t>(kDrivingFeatures));
  EXPECT_EQ(file.answers, kOffsetChannels);
  EXPECT_GT(file.texels, 0u);
  EXPECT_LE(file.texels, file.height * file.width);
  EXPECT_THAT(shares_["spaces"], ElementsAre(0.2, 0.4, 0.6, 0.8, 1));
  EXPECT_EQ(shares_["samples"].back(), 1);
  std::map<std::pair<uint32_t, uint32_t>, int> drives_of;  // of take and frame
  std::map<uint32_t, std::set<uint32_t>> cameras_of;       // of a split
  for (const SampleFile::Sample& sample : file.samples) {
    EXPECT_EQ(sample.split, sample.take == 2 ? 1u : 0u) << "held-out frames validate";
    EXPECT_LT(sample.frame, 30u);
    cameras_of[sample.split].insert(sample.cameras);
    ++drives_of[{sample.take, sample.frame}];
  }
  // Each learnt frame by two of them before two rigs, the first two of a drive apart, every second one.
  // Halves begin at frames 0 and 15.
  EXPECT_EQ(drives_of.count({0, 0}) + drives_of.count({0, 2}), 0u);
  EXPECT_EQ((drives_of[{0, 4}]), 4);
  EXPECT_EQ((drives_of[{1, 14}]), 4);
  EXPECT_EQ((drives_of[{0, 16}]), 2) << "by the space without its motion";
  EXPECT_EQ((drives_of[{0, 17}]), 0);
  EXPECT_EQ((drives_of[{0, 19}]), 2) << "by the space of first halves";
  EXPECT_EQ((drives_of[{0, 29}]), 2);
  EXPECT_EQ((drives_of[{2, 3}]), 0);
  EXPECT_EQ((drives_of[{2, 4}]), 2);
  EXPECT_EQ((drives_of[{2, 28}]), 2);
  EXPECT_THAT(cameras_of[0], ElementsAre(2, 3, 4));
  EXPECT_THAT(cameras_of[1], ElementsAre(2, 3)) << "four to train alone";
  // Answers say how far the drive was off, in the axes of the cloth: some mm.
  double sum_mm2 = 0, count = 0;
  for (const SampleFile::Sample& sample : file.samples)
    for (size_t texel = 0; texel < file.texels; ++texel, ++count)
      for (size_t c = 0; c < kOffsetChannels; ++c)
        sum_mm2 += std::pow(sample.offsets[c * file.texels + texel] * kAnswerUnitMm, 2);
  const double rms_mm = std::sqrt(sum_mm2 / count);
  EXPECT_GT(rms_mm, 0.2);
  EXPECT_LT(rms_mm, 40);
}

TEST_F(NetSamplesTest, EveryFrameAndOneRigWhereThatIsAskedFor) {
  request_.every = 1, request_.rigs = 1;
  ASSERT_TRUE(Make({takes_.walk, takes_.turn}, {}).ok());
  std::map<std::pair<uint32_t, uint32_t>, int> drives_of;
  std::set<uint32_t> cameras;
  for (const SampleFile::Sample& sample : Samples().samples) {
    ++drives_of[{sample.take, sample.frame}];
    cameras.insert(sample.cameras);
    // Without held-out takes the last tenth of each validates.
    EXPECT_EQ(sample.split, sample.frame >= 27 ? 1u : 0u) << sample.frame;
  }
  EXPECT_EQ((drives_of[{0, 1}]), 0);
  EXPECT_EQ((drives_of[{0, 2}]), 2);
  EXPECT_EQ((drives_of[{0, 3}]), 2);
  EXPECT_EQ((drives_of[{0, 29}]), 1);
  EXPECT_EQ((drives_of[{0, 28}]), 0);
  EXPECT_THAT(cameras, ElementsAre(2)) << "six drives to train are too few for four cameras";
}

TEST_F(NetSamplesTest, TheSameAtAnyNumberOfThreads) {
  request_.rigs = 1, request_.every = 3;
  ASSERT_TRUE(Make({takes_.walk, takes_.turn}, {}).ok());
  const std::string bytes = ReadBytes(request_.out);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  ASSERT_TRUE(Make({takes_.walk, takes_.turn}, {}).ok());
  EXPECT_EQ(ReadBytes(request_.out), bytes);
  request_.seed = 2;
  ASSERT_TRUE(Make({takes_.walk, takes_.turn}, {}).ok());
  EXPECT_NE(ReadBytes(request_.out), bytes);
}

TEST_F(NetSamplesTest, TakesThatAreTooShortAreSaid) {
  const std::string little = takes_.Write(folder_ / "short", 38, 2);
  const absl::Status status = Make({little}, {takes_.held});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("38 frames to learn from are too few, at least 40"));
  const std::string enough = takes_.Write(folder_ / "enough", 40, 2);
  EXPECT_TRUE(Make({enough}, {takes_.held}).ok());
}

TEST_F(NetSamplesTest, StoppedLeavesNothing) {
  stop_.request_stop();
  EXPECT_EQ(Make({takes_.walk, takes_.turn}, {}).code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace weft

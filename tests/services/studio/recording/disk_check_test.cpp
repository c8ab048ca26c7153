#include "services/studio/recording/disk_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A camera that only has settings.
class Described : public CameraSource {
 public:
  explicit Described(std::map<std::string, std::string> settings) : settings_(std::move(settings)) {}
  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override { return settings_; }
  absl::Status Start() override { return absl::OkStatus(); }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds) override {
    return absl::OutOfRangeError("the end");
  }
  void Stop() override {}
  CameraCounters counters() const override { return {}; }

 private:
  const std::string id_ = "c01";
  const std::map<std::string, std::string> settings_;
};

TEST(DiskCheck, SumsTheDataRatesOfTheCameras) {
  std::vector<std::unique_ptr<CameraSource>> cameras;
  LiveRecordingOptions options;
  options.sets.period_ns = 10'000'000;
  cameras.push_back(std::make_unique<Described>(std::map<std::string, std::string>{
      {"Width", "2000"}, {"Height", "1000"}, {"PixelFormat", "BayerRG8"}}));
  cameras.push_back(std::make_unique<Described>(std::map<std::string, std::string>{
      {"Width", "1000"}, {"Height", "1000"}, {"PixelFormat", "BayerRG12Packed"}}));
  EXPECT_DOUBLE_EQ(DataRate_bytes_per_s(cameras, options).value(), 3.5e8);
  options.sets.period_ns = 0;
  EXPECT_FALSE(DataRate_bytes_per_s(cameras, options).has_value());
  options.sets.period_ns = 1;
  cameras.push_back(std::make_unique<Described>(std::map<std::string, std::string>{{"Width", "10"}}));
  EXPECT_FALSE(DataRate_bytes_per_s(cameras, options).has_value());
}

TEST(DiskCheck, RefusesADiskThatIsTooSlowAndWarnsOfOneThatBarelyKeepsUp) {
  LiveRecordingOptions options;
  options.recorder.low_disk_bytes = 1'000'000'000;
  options.recorder.queue_bytes = uint64_t{1} << 30;
  DiskSpeed speed;
  speed.bytes_per_s = 1e9;
  speed.free_bytes = 21'000'000'000;
  EXPECT_THAT(*AssessDisk(speed, 0.5e9, options), IsEmpty());
  EXPECT_THAT(*AssessDisk(speed, 0.9e9, options), ElementsAre(HasSubstr("little to spare")));
  const absl::Status slow = AssessDisk(speed, 2.07374e9, options).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(slow));
  EXPECT_THAT(std::string(slow.message()),
              HasSubstr("the cameras send 2.074 GB/s, the disk takes 1.000 GB/s: the queue of 1024 MiB would "
                        "be full after 1.0 s"));
  options.recorder.take.stream.compress = true;
  EXPECT_THAT(*AssessDisk(speed, 2e9, options), ElementsAre(HasSubstr("if the streams were not compressed")));

  options.seconds = 60;
  EXPECT_THAT(*AssessDisk(speed, 0.5e9, options), ElementsAre(HasSubstr("room for 40 s of the 60 s")));
  options.recorder.low_disk_bytes = 22'000'000'000;
  EXPECT_TRUE(absl::IsFailedPrecondition(AssessDisk(speed, 0.5e9, options).status()));
}

TEST(DiskCheck, WritesForASecondWithinSixteenMebibytesAndAGibibyte) {
  EXPECT_EQ(DiskTestBytes(0), uint64_t{16} << 20);
  EXPECT_EQ(DiskTestBytes(20e6), 20'000'000u);
  EXPECT_EQ(DiskTestBytes(1e12), uint64_t{1} << 30);
}

TEST(DiskCheck, TriesTheDiskWhereTheRateIsKnown) {
  const TempFolder folder;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::make_unique<Described>(
      std::map<std::string, std::string>{{"Width", "100"}, {"Height", "10"}, {"PixelFormat", "Mono8"}}));
  LiveRecordingOptions options;
  options.recorder.low_disk_bytes = 0;
  const auto unknown = TestDisk(folder / "none", cameras, options, "no_disk_test");
  ASSERT_TRUE(unknown.ok()) << "no rate, no test: " << unknown.status();
  options.sets.period_ns = 1'000'000'000;
  const auto slow = TestDisk(folder.path(), cameras, options, "no_disk_test");
  ASSERT_TRUE(slow.ok()) << slow.status();
  EXPECT_THAT(*slow, IsEmpty());
  options.recorder.low_disk_bytes = uint64_t{1} << 62;
  const absl::Status full = TestDisk(folder.path(), cameras, options, "no_disk_test").status();
  EXPECT_TRUE(absl::IsFailedPrecondition(full));
  EXPECT_THAT(std::string(full.message()), ::testing::StartsWith(folder.path() + ": only "));
  EXPECT_THAT(std::string(full.message()), ::testing::EndsWith("; no_disk_test records all the same"));
}

}  // namespace
}  // namespace weft

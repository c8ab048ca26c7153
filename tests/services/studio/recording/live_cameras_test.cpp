// Cameras that do as they are told: what becomes of their triggers, their clocks and their absence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "base/host_clock.h"
#include "services/studio/recording/live_recording.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

constexpr int64_t kTriggered_ns = 100'000'000;

LiveRecordingOptions TriggeredOptions() {
  LiveRecordingOptions options;
  options.sets.period_ns = kTriggered_ns;
  options.recorder.low_disk_bytes = 0;
  options.recorder.take.stream.preallocate_bytes = 1 << 20;
  options.seconds = 0.5;
  return options;
}

// Delivers a frame for each trigger, and what else it is told to.
class ObedientCamera : public CameraSource {
 public:
  ObedientCamera(std::string id, absl::Status start, absl::Status answer = absl::OkStatus())
      : id_(std::move(id)), start_(std::move(start)), answer_(std::move(answer)) {}
  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override { return {}; }
  absl::Status Start() override {
    is_started_ = start_.ok();
    return start_;
  }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return !deliveries_.empty(); });
    if (deliveries_.empty()) return absl::DeadlineExceededError("nothing");
    CameraDelivery next = std::move(deliveries_.front());
    deliveries_.erase(deliveries_.begin());
    return next;
  }
  absl::Status Trigger() override {
    CameraDelivery delivery;
    delivery.frame.camera_id = id_;
    delivery.frame.width_px = delivery.frame.height_px = 8;
    delivery.frame.format = RawFormat::kMono8;
    delivery.frame.bytes = std::make_shared<AlignedBuffer>(64);
    delivery.frame.device_time_ns = delivery.frame.host_time_ns = HostTime_ns();
    if (answer_.ok()) Deliver(std::move(delivery));
    return answer_;
  }
  void Deliver(CameraDelivery delivery) {
    const std::lock_guard lock(mutex_);
    deliveries_.push_back(std::move(delivery));
    changed_.notify_all();
  }
  void Stop() override { is_started_ = false; }
  bool is_started() const { return is_started_; }
  CameraCounters counters() const override { return {}; }

 private:
  const std::string id_;
  const absl::Status start_, answer_;
  std::atomic<bool> is_started_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<CameraDelivery> deliveries_;
};

TEST(LiveCameras, TriggersTheCamerasAndShowsTheirSets) {
  const TempFolder temp;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::make_unique<ObedientCamera>("a", absl::OkStatus()));
  LiveRecordingOptions options = TriggeredOptions();
  options.sets.period_ns = options.trigger.period_ns = 20'000'000;
  options.trigger.kind = TriggerKind::kSoftware;
  std::atomic<size_t> looks = 0, reports = 0;
  options.look = [&](const RawFrameSet& set) { looks += set.frames.size(); };
  std::atomic<bool> stop = false;
  options.seconds = 60;
  const auto take = RecordLive(temp / "take", cameras, options, stop, [&](const LiveRecordingState& state) {
    if (state.recorder.sets_recorded >= 2) stop = true;
    ++reports;
  });
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_EQ(take->sync(), "software trigger, shared clocks, tolerance 2.000 ms, period 20.000 ms");
  EXPECT_GE(take->sets_recorded(), 2u);
  EXPECT_GE(looks, take->sets_recorded());
  EXPECT_GE(reports, 1u);
  EXPECT_EQ(take->state(), v1::TAKE_STATE_COMPLETE);
}

TEST(LiveCameras, ATriggerThatFailsIsInTheLedger) {
  const TempFolder temp;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::make_unique<ObedientCamera>("a", absl::OkStatus(), absl::UnavailableError("cable")));
  LiveRecordingOptions options = TriggeredOptions();
  options.sets.period_ns = options.trigger.period_ns = 20'000'000;
  options.trigger.kind = TriggerKind::kSoftware;
  options.seconds = 0.2;
  const std::atomic<bool> stop = false;
  const auto take = RecordLive(temp / "take", cameras, options, stop);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_THAT(DescribeTake(temp / "take")->notes(),
              ::testing::ElementsAre("camera a: trigger not sent: cable"));
}

TEST(LiveCameras, NamesTheTriggersOfTheSession) {
  for (const auto& [kind, words] :
       {std::pair{TriggerKind::kFreeRun, "free run, "}, std::pair{TriggerKind::kLine, "hardware trigger, "},
        std::pair{TriggerKind::kAction, "action commands, "}}) {
    const TempFolder temp;
    std::vector<std::unique_ptr<CameraSource>> cameras;
    auto camera = std::make_unique<ObedientCamera>("a", absl::OkStatus());
    CameraDelivery clock;  // action commands wait for one
    clock.kind = CameraDelivery::Kind::kClock;
    clock.clock = {HostTime_ns(), 0, 1000, "", {}};
    camera->Deliver(std::move(clock));
    cameras.push_back(std::move(camera));
    LiveRecordingOptions options = TriggeredOptions();
    options.trigger.kind = kind;
    options.trigger.period_ns = kTriggered_ns;
    const std::atomic<bool> stop = true;
    const auto take = RecordLive(temp / "take", cameras, options, stop);
    ASSERT_TRUE(take.ok()) << take.status();
    EXPECT_THAT(take->sync(), ::testing::StartsWith(words));
  }
}

TEST(LiveCameras, OfCamerasThatDoNotAllStartNoneIsLeftRunning) {
  const TempFolder temp;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  auto first = std::make_unique<ObedientCamera>("a", absl::OkStatus());
  const ObedientCamera& running = *first;
  cameras.push_back(std::move(first));
  cameras.push_back(std::make_unique<ObedientCamera>("b", absl::UnavailableError("camera b: no answer")));
  const std::atomic<bool> stop = true;
  const absl::Status failed = RecordLive(temp / "take", cameras, TriggeredOptions(), stop).status();
  EXPECT_EQ(failed.message(), "camera b: no answer");
  EXPECT_FALSE(running.is_started());
  EXPECT_FALSE(std::filesystem::exists(temp / "take"));
  // Nor where the take cannot be written.
  cameras.pop_back();
  WriteBytes(temp / "take", "a file");
  EXPECT_FALSE(RecordLive(temp / "take", cameras, TriggeredOptions(), stop).ok());
  EXPECT_FALSE(running.is_started());
}

TEST(LiveCameras, CountsHowOftenACameraWasAway) {
  using Kind = CameraDelivery::Kind;
  const TempFolder temp;
  auto camera = std::make_unique<ObedientCamera>("a", absl::OkStatus());
  for (const Kind kind : {Kind::kDisconnected, Kind::kReconnected, Kind::kDisconnected}) {
    CameraDelivery delivery;
    delivery.kind = kind;
    delivery.cause = "pulled out";
    camera->Deliver(std::move(delivery));
  }
  const auto clock = [&](const char* ptp) {
    CameraDelivery delivery;
    delivery.kind = Kind::kClock;
    delivery.clock = {HostTime_ns(), 0, 1000, ptp, {}};
    camera->Deliver(std::move(delivery));
  };
  clock("Listening");
  clock("Slave");
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::move(camera));
  LiveRecordingOptions options = TriggeredOptions();
  options.seconds = 0.3;
  const std::atomic<bool> stop = false;
  bool was_away = false;
  const auto take = RecordLive(temp / "take", cameras, options, stop,
                               [&](const LiveRecordingState& state) { was_away = state.cameras[0].is_away; });
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_TRUE(was_away);
  EXPECT_EQ(take->cameras(0).disconnections(), 2u);
  EXPECT_EQ(take->cameras(0).reconnections(), 1u);
  EXPECT_THAT(DescribeTake(temp / "take")->notes(),
              ::testing::Contains("camera a: PTP went from Listening to Slave"));
}

}  // namespace
}  // namespace weft

#include "services/studio/recording/trigger_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "base/host_clock.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int64_t kTrigger_ns = 10'000'000;
constexpr std::chrono::seconds kTriggerTimeout{30};

// Notes when it was triggered, and answers as it is told to.
class TriggeredCamera : public CameraSource {
 public:
  TriggeredCamera(std::string id, bool takes_triggers, std::string address = "")
      : id_(std::move(id)), takes_triggers_(takes_triggers), address_(std::move(address)) {}

  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override {
    if (address_.empty()) return {};
    return {{"DeviceAddress", address_}};
  }
  absl::Status Start() override { return absl::OkStatus(); }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds) override {
    return absl::OutOfRangeError("the end");
  }
  void Stop() override {}
  bool TakesTriggers() const override { return takes_triggers_; }
  absl::Status Trigger() override {
    const std::lock_guard lock(mutex_);
    at_ns_.push_back(HostTime_ns());
    changed_.notify_all();
    return answers_.size() < at_ns_.size() ? absl::OkStatus() : answers_[at_ns_.size() - 1];
  }
  CameraCounters counters() const override { return {}; }

  void AnswerWith(std::vector<absl::Status> answers) { answers_ = std::move(answers); }
  std::vector<int64_t> Await(size_t triggers) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kTriggerTimeout, [&] { return at_ns_.size() >= triggers; });
    return at_ns_;
  }

 private:
  const std::string id_;
  const bool takes_triggers_;
  const std::string address_;
  std::vector<absl::Status> answers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int64_t> at_ns_;
};

class TriggerSenderTest : public ::testing::Test {
 protected:
  TriggeredCamera& Add(const std::string& id, bool takes_triggers, const std::string& address = "") {
    auto camera = std::make_unique<TriggeredCamera>(id, takes_triggers, address);
    TriggeredCamera& added = *camera;
    cameras_.push_back(std::move(camera));
    return added;
  }
  std::unique_ptr<TriggerSender> Start(const TriggerOptions& options) {
    auto sender =
        TriggerSender::Start(cameras_, options, clocks_, [this](size_t camera, const std::string& what) {
          const std::lock_guard lock(mutex_);
          notes_.push_back(std::to_string(camera) + ": " + what);
          changed_.notify_all();
        });
    EXPECT_TRUE(sender.ok()) << sender.status();
    return sender.ok() ? *std::move(sender) : nullptr;
  }
  std::vector<std::string> AwaitNotes(size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kTriggerTimeout, [&] { return notes_.size() >= count; });
    return notes_;
  }

  std::vector<std::unique_ptr<CameraSource>> cameras_;
  ClockLog clocks_{{"a", "b"}};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> notes_;
};

TEST(TriggerOptions, ThoseOfOursNeedARate) {
  TriggerOptions options;
  EXPECT_FALSE(options.IsOurs());
  EXPECT_EQ(options.lead_ns, 20'000'000);
  EXPECT_TRUE(options.Validate().ok());
  options.kind = TriggerKind::kLine;
  EXPECT_FALSE(options.IsOurs());
  EXPECT_TRUE(options.Validate().ok());
  for (const TriggerKind kind : {TriggerKind::kSoftware, TriggerKind::kAction}) {
    options.kind = kind;
    options.period_ns = 0;
    EXPECT_TRUE(options.IsOurs());
    const absl::Status missing = options.Validate();
    EXPECT_TRUE(absl::IsInvalidArgument(missing));
    EXPECT_THAT(std::string(missing.message()), HasSubstr("fps is missing"));
    options.period_ns = 1;
    EXPECT_TRUE(options.Validate().ok());
  }
  options.lead_ns = 0;
  EXPECT_TRUE(options.Validate().ok());
  options.lead_ns = -1;
  EXPECT_EQ(options.Validate().message(), "lead_ms must not be negative");
}

TEST_F(TriggerSenderTest, TriggersAtMultiplesOfThePeriodThoseThatTakeTriggers) {
  TriggeredCamera& free = Add("a", false);
  TriggeredCamera& triggered = Add("b", true);
  TriggerOptions options;
  options.kind = TriggerKind::kSoftware;
  options.period_ns = kTrigger_ns;
  const std::unique_ptr<TriggerSender> sender = Start(options);
  ASSERT_NE(sender, nullptr);
  triggered.Await(10);
  sender->Stop();
  const std::vector<int64_t> at_ns = triggered.Await(0);
  ASSERT_GE(at_ns.size(), 10u);
  // One that is late may come just before the next one.
  EXPECT_LE(static_cast<int64_t>(at_ns.size()), (at_ns.back() - at_ns.front()) / kTrigger_ns + 2);
  EXPECT_THAT(free.Await(0), IsEmpty());
  EXPECT_THAT(notes_, IsEmpty());
  // None comes after Stop.
  const size_t then = triggered.Await(0).size();
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_EQ(triggered.Await(0).size(), then);
}

TEST_F(TriggerSenderTest, TellsAFailureOnceUntilItChanges) {
  const absl::Status broken = absl::UnavailableError("cable"), other = absl::UnavailableError("power");
  Add("a", true).AnswerWith({broken, broken, other, absl::OkStatus(), other});
  TriggerOptions options;
  options.kind = TriggerKind::kSoftware;
  options.period_ns = kTrigger_ns;
  const std::unique_ptr<TriggerSender> sender = Start(options);
  ASSERT_NE(sender, nullptr);
  EXPECT_THAT(AwaitNotes(3), ElementsAre("0: cable", "0: power", "0: power"));
}

TEST_F(TriggerSenderTest, ActionCommandsGoToTheCamerasAddress) {
  Add("a", true, "left");
  Add("b", true);
  TriggerOptions options;
  options.kind = TriggerKind::kAction;
  options.period_ns = kTrigger_ns;
  const std::unique_ptr<TriggerSender> sender = Start(options);
  ASSERT_NE(sender, nullptr);
  EXPECT_THAT(AwaitNotes(2), ElementsAre("0: \"left\" is no IPv4 address", "1: \"\" is no IPv4 address"));
}

TEST_F(TriggerSenderTest, RefusesOptionsThatAreWrong) {
  TriggerOptions options;
  options.kind = TriggerKind::kSoftware;
  EXPECT_TRUE(absl::IsInvalidArgument(TriggerSender::Start(cameras_, options, clocks_, nullptr).status()));
}

}  // namespace
}  // namespace weft

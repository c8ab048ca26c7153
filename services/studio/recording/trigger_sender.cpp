#include "services/studio/recording/trigger_sender.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "base/host_clock.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr int64_t kLongestSleep_ns = 50'000'000;

}  // namespace

absl::Status TriggerOptions::Validate() const {
  if (IsOurs() && period_ns <= 0)
    return absl::InvalidArgumentError("software triggers and action commands need a rate: fps is missing");
  if (lead_ns < 0) return absl::InvalidArgumentError("lead_ms must not be negative");
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<TriggerSender>> TriggerSender::Start(
    const std::vector<std::unique_ptr<CameraSource>>& cameras, const TriggerOptions& options,
    const ClockLog& clocks, Note note) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(ActionSender sender, ActionSender::Open());
  return std::unique_ptr<TriggerSender>(
      new TriggerSender(cameras, options, clocks, std::move(note), std::move(sender)));
}

TriggerSender::TriggerSender(const std::vector<std::unique_ptr<CameraSource>>& cameras,
                             const TriggerOptions& options, const ClockLog& clocks, Note note,
                             ActionSender sender)
    : cameras_(cameras),
      options_(options),
      clocks_(clocks),
      note_(std::move(note)),
      sender_(std::move(sender)),
      failures_(cameras.size()) {
  for (const auto& camera : cameras) {
    const std::map<std::string, std::string> settings = camera->settings();
    const auto address = settings.find("DeviceAddress");
    addresses_.push_back(address != settings.end() ? address->second : "");
  }
  while (first_triggered_ + 1 < cameras_.size() && !cameras_[first_triggered_]->TakesTriggers())
    ++first_triggered_;
  thread_ = std::thread([this] { Run(); });
}

void TriggerSender::Stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void TriggerSender::Run() {
  const int64_t lead_ns = options_.kind == TriggerKind::kAction ? options_.lead_ns : 0;
  int64_t next_ns = ((HostTime_ns() + lead_ns) / options_.period_ns + 1) * options_.period_ns;
  while (!stopping_) {
    const int64_t wait_ns = next_ns - lead_ns - HostTime_ns();
    if (wait_ns > 0) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(wait_ns, kLongestSleep_ns)));
      continue;
    }
    Send(next_ns);
    // After a long sleep of ours triggers are left out rather than sent in a rush.
    next_ns = std::max(next_ns + options_.period_ns,
                       (HostTime_ns() + lead_ns) / options_.period_ns * options_.period_ns);
  }
}

void TriggerSender::Send(int64_t at_host_ns) {
  FollowSharedClock();
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (!cameras_[i]->TakesTriggers()) continue;
    const absl::Status status =
        options_.kind == TriggerKind::kAction ? SendAction(i, at_host_ns) : cameras_[i]->Trigger();
    const std::string failure(status.message());
    if (!status.ok() && failure != failures_[i]) note_(i, failure);
    failures_[i] = failure;
  }
}

// Once for all cameras of a trigger. Kept as long as the lead allows, so that noise of the readings does not
// reach the intervals.
void TriggerSender::FollowSharedClock() {
  const std::optional<ClockReading> clock = clocks_.Last(first_triggered_);
  if (!clock) return;
  const int64_t minus_host_ns = clock->device_minus_host_ns;
  if (!shared_minus_host_ns_ || std::abs(*shared_minus_host_ns_ - minus_host_ns) > options_.lead_ns / 4)
    shared_minus_host_ns_ = minus_host_ns;
}

absl::Status TriggerSender::SendAction(size_t camera, int64_t at_host_ns) {
  ActionCommand command = options_.keys;
  if (options_.clocks == ClockDomain::kShared) {
    if (shared_minus_host_ns_) command.device_time_ns = at_host_ns + *shared_minus_host_ns_;
  } else if (const std::optional<ClockReading> clock = clocks_.Last(camera)) {
    command.device_time_ns = at_host_ns + clock->device_minus_host_ns;
  }
  return sender_.Send(command, addresses_[camera]);
}

}  // namespace weft

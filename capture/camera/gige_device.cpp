#include "capture/camera/gige_device.h"

#include <arv.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/camera/glib_error.h"

namespace weft {
namespace {

// Registers of every GigE Vision camera (GigE Vision 2.0, bootstrap registers).
constexpr uint32_t kCapabilityRegister = 0x0934, kCanResendBit = 1u << 2;
constexpr uint32_t kTimestampControlRegister = 0x0944, kLatchBit = 1u << 1;
constexpr uint32_t kTimestampHighRegister = 0x0948, kTimestampLowRegister = 0x094c;
constexpr int kClockTries = 3;
constexpr uint64_t kClockSteps_us = 2000, kLongestTick_us = 100'000;

constexpr const char* kReportedFeatures[] = {
    "DeviceVendorName", "DeviceModelName", "DeviceSerialNumber",  "DeviceVersion",    "Width",
    "Height",           "PixelFormat",     "ExposureTime",        "ExposureTimeAbs",  "Gain",
    "GainRaw",          "TriggerSelector", "TriggerMode",         "TriggerSource",    "AcquisitionFrameRate",
    "PtpEnable",        "PtpStatus",       "PtpOffsetFromMaster", "GevSCPSPacketSize"};

}  // namespace

bool GigeDevice::Has(const std::string& feature) const {
  return arv_device_get_feature(device_, feature.c_str()) != nullptr;
}

std::string GigeDevice::Text(const std::string& feature) const {
  ArvGcNode* node = arv_device_get_feature(device_, feature.c_str());
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node) || ARV_IS_GC_COMMAND(node)) return "";
  GlibError error;
  const char* text = arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), error.out());
  return error.ok() && text != nullptr ? text : "";
}

absl::Status GigeDevice::Set(const std::string& feature) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(feature, absl::MaxSplits('=', 1));
  ArvGcNode* node = arv_device_get_feature(device_, parts.first.c_str());
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", id_, ": it has no feature ", parts.first,
                     "; `arv-tool-0.8 features` of Debian's package aravis-tools-cli lists them"));
  }
  if (ARV_IS_GC_COMMAND(node)) return Execute(parts.first);
  GlibError error;
  arv_gc_feature_node_set_value_from_string(ARV_GC_FEATURE_NODE(node), parts.second.c_str(), error.out());
  if (error.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("camera ", id_, ": it refuses the feature ", feature, ": ", error.message()));
}

absl::Status GigeDevice::Execute(const std::string& command) {
  GlibError error;
  arv_device_execute_command(device_, command.c_str(), error.out());
  if (error.ok()) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("camera ", id_, ": the command ", command, " fails: ", error.message()));
}

absl::Status GigeDevice::SetTrigger(const CameraTrigger& trigger) {
  if (Has("TriggerSelector")) {
    WEFT_RETURN_IF_ERROR(Set("TriggerSelector=FrameStart"));
  }
  if (trigger.kind == TriggerKind::kFreeRun)
    return Has("TriggerMode") ? Set("TriggerMode=Off") : absl::OkStatus();
  std::vector<std::string> features = {"TriggerMode=On"};
  switch (trigger.kind) {
    case TriggerKind::kFreeRun:
      break;
    case TriggerKind::kSoftware:
      features.emplace_back("TriggerSource=Software");
      break;
    case TriggerKind::kLine:
      features.push_back("TriggerSource=" + trigger.line);
      break;
    case TriggerKind::kAction:
      features.emplace_back("TriggerSource=Action1");
      features.push_back(absl::StrCat("ActionDeviceKey=", trigger.device_key));
      if (Has("ActionSelector")) features.emplace_back("ActionSelector=1");
      features.push_back(absl::StrCat("ActionGroupKey=", trigger.group_key));
      features.push_back(absl::StrCat("ActionGroupMask=", trigger.group_mask));
      break;
  }
  for (const std::string& feature : features) WEFT_RETURN_IF_ERROR(Set(feature));
  return absl::OkStatus();
}

absl::Status GigeDevice::EnablePtp() {
  for (const char* name : {"PtpEnable", "GevIEEE1588"})
    if (Has(name)) return Set(absl::StrCat(name, "=true"));
  return absl::InvalidArgumentError(absl::StrCat("camera ", id_, ": it has no PTP (PtpEnable, GevIEEE1588)"));
}

std::string GigeDevice::PtpStatus() const {
  const std::string status = Text("PtpStatus");
  return status.empty() ? Text("GevIEEE1588Status") : status;
}

bool GigeDevice::HasPtpTime() const {
  const std::string status = PtpStatus();
  return absl::StartsWithIgnoreCase(status, "slave") || absl::EqualsIgnoreCase(status, "master");
}

absl::StatusOr<uint64_t> GigeDevice::TicksPerSecond() const {
  GlibError error;
  const guint64 ticks_per_s = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device_), error.out());
  if (!error.ok() || ticks_per_s == 0) return absl::UnavailableError("it has no known rate");
  return ticks_per_s;
}

absl::StatusOr<uint64_t> GigeDevice::LatchedTicks() {
  GlibError error;
  guint32 high = 0, low = 0;
  latched_before_ns_ = HostTime_ns();
  arv_device_write_register(device_, kTimestampControlRegister, kLatchBit, error.out());
  latched_after_ns_ = HostTime_ns();
  if (error.ok()) arv_device_read_register(device_, kTimestampHighRegister, &high, error.out());
  if (error.ok()) arv_device_read_register(device_, kTimestampLowRegister, &low, error.out());
  if (!error.ok()) return absl::UnavailableError(absl::StrCat("it does not answer: ", error.message()));
  const uint64_t ticks = uint64_t{high} << 32 | low;
  if (ticks == 0) return absl::UnavailableError("it reads 0");
  return ticks;
}

std::string GigeDevice::ClockProblem() {
  const absl::StatusOr<uint64_t> ticks_per_s = TicksPerSecond();
  if (!ticks_per_s.ok()) return std::string(ticks_per_s.status().message());
  const absl::StatusOr<uint64_t> before = LatchedTicks();
  if (!before.ok()) return std::string(before.status().message());
  std::this_thread::sleep_for(std::chrono::microseconds(
      std::min<uint64_t>(kLongestTick_us, kClockSteps_us + 3 * 1'000'000 / *ticks_per_s)));
  const absl::StatusOr<uint64_t> after = LatchedTicks();
  if (!after.ok()) return std::string(after.status().message());
  return *after == *before ? "it stands still" : "";
}

absl::StatusOr<ClockReading> GigeDevice::ReadClock() {
  const auto failed = [&](const absl::Status& status) {
    return absl::UnavailableError(
        absl::StrCat("camera ", id_, ": its clock cannot be read: ", status.message()));
  };
  const absl::StatusOr<uint64_t> rate = TicksPerSecond();
  if (!rate.ok()) return failed(rate.status());
  const uint64_t ticks_per_s = *rate, last_ticks = last_ticks_;
  ClockReading best;
  for (int i = 0; i < kClockTries; ++i) {
    const absl::StatusOr<uint64_t> latched = LatchedTicks();
    if (!latched.ok()) return failed(latched.status());
    const uint64_t ticks = last_ticks_ = *latched;
    if (i == 0 && ticks == last_ticks) return failed(absl::UnavailableError("it stands still"));
    const uint64_t seconds = ticks / ticks_per_s;
    const auto device_ns = static_cast<int64_t>(seconds * 1'000'000'000 + (ticks - seconds * ticks_per_s) *
                                                                              1'000'000'000 / ticks_per_s);
    const int64_t uncertainty_ns = (latched_after_ns_ - latched_before_ns_ + 1) / 2;
    if (i > 0 && uncertainty_ns >= best.uncertainty_ns) continue;
    best.host_time_ns = latched_before_ns_ + uncertainty_ns;
    best.device_minus_host_ns = device_ns - best.host_time_ns;
    best.uncertainty_ns = uncertainty_ns;
  }
  if (Has("PtpDataSetLatch")) static_cast<void>(Execute("PtpDataSetLatch"));  // else the offset is missing
  best.ptp_status = PtpStatus();
  int64_t offset_ns = 0;
  if (absl::SimpleAtoi(Text("PtpOffsetFromMaster"), &offset_ns)) best.ptp_offset_ns = offset_ns;
  return best;
}

bool GigeDevice::CanResend() const {
  guint32 value = 0;
  GlibError error;
  arv_device_read_register(device_, kCapabilityRegister, &value, error.out());
  return error.ok() && (value & kCanResendBit) != 0;
}

std::map<std::string, std::string> GigeDevice::Describe(const std::vector<std::string>& more) const {
  std::map<std::string, std::string> settings;
  const auto add = [&](const std::string& name) {
    if (std::string text = Text(name); !text.empty()) settings[name] = std::move(text);
  };
  for (const char* name : kReportedFeatures) add(name);
  for (const std::string& feature : more) add(feature.substr(0, feature.find('=')));
  return settings;
}

}  // namespace weft

#include "services/ground/process/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

void Notify(const std::string& state, const std::string& status) {
  std::string line = status;
  std::ranges::replace(line, '\n', ' ');
  // A manager that does not listen is no fault of the daemon.
  static_cast<void>(sd_notify(0, absl::StrCat(state, status.empty() ? "" : "STATUS=", line).c_str()));
}

}  // namespace

void NotifyReady(const std::string& status) { Notify("READY=1\n", status); }

void NotifyReloading() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  Notify(absl::StrCat("RELOADING=1\nMONOTONIC_USEC=", now_us, "\n"), "");
}

void NotifyStopping(const std::string& status) { Notify("STOPPING=1\n", status); }

void NotifyAlive(const std::string& status) { Notify("WATCHDOG=1\n", status); }

std::chrono::microseconds WatchdogPeriod() {
  uint64_t period_us = 0;
  const bool is_watched = sd_watchdog_enabled(0, &period_us) > 0;
  return std::chrono::microseconds(is_watched ? period_us : 0);
}

}  // namespace weft

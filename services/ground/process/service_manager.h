// What systemd, or another service manager with its protocol, is told of a daemon.
#pragma once

#include <chrono>
#include <string>

namespace weft {

// The functions below do nothing where no service manager asked for news (NOTIFY_SOCKET). `status` is one
// line for people, as `systemctl status` shows it. Thread safety: any thread.
void NotifyReady(const std::string& status);
// Until NotifyReady is called again.
void NotifyReloading();
void NotifyStopping(const std::string& status);
// That the daemon works, with the status.
void NotifyAlive(const std::string& status);

// Within so long NotifyAlive is expected, or the daemon is restarted; 0: nobody watches.
std::chrono::microseconds WatchdogPeriod();

}  // namespace weft

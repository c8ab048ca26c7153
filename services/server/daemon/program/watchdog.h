// Whether the daemon still answers, asked as a client asks.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "weft/v1/server.pb.h"

namespace weft {

// Calls GetServerInfo over a new connection to `address`, one of this daemon's. An answer that refuses the
// caller is one, too: the message is empty then. Unavailable or DeadlineExceeded: nobody is let in.
// Cancelled: `stop` was requested.
absl::StatusOr<v1::ServerInfo> AskFrontDoor(const std::string& address, std::chrono::milliseconds patience,
                                            const std::stop_token& stop = {});

// Asks in a thread of its own, first at once, then each `period`, for as long as it lives.
class Watchdog {
 public:
  // `answered`: called for every answer that came within a period. The log tells of those that did not.
  Watchdog(std::string address, std::chrono::milliseconds period,
           std::function<void(const v1::ServerInfo& info)> answered);

 private:
  void Run(const std::stop_token& stop) const;

  const std::string address_;
  const std::chrono::milliseconds period_;
  const std::function<void(const v1::ServerInfo& info)> answered_;
  std::jthread thread_;
};

}  // namespace weft

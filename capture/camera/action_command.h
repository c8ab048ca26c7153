// Action commands of GigE Vision: one packet that lets cameras take a frame, at once or at a time of their
// clock (GigE Vision 2.0, ACTION_CMD).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

struct ActionCommand {
  uint32_t device_key = 1;  // as in the cameras' ActionDeviceKey, ActionGroupKey
  uint32_t group_key = 1;
  uint32_t group_mask = 1;                // a bit in common with ActionGroupMask
  std::optional<int64_t> device_time_ns;  // at once where it is missing
};

// The bytes of the packet. No acknowledgement is asked for: a camera that did not act shows in its frames.
std::vector<uint8_t> ActionPacket(const ActionCommand& command, uint16_t request_id);

// Sends commands to cameras. Thread safety: none.
class ActionSender {
 public:
  static absl::StatusOr<ActionSender> Open();
  ActionSender(ActionSender&& other) noexcept;
  ActionSender& operator=(ActionSender&&) = delete;
  ~ActionSender();

  // `address`: of a camera, or a broadcast address of its network.
  absl::Status Send(const ActionCommand& command, const std::string& address);

 private:
  explicit ActionSender(int socket) : socket_(socket) {}
  int socket_ = -1;
  uint16_t next_id_ = 1;
};

}  // namespace weft

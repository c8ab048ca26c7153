#include "capture/camera/action_command.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/camera/gvcp.h"

namespace weft {
namespace {

constexpr uint8_t kKey = 0x42, kScheduled = 0x80;
constexpr uint16_t kActionCommand = 0x0100;

template <typename T>
void AppendBigEndian(std::vector<uint8_t>& packet, T value) {
  for (size_t i = sizeof(T); i-- > 0;)
    packet.push_back(static_cast<uint8_t>(static_cast<uint64_t>(value) >> (8 * i)));
}

}  // namespace

std::vector<uint8_t> ActionPacket(const ActionCommand& command, uint16_t request_id) {
  const bool scheduled = command.device_time_ns.has_value();
  std::vector<uint8_t> packet = {kKey, scheduled ? kScheduled : uint8_t{0}};
  AppendBigEndian(packet, kActionCommand);
  AppendBigEndian(packet, static_cast<uint16_t>(scheduled ? 20 : 12));
  AppendBigEndian(packet, request_id);
  AppendBigEndian(packet, command.device_key);
  AppendBigEndian(packet, command.group_key);
  AppendBigEndian(packet, command.group_mask);
  if (scheduled) AppendBigEndian(packet, *command.device_time_ns);
  return packet;
}

absl::StatusOr<ActionSender> ActionSender::Open() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on) != 0)
    return absl::InternalError(absl::StrCat("no socket for action commands: ", std::strerror(errno)));
  return ActionSender(fd);
}

ActionSender::ActionSender(ActionSender&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), next_id_(other.next_id_) {}

ActionSender::~ActionSender() {
  if (socket_ >= 0) close(socket_);
}

absl::Status ActionSender::Send(const ActionCommand& command, const std::string& address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kGvcpPort);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1)
    return absl::InvalidArgumentError(absl::StrCat("\"", address, "\" is no IPv4 address"));
  if (next_id_ == 0) ++next_id_;  // 0 is no request id
  const std::vector<uint8_t> packet = ActionPacket(command, next_id_++);
  if (sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to) < 0)
    return absl::UnavailableError(
        absl::StrCat("action command to ", address, " was not sent: ", std::strerror(errno)));
  return absl::OkStatus();
}

}  // namespace weft

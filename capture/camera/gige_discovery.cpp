#include "capture/camera/gige_discovery.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>

#include "capture/camera/gvcp.h"

namespace weft {
namespace {

std::string Text(const char* text) { return text != nullptr ? text : ""; }

constexpr uint16_t kAccessDenied = 0x8006;

// The answer to "what is in the register of the privilege?": status, 2 bytes of answer, 2 of length, 2 of
// number, value.
bool SaysControlled(const std::array<uint8_t, 16>& answer, ssize_t bytes) {
  if (bytes >= 8 && (answer[0] << 8 | answer[1]) == kAccessDenied) return true;  // exclusively
  return bytes >= 12 && answer[0] == 0 && answer[1] == 0 &&
         (answer[8] | answer[9] | answer[10] | answer[11]) != 0;
}

// Key, flag "answer", command to read a register, 4 bytes of payload, number 1, register.
constexpr std::array<uint8_t, 12> kReadPrivilege = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04,
                                                    0x00, 0x01, 0x00, 0x00, 0x0a, 0x00};

}  // namespace

std::vector<FoundCamera> FindGigeCameras() {
  arv_update_device_list();
  return KnownGigeCameras();
}

bool IsKnownToAravis(const std::string& device) {
  for (guint i = 0; i < arv_get_n_devices(); ++i)
    if (device == Text(arv_get_device_id(i)) || device == Text(arv_get_device_physical_id(i)) ||
        device == Text(arv_get_device_address(i)))
      return true;
  return false;
}

std::vector<FoundCamera> KnownGigeCameras() {
  std::vector<FoundCamera> found;
  for (guint i = 0; i < arv_get_n_devices(); ++i) {
    if (Text(arv_get_device_protocol(i)) != "GigEVision") continue;
    found.push_back({Text(arv_get_device_vendor(i)), Text(arv_get_device_model(i)),
                     Text(arv_get_device_serial_nbr(i)), Text(arv_get_device_address(i))});
  }
  return found;
}

bool IsControlled(const std::string& address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kGvcpPort);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) return false;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  constexpr timeval kAnswerTimeout{0, 250'000};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kAnswerTimeout, sizeof kAnswerTimeout);
  bool controlled = false;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    for (int tries = 0; tries < 2; ++tries) {
      if (send(fd, kReadPrivilege.data(), kReadPrivilege.size(), 0) < 0) break;
      std::array<uint8_t, 16> answer{};
      const ssize_t bytes = recv(fd, answer.data(), answer.size(), 0);
      if (bytes < 0) continue;
      controlled = SaysControlled(answer, bytes);
      break;
    }
  }
  close(fd);
  return controlled;
}

}  // namespace weft

#include "capture/camera/gige_presence.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "capture/camera/gvcp.h"

namespace weft {

GigePresence::GigePresence(const std::string& address) : last_heard_(Clock::now()) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kGvcpPort);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) return;
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0 || connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) return;
  close(socket_);
  socket_ = -1;
}

GigePresence::~GigePresence() {
  if (socket_ >= 0) close(socket_);
}

void GigePresence::Heard(Clock::time_point now) {
  last_heard_ = now;
  next_question_ = now + kAskEvery;
  unanswered_ = 0;
}

void GigePresence::Poll(Clock::time_point now) {
  if (socket_ < 0) return;
  std::array<uint8_t, 1024> answer{};
  // An error is an unreachable address: no answer.
  while (recv(socket_, answer.data(), answer.size(), 0) > 0) Heard(now);
  if (now >= next_question_) Ask(now);
}

void GigePresence::Ask(Clock::time_point now) {
  if (socket_ < 0) return;
  next_question_ = now + kAskEvery;
  if (++next_id_ == 0) ++next_id_;
  // Key, flag "answer", discovery command, no payload, number of the request.
  const std::array<uint8_t, 8> question = {0x42,
                                           0x01,
                                           0x00,
                                           0x02,
                                           0x00,
                                           0x00,
                                           static_cast<uint8_t>(next_id_ >> 8),
                                           static_cast<uint8_t>(next_id_)};
  static_cast<void>(send(socket_, question.data(), question.size(), 0));
  ++unanswered_;
}

}  // namespace weft

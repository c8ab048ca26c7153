// Is a GigE Vision camera there? Asked beside its control channel, whose requests take seconds to fail.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace weft {

// Asks by discovery commands to the camera's address, which every camera answers at any time, whoever
// controls it. Sends and looks for answers without ever waiting. Thread safety: none.
class GigePresence {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::milliseconds kAskEvery{200};     // while nothing is heard
  static constexpr std::chrono::milliseconds kSilentAfter{350};  // since it was last heard
  static constexpr std::chrono::milliseconds kGoneAfter{2500};
  static constexpr int kAskedUntilGone =
      8;  // times, without an answer: a stall of ours is no silence of the camera

  // `address`: IPv4. Where it is none, or no socket can be had, the camera always counts as there.
  explicit GigePresence(const std::string& address);
  ~GigePresence();
  GigePresence(const GigePresence&) = delete;
  GigePresence& operator=(const GigePresence&) = delete;

  // A frame came, or an answer on the control channel.
  void Heard(Clock::time_point now);
  // Asks where that is due.
  void Poll(Clock::time_point now);
  // Asks now; the answer shows in a later Poll.
  void Ask(Clock::time_point now);
  bool IsSilent(Clock::time_point now) const { return unanswered_ > 1 && now - last_heard_ >= kSilentAfter; }
  bool IsGone(Clock::time_point now) const {
    return unanswered_ >= kAskedUntilGone && now - last_heard_ >= kGoneAfter;
  }
  // It answers, or cannot be asked in this way.
  bool MayBeThere() const { return socket_ < 0 || unanswered_ == 0; }

 private:
  int socket_ = -1;  // connected to the camera
  uint16_t next_id_ = 0;
  Clock::time_point last_heard_, next_question_;
  int unanswered_ = 0;
};

}  // namespace weft

// Who may stand in the door of a server for browsers and programs.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/server/callers/fair_share.h"
#include "services/server/callers/peer_budget.h"

namespace weft {

struct DoorLimits {
  int all = 256;         // connections
  int kept = 128;        // of them, for those that showed whose they are
  int of_one_peer = 96;  // strangers of one peer, or connections of one who is known
};

// Connections are strangers until they show a session or a token. Peers share the places of strangers
// (fair_share.h); where there is none for a newcomer, a stranger goes: the oldest of the peer that has the
// most. So nobody keeps others out by connections that say nothing. Who makes too many connections, or lets
// them time out, is kept out for a while (peer_budget.h), but for peers of whom somebody was known lately:
// all browsers behind a proxy are one peer. Thread safety: none.
class Door {
 public:
  using Time = PeerBudget::Time;
  static constexpr std::chrono::minutes kKnown{10};

  explicit Door(const DoorLimits& limits);

  struct Entry {
    uint64_t place = 0;
    std::optional<uint64_t> displaced;  // whose connection is to be ended
  };
  // None: it is refused.
  std::optional<Entry> Enter(const std::string& peer, Time now);
  // It showed whose it is. False: this one has too many, and it stays a stranger's.
  bool Recognize(uint64_t place, const std::string& account, Time now);
  // It has ended. `timed_out`: it said nothing in its time.
  void Leave(uint64_t place, bool timed_out, Time now);

  int open() const { return static_cast<int>(places_.size()); }

 private:
  struct Place {
    std::string peer, account;
    bool is_known = false;      // counts among the known
    bool is_displaced = false;  // counts no more
  };
  std::optional<uint64_t> Displace(const std::string& peer);
  bool IsKnown(const std::string& peer, Time now) const;

  FairShare strangers_, known_;
  std::map<uint64_t, Place> places_;  // oldest first
  uint64_t next_ = 1;
  PeerBudget budget_;
  std::map<std::string, Time> known_until_;  // by peer
};

}  // namespace weft

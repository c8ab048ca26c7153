// What a peer may ask of the listener before it is kept out.
#pragma once

#include <chrono>
#include <map>
#include <string>

namespace weft {

// Counts connections and offences by the names of peers. So many connections may come at once, and so many in
// a second after that; whoever offends again and again is kept out for a while. Thread safety: none.
class PeerBudget {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr double kBurst = 250;  // connections
  static constexpr double kConnections_per_s = 25;
  static constexpr int kMostViolations = 3;  // within kRemembered
  static constexpr std::chrono::seconds kRemembered{60}, kKeptOut{30};
  static constexpr size_t kMostPeers = 10'000;  // addresses of IPv6 are cheap

  // Whether a connection may come, which counts as one.
  bool Admit(const std::string& peer, Time now);
  bool IsKeptOut(const std::string& peer, Time now) const;
  // Connections of it were ended, or their calls refused too often. True: it is kept out from now on.
  bool Violate(const std::string& peer, int offences, Time now);

 private:
  struct Account {
    double connections = kBurst;  // that may come now
    Time filled{};
    int offences = 0;
    Time offended{}, kept_out_until{};
  };
  Account& AccountOf(const std::string& peer, Time now);

  std::map<std::string, Account> accounts_;
};

}  // namespace weft

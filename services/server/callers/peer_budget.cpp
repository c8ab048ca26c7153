#include "services/server/callers/peer_budget.h"

#include <algorithm>

namespace weft {

PeerBudget::Account& PeerBudget::AccountOf(const std::string& peer, Time now) {
  if (accounts_.size() >= kMostPeers && !accounts_.contains(peer)) {
    std::erase_if(accounts_, [now](const auto& known) {
      return now >= known.second.kept_out_until && now - known.second.filled > kRemembered;
    });
    // A flood of addresses: who is kept out stays so, the others begin anew.
    if (accounts_.size() >= kMostPeers)
      std::erase_if(accounts_, [now](const auto& known) { return now >= known.second.kept_out_until; });
    if (accounts_.size() >= kMostPeers) accounts_.clear();
  }
  const auto [known, is_new] = accounts_.try_emplace(peer);
  Account& account = known->second;
  if (!is_new) {
    const double passed_s = std::chrono::duration<double>(now - account.filled).count();
    account.connections = std::min(kBurst, account.connections + kConnections_per_s * passed_s);
  }
  account.filled = now;
  if (now - account.offended > kRemembered) account.offences = 0;
  return account;
}

bool PeerBudget::Admit(const std::string& peer, Time now) {
  Account& account = AccountOf(peer, now);
  if (now < account.kept_out_until || account.connections < 1) return false;
  account.connections -= 1;
  return true;
}

bool PeerBudget::IsKeptOut(const std::string& peer, Time now) const {
  const auto known = accounts_.find(peer);
  return known != accounts_.end() && now < known->second.kept_out_until;
}

bool PeerBudget::Violate(const std::string& peer, int offences, Time now) {
  Account& account = AccountOf(peer, now);
  account.offences += offences;
  account.offended = now;
  if (account.offences < kMostViolations) return false;
  account.offences = 0;
  account.kept_out_until = now + kKeptOut;
  return true;
}

}  // namespace weft

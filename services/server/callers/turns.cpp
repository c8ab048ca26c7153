#include "services/server/callers/turns.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "services/server/callers/caller.h"

namespace weft {

size_t Turns::Next(const std::vector<std::string>& waiting) {
  // Who is idle and owes nothing is as good as new.
  std::erase_if(accounts_, [this](const auto& entry) {
    return entry.second.running == 0 && entry.second.served <= least_served_;
  });
  size_t next = 0;
  std::tuple<int, double> least{std::numeric_limits<int>::max(), 0};
  double least_served = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < waiting.size(); ++i) {
    Account& account = accounts_[AccountOf(waiting[i])];
    account.served = std::max(account.served, least_served_);
    least_served = std::min(least_served, account.served);
    if (const std::tuple<int, double> own{account.running, account.served}; own < least) {
      least = own;
      next = i;
    }
  }
  least_served_ = std::max(least_served_, least_served);
  return next;
}

void Turns::Begin(const std::string& caller_name) { ++accounts_[AccountOf(caller_name)].running; }

int Turns::Running(const std::string& caller_name) const {
  const auto found = accounts_.find(AccountOf(caller_name));
  return found == accounts_.end() ? 0 : found->second.running;
}

void Turns::End(const std::string& caller_name, double served) {
  Account& account = accounts_[AccountOf(caller_name)];
  account.running = std::max(0, account.running - 1);
  account.served = std::max(account.served, least_served_) + std::max(0.0, served);
}

}  // namespace weft

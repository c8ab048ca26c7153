#include "services/server/callers/turn_gate.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "services/server/callers/caller.h"

namespace weft {

TurnGate::Pass TurnGate::Enter(const std::string& caller_name) {
  const std::string account = AccountOf(caller_name);
  Waiting self{account};
  MutexLock lock(mutex_);
  waiting_.push_back(&self);
  AdmitWaiting();
  admitted_.wait(lock, [&self] { return self.admitted; });
  lock.unlock();
  return {*this, account};
}

void TurnGate::Leave(const std::string& account, std::chrono::steady_clock::duration stayed) {
  const MutexLock lock(mutex_);
  turns_.End(account, std::chrono::duration<double>(stayed).count());
  --inside_;
  AdmitWaiting();
}

void TurnGate::AdmitWaiting() {
  while (inside_ < at_once_) {
    std::vector<Waiting*> may_enter;
    std::ranges::copy_if(waiting_, std::back_inserter(may_enter),
                         [this](const Waiting* waiting) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
                           return turns_.Running(waiting->account) < of_one_caller_;
                         });
    if (may_enter.empty()) break;
    std::vector<std::string> accounts;
    for (const Waiting* waiting : may_enter) accounts.push_back(waiting->account);
    Waiting* next = may_enter[turns_.Next(accounts)];
    turns_.Begin(next->account);
    ++inside_;
    next->admitted = true;
    waiting_.remove(next);
  }
  admitted_.notify_all();
}

}  // namespace weft

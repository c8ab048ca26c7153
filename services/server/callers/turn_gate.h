// Where calls of many callers wait for the same few places.
#pragma once

#include <chrono>
#include <condition_variable>
#include <list>
#include <string>

#include "base/mutex.h"
#include "services/server/callers/turns.h"

namespace weft {

// Lets so many in at once, of one caller's account fewer. Who waits is let in by Turns. Thread safety: any
// thread.
class TurnGate {
 public:
  TurnGate(int at_once, int of_one_caller) : at_once_(at_once), of_one_caller_(of_one_caller) {}

  // A place, until it goes out of scope.
  class Pass {
   public:
    Pass(TurnGate& gate, std::string account) : gate_(gate), account_(std::move(account)) {}
    ~Pass() { gate_.Leave(account_, std::chrono::steady_clock::now() - entered_); }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;

   private:
    TurnGate& gate_;
    const std::string account_;
    const std::chrono::steady_clock::time_point entered_ = std::chrono::steady_clock::now();
  };

  // Waits for a place.
  [[nodiscard]] Pass Enter(const std::string& caller_name);

 private:
  struct Waiting {
    const std::string& account;
    bool admitted = false;
  };

  void Leave(const std::string& account, std::chrono::steady_clock::duration stayed);
  void AdmitWaiting() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const int at_once_, of_one_caller_;
  Mutex mutex_;
  std::condition_variable_any admitted_;
  std::list<Waiting*> waiting_ ABSL_GUARDED_BY(mutex_);  // the first came first
  int inside_ ABSL_GUARDED_BY(mutex_) = 0;
  Turns turns_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft

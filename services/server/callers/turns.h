// Whose turn it is, where callers wait for the same workers.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace weft {

// The next is who has the fewest running; of those who was served least; of those the first. What somebody
// was served counts from when they began to wait, so that who comes back has neither debts nor savings:
// start-time fair queueing (Goyal, Vin, Cheng, IEEE/ACM Transactions on Networking 5(5), 1997). Thread
// safety: none.
class Turns {
 public:
  // The index of one of `waiting`, the names of callers, which are not empty. They may be named repeatedly.
  size_t Next(const std::vector<std::string>& waiting);
  void Begin(const std::string& caller_name);
  int Running(const std::string& caller_name) const;
  // What began has ended, after so much service, e.g. in seconds.
  void End(const std::string& caller_name, double served);

 private:
  struct Account {
    int running = 0;
    double served = 0;
  };
  std::map<std::string, Account> accounts_;
  double least_served_ = 0;  // of those who waited last
};

}  // namespace weft

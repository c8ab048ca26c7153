// A call that has ended, for those who count them.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "services/server/access/methods.h"

namespace weft {

struct ObservedCall {
  Method method;
  std::string outcome;                   // "OK", or the category of the error
  std::chrono::duration<double> lasted;  // zero: it was refused before it began
};

// Told of each; called by many threads at once.
using CallEnded = std::function<void(const ObservedCall& call)>;

}  // namespace weft

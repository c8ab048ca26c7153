// A machine or user that has no further threads or processes for the moment: EAGAIN of clone(2).
#pragma once

#include <exception>
#include <string_view>

#include "absl/status/status.h"

namespace weft {

// ResourceExhausted, with what to do where it lasts.
absl::Status NoFurtherThreads();

// Whether this exception says so, as std::thread throws it.
bool IsLackOfThreads(const std::exception& error);

// Whether a message says so: NoFurtherThreads, a program that could not be started, or the last words of one
// that ended over it, with the C library's text of the error.
bool IsLackOfThreads(std::string_view message);

}  // namespace weft

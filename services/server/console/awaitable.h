// Boost.Asio's coroutines, whose header of 1.74 needs another one before it. GCC 12 destroys temporaries
// twice that are made in one part of &&, || or ?: of an expression with co_await: name them before.
#pragma once

// clang-format off
#include <utility>
#include <boost/asio/awaitable.hpp>
// clang-format on

// The host's clocks.
#pragma once

#include <cstdint>
#include <string>

namespace weft {

// CLOCK_REALTIME: since 1970.
int64_t HostTime_ns();

// CLOCK_MONOTONIC, in which drivers date frames.
int64_t MonotonicTime_ns();

// The time now, in UTC: "2026-11-23T04:05:06Z".
std::string UtcText();

// As part of a file's name, whose order is that of time: "20261123-040506".
std::string UtcFileName();

}  // namespace weft

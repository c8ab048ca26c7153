// Which GigE Vision cameras answer.
#pragma once

#include <string>
#include <vector>

namespace weft {

struct FoundCamera {
  std::string vendor, model, serial, address;
};

// Asks on every network interface; takes about a second. Thread safety: none, Aravis keeps one list.
std::vector<FoundCamera> FindGigeCameras();

}  // namespace weft

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

// Whether a program controls the camera at this address, this one included: its Control Channel Privilege
// register (GigE Vision 2.0, bootstrap registers), which answers to anybody. False where it says nothing
// within half a second.
bool IsControlled(const std::string& address);

}  // namespace weft

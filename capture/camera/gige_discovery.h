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

// Those that were found before, at once.
std::vector<FoundCamera> KnownGigeCameras();
// Among those, one has this name in Aravis's own way: address, MAC, user's name, vendor and serial number.
bool IsKnownToAravis(const std::string& device);

// Whether a program controls the camera at this address, this one included: its Control Channel Privilege
// register (GigE Vision 2.0, bootstrap registers), which answers to anybody. False where it says nothing
// within half a second.
bool IsControlled(const std::string& address);

}  // namespace weft

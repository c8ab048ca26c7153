// Cameras that only one of rig and recording has.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace weft {

// Finds cameras by their names, as systems and people vary them.
class CameraNames {
 public:
  explicit CameraNames(const std::vector<std::string>& ids);

  // The position of the camera of that name: exactly, else as Unicode compares it (NFC), else but for the
  // case where one camera alone fits. -1: none.
  int Find(const std::string& name) const;

 private:
  std::map<std::string, int> exact_, composed_, caseless_;  // -1: several
};

struct CameraMatch {
  size_t of_rig = 0;                        // cameras of the rig
  size_t of_recording = 0;                  // cameras of the recording
  std::vector<std::string> without_images;  // in the rig, not in the recording
  std::vector<std::string> without_model;   // in the recording, not in the rig
};

// A line for each of the two kinds, naming the first cameras and counting the rest, and one for names that
// differ in zeros alone; empty where all match.
std::vector<std::string> CameraWarnings(const CameraMatch& match, const std::string& recording);

// "c01, c02, c03 and 5 more".
std::string FirstNames(const std::vector<std::string>& names);

}  // namespace weft

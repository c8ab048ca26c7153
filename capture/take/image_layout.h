// Whether the folders of a dump are its frames or its cameras, by their names.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "capture/rig/camera_match.h"

namespace weft {

enum class ImageLayout {
  kFolderPerFrame,   // <frame>/<camera>.png
  kFolderPerCamera,  // <camera>/<frame>.png
};

struct LayoutJudgement {
  ImageLayout layout = ImageLayout::kFolderPerFrame;
  std::string why;       // in words; empty where it is the expected layout, and certain
  bool is_open = false;  // names fit both
};

// `folders`, `files`: names of folders with pictures, and of the pictures without endings. A rig decides by
// its cameras, else names do: words for cameras ("cam3", "left") and frames ("frame_12"), numbers with
// leading zeros. Where these fit both, a folder is a frame.
LayoutJudgement JudgeLayout(const std::set<std::string>& folders, const std::set<std::string>& files,
                            const CameraNames* rig);

// The rig's camera of a folder by its name, with or without "cam" before it: "3", "cam3" or "cam_3"; -1:
// none.
int CameraOfFolderName(const CameraNames& rig, const std::string& folder);

}  // namespace weft

// What image files a folder holds, by frame and camera.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "base/natural_order.h"
#include "capture/rig/rig.h"

namespace weft {

struct ImageFolder {
  // [frame][camera id]: path, frames in the order of their names, numbers by value.
  std::map<std::string, std::map<std::string, std::string>, NaturalOrder> frames;
  // In words: what was left out, and how names were taken that leave a choice.
  std::vector<std::string> notes;
};

enum class UnfitNames { kRefuse, kLeaveOut };

// Finds <folder>/<frame>/<camera>.(png|jpg|jpeg|tif|tiff) and <folder>/cam<camera>/image<frame>.png, also
// <folder>/<camera>/<frame>.png where names tell (image_layout.h). Notes say each of these:
// - files and folders of other programs (picture_names.h) are left out;
// - copies, "c01 (1).png" beside c01.png (picture_copies.h), are left out;
// - names are compared as NFC; a rig's camera is also found where case differs;
// - frames whose numbers differ in leading zeros alone are one, if no camera has pictures in both;
// - of several files of one camera in a frame, the one of the rig's size is taken, without a rig the clearly
//   larger one;
// - pictures with an orientation tag are read as they are stored.
// Where all pictures repeat the name of their folder, c01/c01_0007.png, it is no part of theirs.
// Where a rig is given, a folder cam<x> is one of a camera only if the rig knows it. Names become ids of
// frames and cameras, so they must be plain text (capture/file/plain_text.h); with kLeaveOut, others are left
// out with a note. InvalidArgument: such a name, or several files of a camera of which none is the one.
// NotFound, PermissionDenied.
absl::StatusOr<ImageFolder> ListImageFolder(const std::string& folder, const Rig* rig = nullptr,
                                            UnfitNames unfit_names = UnfitNames::kRefuse);

}  // namespace weft

// Names in folders of images: which are pictures, and which are other programs'.
#pragma once

#include <string_view>

namespace weft {

// Ends in .png, .jpg, .jpeg, .tif or .tiff, in capitals or not.
bool IsPictureName(std::string_view name);

// A picture of a kind that is not read (.bmp, .webp, .exr, camera raw ...), or one that was not finished
// (".png.tmp").
bool IsUnreadPictureName(std::string_view name);

// Of what other programs and systems put beside files: hidden names (".thumbnails", "._c00.png" of macOS),
// folders of storage systems ("@eaDir" of Synology, "#recycle"), of Windows and of file systems
// ("lost+found").
bool IsForeignName(std::string_view name);

}  // namespace weft

#include "capture/take/picture_names.h"

#include <algorithm>
#include <array>

#include "absl/strings/match.h"

namespace weft {
namespace {

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }

template <size_t kCount>
bool EndsWithAny(std::string_view name, const std::array<const char*, kCount>& endings) {
  return std::any_of(endings.begin(), endings.end(),
                     [name](const char* ending) { return absl::EndsWithIgnoreCase(View(name), ending); });
}

}  // namespace

bool IsPictureName(std::string_view name) {
  constexpr std::array kEndings = {".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  return EndsWithAny(name, kEndings);
}

bool IsUnreadPictureName(std::string_view name) {
  constexpr std::array kEndings = {".bmp", ".dib", ".gif", ".webp", ".heic", ".heif", ".avif",
                                   ".jxl", ".jp2", ".j2k", ".exr",  ".hdr",  ".dng",  ".cr2",
                                   ".cr3", ".nef", ".arw", ".raf",  ".rw2",  ".orf",  ".raw",
                                   ".pgm", ".ppm", ".pnm", ".tga",  ".psd",  ".dpx"};
  constexpr std::array kUnfinished = {".tmp", ".part", ".partial", ".crdownload", ".filepart"};
  for (const char* ending : kUnfinished)
    if (absl::EndsWithIgnoreCase(View(name), ending))
      return IsPictureName(name.substr(0, name.size() - std::string_view(ending).size()));
  return EndsWithAny(name, kEndings);
}

bool IsForeignName(std::string_view name) {
  // Synology, QNAP, NetApp, macOS on other disks, Windows, ext4, viewers of pictures.
  constexpr std::array kNames = {"@eaDir",
                                 "@tmp",
                                 "@sharebin",
                                 "#recycle",
                                 "#snapshot",
                                 "@Recycle",
                                 "@Recently-Snapshot",
                                 "~snapshot",
                                 "__MACOSX",
                                 "Thumbs.db",
                                 "desktop.ini",
                                 "$RECYCLE.BIN",
                                 "RECYCLER",
                                 "lost+found",
                                 "Network Trash Folder",
                                 "Temporary Items",
                                 "System Volume Information"};
  if (!name.empty() && name.front() == '.') return true;
  return std::any_of(kNames.begin(), kNames.end(),
                     [name](const char* known) { return absl::EqualsIgnoreCase(View(name), known); });
}

}  // namespace weft

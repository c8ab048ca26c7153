// Chapters: files of one recording that a GoPro ends every 4 GB, and goes on with in the next one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace weft {

// GX010042.MP4, GX020042.MP4, ... (GH, GX, GS, GL), or GOPR0042.MP4, GP010042.MP4, ... of HERO5 and before.
struct Chapter {
  std::string recording;  // the same for all of them
  int number = 0;         // rising
};

// Of a file's name without folder, in capital or small letters; nothing for other names.
std::optional<Chapter> ChapterOf(const std::string& name);

// Names of the files in the folder of `path` that go on where it ends, in their order.
std::vector<std::string> ChaptersAfter(const std::string& path);

// InvalidArgument: two of the files are chapters of one recording, not of two cameras; names them and a
// remedy.
absl::Status CheckChapters(const std::vector<std::string>& paths);

// What is to be said of a file with which others go on; empty for others.
std::string ChaptersText(const std::string& path);

}  // namespace weft

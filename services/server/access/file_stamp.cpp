#include "services/server/access/file_stamp.h"

#include <sys/stat.h>

#include "absl/strings/str_cat.h"

namespace weft {

std::string FileStamp(const std::string& path) {
  struct stat file = {};
  if (stat(path.c_str(), &file) != 0) return "none";
  return absl::StrCat(file.st_ino, " ", file.st_size, " ", file.st_mode, " ", file.st_mtim.tv_sec, ".",
                      file.st_mtim.tv_nsec);
}

}  // namespace weft

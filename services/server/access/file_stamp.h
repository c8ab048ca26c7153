// Whether a file changed.
#pragma once

#include <string>

namespace weft {

// Differs after every write of the file, and when another one takes its name.
std::string FileStamp(const std::string& path);

}  // namespace weft

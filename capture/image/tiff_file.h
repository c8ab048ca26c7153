// A TIFF file for libtiff, in memory or on the disk. Errors are kept, warnings (odd tags) are not.
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace weft {

// What libtiff reads, or writes to. Not copied while a file is open on it.
struct TiffMemory {
  std::vector<uint8_t> written;
  const uint8_t* data = nullptr;  // of what is read
  uint64_t size = 0;
  uint64_t position = 0;
  bool writes = false;
  std::string problem;  // the first that libtiff names
};

struct TiffClose {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, TiffClose>;

// Null: see problem. `memory` outlives the handle.
TiffHandle OpenTiff(TiffMemory& memory);

// A file on the disk, of which libtiff reads what it is asked for. Of `memory`, the problem alone is used.
TiffHandle OpenTiffFile(const std::string& path, TiffMemory& memory);

}  // namespace weft

#include "capture/image/tiff_file.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace weft {
namespace {

// A damaged file may ask for more; an image of the largest size that is read takes 2 GiB.
constexpr tmsize_t kMostAllocationBytes = tmsize_t{4} << 30;

TiffMemory& MemoryOf(thandle_t handle) { return *static_cast<TiffMemory*>(handle); }

uint64_t SizeOf(const TiffMemory& memory) { return memory.writes ? memory.written.size() : memory.size; }

tmsize_t Read(thandle_t handle, void* out, tmsize_t size) {
  TiffMemory& memory = MemoryOf(handle);
  const uint64_t end = SizeOf(memory);
  if (memory.position >= end) return 0;
  const uint64_t count = std::min<uint64_t>(static_cast<uint64_t>(size), end - memory.position);
  std::memcpy(out, (memory.writes ? memory.written.data() : memory.data) + memory.position, count);
  memory.position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t Write(thandle_t handle, void* in, tmsize_t size) {
  TiffMemory& memory = MemoryOf(handle);
  if (!memory.writes) return 0;
  const uint64_t end = memory.position + static_cast<uint64_t>(size);
  if (end > memory.written.size()) memory.written.resize(end);
  std::memcpy(memory.written.data() + memory.position, in, static_cast<size_t>(size));
  memory.position = end;
  return size;
}

toff_t Seek(thandle_t handle, toff_t offset, int whence) {
  TiffMemory& memory = MemoryOf(handle);
  const uint64_t from = whence == SEEK_CUR ? memory.position : whence == SEEK_END ? SizeOf(memory) : 0;
  return memory.position = from + offset;
}

int Close(thandle_t) { return 0; }

// libtiff reads in place.
int Map(thandle_t handle, void** data, toff_t* size) {
  const TiffMemory& memory = MemoryOf(handle);
  if (memory.writes) return 0;
  *data = const_cast<uint8_t*>(memory.data);
  *size = memory.size;
  return 1;
}

void Unmap(thandle_t, void*, toff_t) {}

toff_t SizeOfMemory(thandle_t handle) { return SizeOf(MemoryOf(handle)); }

int KeepError(TIFF*, void* data, const char*, const char* format, va_list arguments) {
  std::string& problem = static_cast<TiffMemory*>(data)->problem;
  if (!problem.empty()) return 1;
  char text[256];
  std::vsnprintf(text, sizeof(text), format, arguments);
  problem = text;
  return 1;
}

int DropWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

// Freed by the caller.
TIFFOpenOptions* OptionsOf(TiffMemory& memory) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, kMostAllocationBytes);
  TIFFOpenOptionsSetErrorHandlerExtR(options, KeepError, &memory);
  TIFFOpenOptionsSetWarningHandlerExtR(options, DropWarning, &memory);
  return options;
}

}  // namespace

TiffHandle OpenTiff(TiffMemory& memory) {
  TIFFOpenOptions* options = OptionsOf(memory);
  TiffHandle tiff(TIFFClientOpenExt("memory", memory.writes ? "w" : "r", &memory, Read, Write, Seek, Close,
                                    SizeOfMemory, Map, Unmap, options));
  TIFFOpenOptionsFree(options);
  return tiff;
}

TiffHandle OpenTiffFile(const std::string& path, TiffMemory& memory) {
  TIFFOpenOptions* options = OptionsOf(memory);
  // Not mapped: somebody may cut the file meanwhile.
  TiffHandle tiff(TIFFOpenExt(path.c_str(), "rm", options));
  TIFFOpenOptionsFree(options);
  return tiff;
}

}  // namespace weft

// Numbers in the body of a binary PLY file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "services/formats/files/ply_header.h"

namespace weft {

template <typename T>
double LoadPlyNumber(const char* bytes, bool swap) {
  char raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (swap) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return static_cast<double>(value);
}

// PlyTypeSize(type) bytes; `swap`: in another order than this machine's.
inline double LoadPlyValue(PlyType type, const char* bytes, bool swap) {
  switch (type) {
    case PlyType::kInt8:
      return LoadPlyNumber<int8_t>(bytes, swap);
    case PlyType::kUint8:
      return LoadPlyNumber<uint8_t>(bytes, swap);
    case PlyType::kInt16:
      return LoadPlyNumber<int16_t>(bytes, swap);
    case PlyType::kUint16:
      return LoadPlyNumber<uint16_t>(bytes, swap);
    case PlyType::kInt32:
      return LoadPlyNumber<int32_t>(bytes, swap);
    case PlyType::kUint32:
      return LoadPlyNumber<uint32_t>(bytes, swap);
    case PlyType::kFloat32:
      return LoadPlyNumber<float>(bytes, swap);
    case PlyType::kFloat64:
      return LoadPlyNumber<double>(bytes, swap);
  }
  return 0;
}

}  // namespace weft

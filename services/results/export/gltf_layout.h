// What is where in the binary part of a glTF file, and the JSON that tells it. For glb_writer.cpp alone.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <string>
#include <vector>

namespace weft {

// How the binary part of a glTF file is stored.
enum class GltfStorage {
  kPlain,
  kMeshopt,  // EXT_meshopt_compression
};

// Collects views and accessors, one after another; each accessor has a view of its own.
class GltfLayout {
 public:
  // `block_bytes`: with kMeshopt, the size of each compressed view as far as it is known.
  GltfLayout(GltfStorage storage, const std::vector<uint64_t>& block_bytes)
      : storage_(storage), block_bytes_(block_bytes) {}

  struct Values {
    int type = TINYGLTF_TYPE_SCALAR;
    int component = TINYGLTF_COMPONENT_TYPE_FLOAT;
    size_t count = 0;
    int target = 0;
    bool is_rounded = false;              // with kMeshopt, filtered as RoundForMeshopt does
    std::vector<double> least, greatest;  // of each component, or empty
  };
  // The number of the image, which is a PNG file. Before the first Add: images begin the binary part.
  int AddPicture(const std::string& name, uint64_t bytes);
  // The number of the accessor.
  int Add(Values values);
  // Bytes without compression.
  uint64_t plain_bytes() const { return plain_bytes_; }
  // At most, as they are stored.
  uint64_t MaxStoredBytes() const { return max_stored_bytes_; }

  // Of `model`, with views, accessors and buffers. `stored_bytes`: of the binary part.
  std::string Json(uint64_t stored_bytes);

  tinygltf::Model model;

 private:
  GltfStorage storage_;
  std::vector<uint64_t> block_bytes_;
  uint64_t plain_bytes_ = 0, stored_offset_ = 0, max_stored_bytes_ = 0;
};

// The compressed bytes of a view; views are stored at multiples of four bytes. `stride`: bytes of a value.
// Indices are triangles.
std::string CompressIndices(const std::vector<uint32_t>& indices, size_t vertices);
std::string CompressValues(const void* values, size_t count, size_t stride);
// Vectors of three floats as the exponential filter of meshopt stores them; `vectors` become what readers
// decode. meshoptimizer 0.18 lets no exponent fall below that of 1: errors are up to 2^-17 for components
// below 1, and 2^-16 of the longest component beyond.
std::vector<uint32_t> RoundForMeshopt(std::vector<float>& vectors);

}  // namespace weft

#include "services/results/export/gltf_layout.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <limits>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace weft {
namespace {

constexpr char kMeshoptName[] = "EXT_meshopt_compression";
constexpr int kMantissaBits = 17;
constexpr int kIndexCodec = 1, kVertexCodec = 0;  // of the extension
// What tinygltf makes of a buffer whose bytes it does not hold.
constexpr char kEmptyBuffer[] = R"({"byteLength":0,"uri":"data:application/octet-stream;base64,"})";

uint64_t Padded(uint64_t bytes) { return (bytes + 3) / 4 * 4; }

tinygltf::Value WholeNumber(uint64_t value) {
  return value <= static_cast<uint64_t>(std::numeric_limits<int>::max())
             ? tinygltf::Value(static_cast<int>(value))
             : tinygltf::Value(static_cast<double>(value));
}

}  // namespace

int GltfLayout::AddPicture(const std::string& name, uint64_t bytes) {
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = max_stored_bytes_;
  view.byteLength = bytes;
  stored_offset_ += Padded(bytes);
  max_stored_bytes_ += Padded(bytes);
  if (storage_ == GltfStorage::kPlain) plain_bytes_ += Padded(bytes);
  tinygltf::Image image;
  image.name = name;
  image.mimeType = "image/png";
  image.bufferView = static_cast<int>(model.bufferViews.size());
  model.bufferViews.push_back(std::move(view));
  model.images.push_back(std::move(image));
  return static_cast<int>(model.images.size()) - 1;
}

int GltfLayout::Add(Values values) {
  const auto stride = static_cast<size_t>(tinygltf::GetComponentSizeInBytes(values.component)) *
                      static_cast<size_t>(tinygltf::GetNumComponentsInType(values.type));
  tinygltf::BufferView view;
  view.byteLength = values.count * stride;
  view.byteOffset = plain_bytes_;
  view.target = values.target;
  view.buffer = 0;
  if (storage_ == GltfStorage::kMeshopt) {
    const bool are_indices = values.target == TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER;
    const size_t number = model.bufferViews.size() - model.images.size();  // which are not compressed
    const bool is_known = number < block_bytes_.size();
    const uint64_t bytes = is_known ? block_bytes_[number] : std::numeric_limits<uint32_t>::max();
    tinygltf::Value::Object block;
    block["buffer"] = tinygltf::Value(0);
    block["byteOffset"] = WholeNumber(is_known ? stored_offset_ : std::numeric_limits<uint32_t>::max());
    block["byteLength"] = WholeNumber(bytes);
    block["byteStride"] = WholeNumber(stride);
    block["count"] = WholeNumber(values.count);
    block["mode"] = tinygltf::Value(std::string(are_indices ? "TRIANGLES" : "ATTRIBUTES"));
    if (values.is_rounded) block["filter"] = tinygltf::Value(std::string("EXPONENTIAL"));
    tinygltf::Value::Object extension;
    extension[kMeshoptName] = tinygltf::Value(std::move(block));
    view.extras = tinygltf::Value(std::move(extension));
    view.buffer = 1;  // what readers without the extension would need
    stored_offset_ += Padded(bytes);
    max_stored_bytes_ += Padded(are_indices ? meshopt_encodeIndexBufferBound(values.count, values.count)
                                            : meshopt_encodeVertexBufferBound(values.count, stride));
  } else {
    max_stored_bytes_ += view.byteLength;
  }
  plain_bytes_ += view.byteLength;
  tinygltf::Accessor accessor;
  accessor.bufferView = static_cast<int>(model.bufferViews.size());
  accessor.componentType = values.component;
  accessor.count = values.count;
  accessor.type = values.type;
  accessor.minValues = std::move(values.least);
  accessor.maxValues = std::move(values.greatest);
  model.bufferViews.push_back(std::move(view));
  model.accessors.push_back(std::move(accessor));
  return static_cast<int>(model.accessors.size()) - 1;
}

std::string GltfLayout::Json(uint64_t stored_bytes) {
  model.buffers.assign(1, {});
  std::string buffers = absl::StrCat("{\"byteLength\":", stored_bytes, "}");
  if (storage_ == GltfStorage::kMeshopt) {
    model.extensionsUsed = model.extensionsRequired = {kMeshoptName};
    absl::StrAppend(&buffers, ",{\"byteLength\":", plain_bytes_, ",\"extensions\":{\"", kMeshoptName,
                    "\":{\"fallback\":true}}}");
  }
  std::ostringstream text;
  tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, text, false, false);
  // tinygltf writes no extensions of views.
  const std::string extension = absl::StrCat("{\"", kMeshoptName);
  std::string json = absl::StrReplaceAll(
      text.str(), {{kEmptyBuffer, buffers},
                   {absl::StrCat("\"extras\":", extension), absl::StrCat("\"extensions\":", extension)}});
  while (!json.empty() && json.back() == '\n') json.pop_back();
  return json;
}

std::string CompressIndices(const std::vector<uint32_t>& indices, size_t vertices) {
  meshopt_encodeIndexVersion(kIndexCodec);
  std::vector<unsigned char> bytes(meshopt_encodeIndexBufferBound(indices.size(), vertices));
  const size_t size = meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(), indices.size());
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

std::string CompressValues(const void* values, size_t count, size_t stride) {
  meshopt_encodeVertexVersion(kVertexCodec);
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(count, stride));
  const size_t size = meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values, count, stride);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

std::vector<uint32_t> RoundForMeshopt(std::vector<float>& vectors) {
  constexpr size_t kStride = 3 * sizeof(float);
  std::vector<uint32_t> filtered(vectors.size());
  meshopt_encodeFilterExp(filtered.data(), vectors.size() / 3, kStride, kMantissaBits, vectors.data());
  std::vector<uint32_t> decoded = filtered;
  meshopt_decodeFilterExp(decoded.data(), vectors.size() / 3, kStride);
  std::copy_n(reinterpret_cast<const float*>(decoded.data()), vectors.size(), vectors.begin());
  return filtered;
}

}  // namespace weft

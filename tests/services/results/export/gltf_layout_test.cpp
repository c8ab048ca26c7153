#include "services/results/export/gltf_layout.h"

#include <gmock/gmock.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(GltfLayoutTest, CompressedValuesReadBackTheSame) {
  std::vector<float> values;
  for (int i = 0; i < 300; ++i) values.push_back(std::sin(0.1F * i));
  const std::string block = CompressValues(values.data(), 100, 12);
  std::vector<float> decoded(values.size());
  ASSERT_EQ(meshopt_decodeVertexBuffer(decoded.data(), 100, 12,
                                       reinterpret_cast<const unsigned char*>(block.data()), block.size()),
            0);
  EXPECT_EQ(decoded, values);
}

TEST(GltfLayoutTest, CompressedIndicesReadBackAsTheSameTriangles) {
  const std::vector<uint32_t> indices = {0, 1, 2, 2, 1, 3, 3, 1, 4};
  const std::string block = CompressIndices(indices, 5);
  std::vector<uint32_t> decoded(indices.size());
  ASSERT_EQ(meshopt_decodeIndexBuffer(decoded.data(), decoded.size(),
                                      reinterpret_cast<const unsigned char*>(block.data()), block.size()),
            0);
  for (size_t f = 0; f < indices.size(); f += 3) {
    const auto first = indices.begin() + static_cast<std::ptrdiff_t>(f);
    const auto found = decoded.begin() + static_cast<std::ptrdiff_t>(f);
    // The first corner may be another one; the side stays.
    std::rotate(found, std::find(found, found + 3, *first), found + 3);
    EXPECT_TRUE(std::equal(first, first + 3, found));
  }
}

TEST(GltfLayoutTest, RoundingIsWithinItsBitsAndKnownBefore) {
  std::vector<float> vectors;
  for (int i = 0; i < 3000; ++i) vectors.push_back(2 * std::sin(0.37F * i * i));
  const std::vector<float> exact = vectors;
  std::vector<uint32_t> filtered = RoundForMeshopt(vectors);
  for (size_t i = 0; i < exact.size(); i += 3) {
    const float longest =
        std::max({1.0F, std::abs(exact[i]), std::abs(exact[i + 1]), std::abs(exact[i + 2])});
    for (size_t k = i; k < i + 3; ++k) EXPECT_LE(std::abs(vectors[k] - exact[k]), longest / (1 << 16));
  }
  meshopt_decodeFilterExp(filtered.data(), filtered.size() / 3, 12);
  EXPECT_TRUE(std::equal(vectors.begin(), vectors.end(), reinterpret_cast<const float*>(filtered.data())));
}

TEST(GltfLayoutTest, PicturesBeginTheBinaryPartAndStayAsTheyAre) {
  for (const GltfStorage storage : {GltfStorage::kPlain, GltfStorage::kMeshopt}) {
    GltfLayout layout(storage, {100});
    EXPECT_EQ(layout.AddPicture("albedo", 33), 0);
    EXPECT_EQ(layout.AddPicture("normal", 10), 1);
    layout.Add({.type = TINYGLTF_TYPE_VEC3, .count = 50, .target = TINYGLTF_TARGET_ARRAY_BUFFER});
    layout.model.asset.version = "2.0";
    const std::string json = layout.Json(148);
    EXPECT_THAT(json, HasSubstr(R"({"bufferView":0,"mimeType":"image/png","name":"albedo"})"));
    EXPECT_THAT(json, HasSubstr(R"({"buffer":0,"byteLength":10,"byteOffset":36})"));
    // Compressed values follow the pictures; the buffer that they stand for holds none.
    EXPECT_THAT(json, HasSubstr(storage == GltfStorage::kPlain ? R"("byteOffset":48,"target":34962)"
                                                               : R"("byteLength":100,"byteOffset":48)"));
    EXPECT_EQ(layout.plain_bytes(), storage == GltfStorage::kPlain ? 648 : 600);
  }
}

TEST(GltfLayoutTest, JsonTellsBlocksAndTheBufferThatReadersWithoutTheExtensionNeed) {
  GltfLayout layout(GltfStorage::kMeshopt, {100});
  layout.Add({.type = TINYGLTF_TYPE_VEC3, .count = 50, .target = TINYGLTF_TARGET_ARRAY_BUFFER});
  layout.model.asset.version = "2.0";
  const std::string json = layout.Json(104);
  EXPECT_THAT(json, HasSubstr(R"("buffers":[{"byteLength":104},{"byteLength":600,"extensions":)"));
  EXPECT_THAT(json, HasSubstr(R"("extensions":{"EXT_meshopt_compression":{"buffer":0,"byteLength":100)"));
  EXPECT_THAT(json, HasSubstr(R"("extensionsRequired":["EXT_meshopt_compression"])"));
  EXPECT_EQ(json.find("extras"), std::string::npos);
}

}  // namespace
}  // namespace weft

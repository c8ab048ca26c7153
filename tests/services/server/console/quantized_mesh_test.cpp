#include "services/server/console/quantized_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <array>
#include <cmath>

#include "services/formats/files/little_endian.h"
#include "services/formats/files/mesh_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr size_t kHeadBytes = 88;
constexpr int kSide = 40;

// A sheet of almost two metres with every kind of vertex, as a job writes it.
RegisteredMesh Sheet() {
  RegisteredMesh mesh;
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      mesh.vertices_mm.emplace_back(49.9 * col + 0.013 * row, 700 + 31.7 * row, 1500 + 3 * std::sin(col));
      mesh.state.push_back(static_cast<VertexState>((row + col) % 4));
      mesh.sigma_mm.push_back(col == 3 ? NAN : 0.01f * static_cast<float>(1 + col));
      mesh.views.push_back(row == 5 ? 200 : row % 20);
    }
  }
  return mesh;
}

std::vector<Face> SheetFaces() {
  std::vector<Face> faces;
  for (int row = 0; row + 1 < kSide; ++row) {
    for (int col = 0; col + 1 < kSide; ++col) {
      const int v = row * kSide + col;
      faces.push_back({v, v + 1, v + kSide});
      faces.push_back({v + 1, v + kSide + 1, v + kSide});
    }
  }
  return faces;
}

std::string BytesOf(const RegisteredMesh& mesh, const std::vector<Face>& faces) {
  const TempFolder folder;
  EXPECT_TRUE(WriteRegisteredMesh(folder / "mesh.ply", mesh, faces).ok());
  return ReadBytes(folder / "mesh.ply");
}

struct Shown {
  size_t vertices = 0, faces = 0;
  double coordinate_error_mm = 0, distance_mm = 0;
  Eigen::Vector3d step_mm, low_mm;
  std::vector<std::array<uint16_t, 4>> words;
  std::vector<std::array<uint32_t, 3>> triangles;

  Eigen::Vector3d Position(size_t v) const {
    return low_mm + step_mm.cwiseProduct(Eigen::Vector3d(words[v][0], words[v][1], words[v][2]));
  }
};

// As a page reads it.
Shown Read(const std::string& bytes) {
  Shown shown;
  EXPECT_EQ(bytes.substr(0, 8), "weftmsh1");
  std::string_view head = std::string_view(bytes).substr(8);
  shown.vertices = TakeLittleEndian<uint32_t>(head);
  shown.faces = TakeLittleEndian<uint32_t>(head);
  const auto points = TakeLittleEndian<uint32_t>(head), faces = TakeLittleEndian<uint32_t>(head);
  for (double& step : shown.step_mm) step = TakeLittleEndian<double>(head);
  for (double& low : shown.low_mm) low = TakeLittleEndian<double>(head);
  shown.coordinate_error_mm = TakeLittleEndian<double>(head);
  shown.distance_mm = TakeLittleEndian<double>(head);
  EXPECT_EQ(bytes.size(), kHeadBytes + points + faces);
  const auto* body = reinterpret_cast<const unsigned char*>(bytes.data() + kHeadBytes);
  shown.words.resize(shown.vertices);
  EXPECT_EQ(meshopt_decodeVertexBuffer(shown.words.data(), shown.vertices, 8, body, points), 0);
  shown.triangles.resize(shown.faces);
  if (faces > 0) {
    EXPECT_EQ(meshopt_decodeIndexBuffer(shown.triangles.data(), 3 * shown.faces, 4, body + points, faces), 0);
  }
  return shown;
}

TEST(QuantizedMesh, KeepsPlacesToTheStatedErrorAndWhatIsKnownOfThem) {
  const RegisteredMesh mesh = Sheet();
  const std::string ply = BytesOf(mesh, SheetFaces());
  const auto bytes = QuantizedMesh(ply, false, "mesh.ply");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Shown shown = Read(*bytes);
  ASSERT_EQ(shown.vertices, mesh.vertices_mm.size());
  EXPECT_EQ(shown.faces, 0u);
  EXPECT_LT(shown.coordinate_error_mm, 0.016);
  double farthest = 0;
  for (size_t v = 0; v < shown.vertices; ++v) {
    // mesh.ply has single precision.
    const Eigen::Vector3d written = mesh.vertices_mm[v].cast<float>().cast<double>();
    farthest = std::max(farthest, (shown.Position(v) - written).norm());
    const uint16_t traits = shown.words[v][3];
    EXPECT_EQ(traits & 3, static_cast<int>(mesh.state[v]));
    EXPECT_EQ(traits >> 2 & 63, std::min(mesh.views[v], 63));
    const int sigma = traits >> 8;
    if (std::isnan(mesh.sigma_mm[v])) {
      EXPECT_EQ(sigma, 255);
    } else {
      EXPECT_NEAR(0.001 * std::exp2(sigma / 16.0) / mesh.sigma_mm[v], 1, 0.023);
    }
  }
  EXPECT_NEAR(farthest, shown.distance_mm, 1e-5);
  EXPECT_LT(farthest, 0.02);
}

TEST(QuantizedMesh, TellsDrivenVerticesFromBridgedOnes) {
  RegisteredMesh mesh = Sheet();
  mesh.state.assign(mesh.state.size(), VertexState::kDriven);
  for (size_t v = 0; v < mesh.views.size(); ++v) mesh.views[v] = static_cast<int>(v % 2);
  mesh.state[0] = VertexState::kBridged, mesh.views[0] = 0;
  const auto bytes = QuantizedMesh(BytesOf(mesh, SheetFaces()), false, "mesh.ply");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Shown shown = Read(*bytes);
  EXPECT_EQ(shown.words[0][3] & 0xff, 3);
  for (size_t v = 1; v < shown.vertices; ++v)
    EXPECT_EQ(shown.words[v][3] & 0xff, 3 | (mesh.views[v] + 1) << 2) << v;
}

TEST(QuantizedMesh, HasTheFacesWhereTheyAreAskedFor) {
  const std::vector<Face> faces = SheetFaces();
  const auto bytes = QuantizedMesh(BytesOf(Sheet(), faces), true, "mesh.ply");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Shown shown = Read(*bytes);
  ASSERT_EQ(shown.faces, faces.size());
  for (size_t f = 0; f < faces.size(); ++f) {
    // The codec turns a triangle, but never over.
    std::array<uint32_t, 3> turned = shown.triangles[f];
    while (turned[0] != static_cast<uint32_t>(faces[f][0])) turned = {turned[1], turned[2], turned[0]};
    EXPECT_EQ(turned[1], static_cast<uint32_t>(faces[f][1]));
    EXPECT_EQ(turned[2], static_cast<uint32_t>(faces[f][2]));
  }
}

TEST(QuantizedMesh, NeedsNoByteBeyondTheVertices) {
  const std::string ply = BytesOf(Sheet(), SheetFaces());
  EXPECT_EQ(*EndOfVertices(ply.substr(0, 40), "mesh.ply"), std::nullopt);
  const auto end = EndOfVertices(ply.substr(0, 1000), "mesh.ply");
  ASSERT_TRUE(end.ok() && end->has_value()) << end.status();
  EXPECT_LT(**end, ply.size());
  EXPECT_EQ(QuantizedMesh(ply.substr(0, **end), false, "mesh.ply").value(),
            QuantizedMesh(ply, false, "mesh.ply").value());
  EXPECT_THAT(QuantizedMesh(ply.substr(0, **end - 1), false, "mesh.ply").status().message(),
              HasSubstr("mesh.ply: the vertices are cut off"));
  EXPECT_THAT(QuantizedMesh(ply.substr(0, ply.size() - 1), true, "mesh.ply").status().message(),
              HasSubstr("cut off"));
}

TEST(QuantizedMesh, SaysWhatIsWrongWithAMesh) {
  RegisteredMesh mesh = Sheet();
  EXPECT_THAT(QuantizedMesh(BytesOf(mesh, {{0, 1, kSide * kSide}}), true, "m").status().message(),
              HasSubstr("m: face 0"));
  mesh.vertices_mm[7].y() = INFINITY;
  EXPECT_THAT(QuantizedMesh(BytesOf(mesh, {}), false, "m").status().message(), HasSubstr("m: vertex 7"));
  const std::string other = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n";
  EXPECT_THAT(QuantizedMesh(other + "end_header\nabcd", false, "m").status().message(),
              HasSubstr("vertices have no y"));
  EXPECT_THAT(QuantizedMesh("no mesh", false, "m").status().message(), HasSubstr("m: "));
}

}  // namespace
}  // namespace weft

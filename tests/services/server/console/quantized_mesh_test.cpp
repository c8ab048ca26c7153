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

// Three vertices as another program may write them: columns in another order, with one of its own.
std::string OtherPly(const std::string& faces, const std::string& rows = "", float far_mm = 0,
                     double sigma_mm = 1) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar views\nproperty double "
      "sigma_mm\n"
      "property float z\nproperty short own\nproperty float y\nproperty uchar state\nproperty float x\n" +
      faces + "end_header\n";
  for (int v = 0; v < 3; ++v) {
    ply.push_back(static_cast<char>(62 + v));
    PutLittleEndian(sigma_mm, ply);
    PutLittleEndian(v == 2 ? far_mm : 5.0f, ply);
    PutLittleEndian(int16_t{-1}, ply);
    PutLittleEndian(v == 1 ? 131.07f : 0.0f, ply);
    ply.push_back(static_cast<char>(v == 0 ? 7 : v));
    PutLittleEndian(v == 2 ? 1310.7f : 0.0f, ply);
  }
  return ply + rows;
}

TEST(QuantizedMesh, ReadsColumnsByTheirNames) {
  const auto bytes = QuantizedMesh(OtherPly("", "", 5), false, "m");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Shown shown = Read(*bytes);
  EXPECT_EQ(shown.vertices, 3u);
  EXPECT_NEAR(shown.step_mm.x(), 0.02, 1e-6);  // 1310.7 mm in 65535 steps
  EXPECT_EQ(shown.step_mm.y(), 0.005);         // less would only carry noise
  EXPECT_EQ(shown.step_mm.z(), 0.005);
  EXPECT_TRUE(shown.low_mm == Eigen::Vector3d(0, 0, 5));
  EXPECT_EQ(shown.words[1][1], 26214);
  EXPECT_EQ(shown.words[2][0], 65535);
  // State 7 is shown as 3, and driven vertices have one view more; 63 or more are 63. 1 mm of sigma: ten
  // octaves above 0.001 mm, less a bit.
  EXPECT_EQ(shown.words[0][3], 159 << 8 | 63 << 2 | 3);
  EXPECT_EQ(shown.words[1][3], 159 << 8 | 63 << 2 | 1);
  EXPECT_EQ(shown.words[2][3], 159 << 8 | 63 << 2 | 2);
}

TEST(QuantizedMesh, SigmaHasItsEnds) {
  const auto sigma_of = [](double sigma_mm) {
    return Read(QuantizedMesh(OtherPly("", "", 0, sigma_mm), false, "m").value()).words[0][3] >> 8;
  };
  EXPECT_EQ(sigma_of(0), 0);
  EXPECT_EQ(sigma_of(-1), 0);
  EXPECT_EQ(sigma_of(0.001), 0);
  EXPECT_EQ(sigma_of(0.002), 16);
  EXPECT_EQ(sigma_of(1e9), 254);
  EXPECT_EQ(sigma_of(INFINITY), 255);
}

TEST(QuantizedMesh, ReadsFacesWhateverElseTheirRowsHave) {
  std::string row;
  row += std::string("\x02\x01\x01", 3);  // a list of its own
  row += std::string("\x03\x00\x01\x02", 4);
  PutLittleEndian(7.0f, row);
  const std::string faces =
      "element face 1\nproperty list uchar uchar own\nproperty list uchar uchar vertex_index\nproperty float "
      "area\n";
  const auto bytes = QuantizedMesh(OtherPly(faces, row), true, "m");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(Read(*bytes).faces, 1u);
  EXPECT_EQ(QuantizedMesh(OtherPly(faces, row.substr(0, row.size() - 1)), true, "m").status(),
            absl::InvalidArgumentError("m: face 0 is cut off or names no vertex"));
}

TEST(QuantizedMesh, SaysWhatIsWrongWithItsFaces) {
  const std::string faces = "element face 1\nproperty list uchar char vertex_indices\n";
  const auto error_of = [&](const std::string& row) {
    return std::string(QuantizedMesh(OtherPly(faces, row), true, "m").status().message());
  };
  EXPECT_EQ(error_of(std::string("\x03\x02\x01\x00", 4)), "");
  EXPECT_EQ(error_of(std::string("\x04\x00\x01\x02\x00", 5)), "m: face 0 is no triangle");
  EXPECT_EQ(error_of(std::string("\x02\x00\x01", 3)), "m: face 0 is no triangle");
  const std::string none = "m: face 0 is cut off or names no vertex";
  EXPECT_EQ(error_of(std::string("\x03\x00\x01\x03", 4)), none);
  EXPECT_EQ(error_of(std::string("\x03\x00\x01\xff", 4)), none);
  EXPECT_EQ(error_of(std::string("\x03\x00\x01", 3)), none);
  EXPECT_EQ(error_of(""), none);
  EXPECT_EQ(QuantizedMesh(OtherPly(""), true, "m").status().message(), "m: no faces after the vertices");
  EXPECT_EQ(QuantizedMesh(OtherPly("element edge 1\nproperty uchar a\n"), true, "m").status().message(),
            "m: no faces after the vertices");
}

TEST(QuantizedMesh, SaysWhatIsNoMeshOfAJob) {
  const auto error_of = [](std::string ply, const std::string& from, const std::string& to) {
    return std::string(
        QuantizedMesh(ply.replace(ply.find(from), from.size(), to), false, "m").status().message());
  };
  const std::string other = "m: not a mesh of a job: binary little-endian with vertices first is asked for";
  EXPECT_EQ(error_of(OtherPly(""), "little", "big"), other);
  EXPECT_EQ(error_of(OtherPly(""), "element vertex", "element point"), other);
  EXPECT_EQ(error_of(OtherPly(""), "vertex 3", "vertex 0"), "m: 0 vertices cannot be shown");
  EXPECT_EQ(error_of(OtherPly(""), "vertex 3", "vertex 268435457"), "m: 268435457 vertices cannot be shown");
  EXPECT_EQ(error_of(OtherPly(""), "vertex 3", "vertex 268435456"), "m: the vertices are cut off");
  EXPECT_EQ(error_of(OtherPly(""), "property uchar views", "property list uchar uchar views"),
            "m: a vertex has a list; write the mesh with weft");
  EXPECT_EQ(error_of(OtherPly(""), "uchar views", "uchar seen"), "m: vertices have no views");
  EXPECT_EQ(QuantizedMesh(OtherPly("", "", 2e9f), false, "m").status().message(), "m: vertex 2 is nowhere");
  EXPECT_TRUE(QuantizedMesh(OtherPly("", "", 9e8f), false, "m").ok());
  EXPECT_FALSE(EndOfVertices(std::string(64 << 10, 'x'), "m").ok());
  EXPECT_EQ(*EndOfVertices(std::string((64 << 10) - 1, 'x'), "m"), std::nullopt);
}

}  // namespace
}  // namespace weft

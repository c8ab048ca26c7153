#include "services/results/export/normal_map.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int kSideVertices = 129;  // vertices
constexpr double kWidth = 64;       // mm
constexpr int kMapPx = 64;
const std::vector<Face> kOutwardSquare = {{0, 1, 2}, {0, 2, 3}};  // outwards: +z
const std::vector<int> kSquareCorners = {0, kSideVertices - 1, kSideVertices* kSideVertices - 1,
                                         kSideVertices* kSideVertices - kSideVertices};

// u along x, v along y, as an artist unwraps it.
Eigen::Vector2f Upright(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

struct Sheet {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Face> faces;
  MeshTexture texture;
};

// `place` and `uv` of x and y, from 0 to 1.
template <typename Place, typename Uv>
Sheet MakeSheet(int side, Place place, Uv uv) {
  Sheet sheet;
  for (int row = 0; row < side; ++row) {
    for (int col = 0; col < side; ++col) {
      const double x = static_cast<double>(col) / (side - 1), y = static_cast<double>(row) / (side - 1);
      sheet.vertices.push_back(place(x, y));
      sheet.texture.of_vertex.push_back(uv(x, y));
    }
  }
  for (int row = 0; row + 1 < side; ++row) {
    for (int col = 0; col + 1 < side; ++col) {
      const int v = side * row + col;
      sheet.faces.push_back({v, v + 1, v + side + 1});
      sheet.faces.push_back({v, v + side + 1, v + side});
    }
  }
  return sheet;
}

// A square with a bump of 4 mm in its middle, 0 with all its slopes at the border: a (sin pi x sin pi y)^2.
double BumpMm(double x, double y) {
  return 4 * std::pow(std::sin(std::numbers::pi * x) * std::sin(std::numbers::pi * y), 2);
}
Eigen::Vector3d BumpNormal(double x, double y) {
  using std::numbers::pi;
  const double along_x = 4 * pi / kWidth * std::sin(2 * pi * x) * std::pow(std::sin(pi * y), 2);
  const double along_y = 4 * pi / kWidth * std::sin(2 * pi * y) * std::pow(std::sin(pi * x), 2);
  return Eigen::Vector3d(-along_x, -along_y, 1).normalized();
}
Eigen::Vector3d OnBump(double x, double y) { return {kWidth * x, kWidth * y, BumpMm(x, y)}; }

ReducedMesh Square(const MeshTexture& texture) {
  ReducedMesh base{kSquareCorners, kOutwardSquare, {}};
  for (const int corner : kSquareCorners) base.texture.of_vertex.push_back(texture.of_vertex[corner]);
  return base;
}

Eigen::Vector3d TexelOf(const std::vector<uint8_t>& rgb, int side_px, int x, int y) {
  const uint8_t* texel = &rgb[3 * (static_cast<size_t>(y) * side_px + x)];
  return Eigen::Vector3d(texel[0], texel[1], texel[2]) / 127.5 - Eigen::Vector3d::Ones();
}

constexpr double kStep = 1 / 127.5;  // of eight bits

TEST(NormalMapTest, HoldsABumpOnASquareInClosedForm) {
  const Sheet sheet = MakeSheet(kSideVertices, OnBump, Upright);
  const auto map = NormalMap::Make(kMapPx, sheet.faces, sheet.texture, Square(sheet.texture));
  ASSERT_TRUE(map.ok()) << map.status();
  const std::vector<uint8_t> rgb = map->Bake(sheet.vertices);
  ASSERT_EQ(rgb.size(), 3u * kMapPx * kMapPx);
  double steepest = 1;
  for (int y = 0; y < kMapPx; ++y) {
    for (int x = 0; x < kMapPx; ++x) {
      // Row 0 is at v = 1; red rises to the right and green upwards (OpenGL).
      const Eigen::Vector3d expected = BumpNormal((x + 0.5) / kMapPx, 1 - (y + 0.5) / kMapPx);
      steepest = std::min(steepest, expected.z());
      EXPECT_LE((TexelOf(rgb, kMapPx, x, y) - expected).cwiseAbs().maxCoeff(), 0.75 * kStep) << x << " " << y;
    }
  }
  EXPECT_LT(steepest, 0.99);
  // Left of the bump normals lean to the left, below it downwards.
  EXPECT_LT(TexelOf(rgb, kMapPx, kMapPx / 4, kMapPx / 2).x(), -0.1);
  EXPECT_LT(TexelOf(rgb, kMapPx, kMapPx / 2, 3 * kMapPx / 4).y(), -0.1);
}

TEST(NormalMapTest, TurnsWithThePrintAndMirrorsWithIt) {
  const auto turned = [](double x, double y) { return Upright(1 - y, x); };  // u along -y, v along x
  const auto mirrored = [](double x, double y) { return Upright(1 - x, y); };
  for (const bool mirrors : {false, true}) {
    const Sheet sheet =
        mirrors ? MakeSheet(kSideVertices, OnBump, mirrored) : MakeSheet(kSideVertices, OnBump, turned);
    const auto map = NormalMap::Make(kMapPx, sheet.faces, sheet.texture, Square(sheet.texture));
    ASSERT_TRUE(map.ok()) << map.status();
    const std::vector<uint8_t> rgb = map->Bake(sheet.vertices);
    for (int y = 0; y < kMapPx; y += 7) {
      for (int x = 0; x < kMapPx; x += 5) {
        const double u = (x + 0.5) / kMapPx, v = 1 - (y + 0.5) / kMapPx;
        const Eigen::Vector3d normal = mirrors ? BumpNormal(1 - u, v) : BumpNormal(v, 1 - u);
        const Eigen::Vector3d expected = mirrors ? Eigen::Vector3d(-normal.x(), normal.y(), normal.z())
                                                 : Eigen::Vector3d(-normal.y(), normal.x(), normal.z());
        EXPECT_LE((TexelOf(rgb, kMapPx, x, y) - expected).cwiseAbs().maxCoeff(), 0.75 * kStep);
      }
    }
  }
}

// A quarter of a tube, and its map for one with every eighth vertex; the reader computes the tangent space
// from the faces under each texel alone.
TEST(NormalMapTest, TangentsFollowUAndTellMirroredPrints) {
  const auto turned = [](double x, double y) { return Upright(1 - y, x); };
  const auto mirrored = [](double x, double y) { return Upright(1 - x, y); };
  for (const bool mirrors : {false, true}) {
    const Sheet sheet =
        mirrors ? MakeSheet(kSideVertices, OnBump, mirrored) : MakeSheet(kSideVertices, OnBump, turned);
    const auto map = NormalMap::Make(kMapPx, sheet.faces, sheet.texture, Square(sheet.texture));
    ASSERT_TRUE(map.ok()) << map.status();
    const Eigen::Vector4f expected = mirrors ? Eigen::Vector4f(-1, 0, 0, -1) : Eigen::Vector4f(0, -1, 0, 1);
    const std::vector<Eigen::Vector4f> tangents = map->Tangents(sheet.vertices);
    ASSERT_EQ(tangents.size(), kSquareCorners.size());
    for (const Eigen::Vector4f& tangent : tangents) EXPECT_LT((tangent - expected).norm(), 1e-6F);
  }
}

TEST(NormalMapTest, GivesReadersTheNormalsOfTheWholeMeshOnCurvedCloth) {
  constexpr int kWhole = 65, kStride = 8, kCoarse = 9;
  const auto bend = [](double x, double y) {
    const double radius = 40 + 0.4 * std::sin(30 * x) * std::cos(20 * y);
    const double angle = std::numbers::pi / 2 * x;
    return Eigen::Vector3d(-radius * std::cos(angle), 60 * y, radius * std::sin(angle));
  };
  const Sheet sheet = MakeSheet(kWhole, bend, Upright), shape = MakeSheet(kCoarse, bend, Upright);
  ReducedMesh base;
  base.faces = shape.faces;
  base.texture = shape.texture;
  for (int row = 0; row < kCoarse; ++row)
    for (int col = 0; col < kCoarse; ++col) base.vertices.push_back(kWhole * kStride * row + kStride * col);
  constexpr int kPx = 256;
  const auto map = NormalMap::Make(kPx, sheet.faces, sheet.texture, base);
  ASSERT_TRUE(map.ok()) << map.status();
  const std::vector<uint8_t> rgb = map->Bake(sheet.vertices);
  const auto texels = RasterizeTexture(kPx, base.faces, base.texture, "");
  const auto whole = RasterizeTexture(kPx, sheet.faces, sheet.texture, "");
  ASSERT_TRUE(texels.ok() && whole.ok());
  double with_map_deg = 0, without_deg = 0;
  int count = 0;
  const auto normal_of = [](const std::vector<Eigen::Vector3d>& v, const std::vector<Face>& faces) {
    std::vector<Eigen::Vector3d> normals(v.size(), Eigen::Vector3d::Zero());
    for (const auto& [a, b, c] : faces)
      for (const int corner : {a, b, c}) normals[corner] += (v[b] - v[a]).cross(v[c] - v[a]);
    for (Eigen::Vector3d& normal : normals) normal.normalize();
    return normals;
  };
  const auto fine = normal_of(sheet.vertices, sheet.faces), coarse = normal_of(shape.vertices, shape.faces);
  const auto angle_deg = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return 180 / std::numbers::pi * std::acos(std::min(1.0, a.normalized().dot(b.normalized())));
  };
  for (size_t t = 0; t < texels->size(); ++t) {
    const Texel &low = (*texels)[t], &high = (*whole)[t];
    ASSERT_TRUE(low.face >= 0 && high.face >= 0);
    const auto blend = [](const Texel& texel, const Face& face, const auto& values) -> Eigen::Vector3d {
      return (1.0 - texel.weight_b - texel.weight_c) * values[face[0]] + texel.weight_b * values[face[1]] +
             texel.weight_c * values[face[2]];
    };
    const Face& face = base.faces[low.face];
    const Eigen::Vector3d normal = blend(low, face, coarse).normalized();
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Matrix2d uv;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = shape.vertices[face[k + 1]] - shape.vertices[face[0]];
      uv.col(k) = (shape.texture.of_vertex[face[k + 1]] - shape.texture.of_vertex[face[0]]).cast<double>();
    }
    const Eigen::Vector3d along_u = (edges * uv.inverse()).col(0);
    const Eigen::Vector3d tangent = (along_u - normal.dot(along_u) * normal).normalized();
    const Eigen::Vector3d value = TexelOf(rgb, kPx, static_cast<int>(t % kPx), static_cast<int>(t / kPx));
    const Eigen::Vector3d shown =
        value.x() * tangent + value.y() * normal.cross(tangent) + value.z() * normal;
    const Eigen::Vector3d expected = blend(high, sheet.faces[high.face], fine);
    with_map_deg += angle_deg(shown, expected);
    without_deg += angle_deg(normal, expected);
    ++count;
  }
  EXPECT_GT(without_deg / count, 5);
  EXPECT_LT(with_map_deg / count, 0.6);
}

TEST(NormalMapTest, IsFlatOutsideTheGarmentAndWhereNothingIsMissing) {
  const auto plane = [](double x, double y) { return Eigen::Vector3d(kWidth * x, kWidth * y, 0); };
  const auto inner = [](double x, double y) { return Upright(0.25 + 0.5 * x, 0.25 + 0.5 * y); };
  const Sheet sheet = MakeSheet(kSideVertices, plane, inner);
  const auto map = NormalMap::Make(kMapPx, sheet.faces, sheet.texture, Square(sheet.texture));
  ASSERT_TRUE(map.ok()) << map.status();
  const std::vector<uint8_t> rgb = map->Bake(sheet.vertices);
  for (size_t i = 0; i < rgb.size(); i += 3)
    EXPECT_EQ((std::array{rgb[i], rgb[i + 1], rgb[i + 2]}), (std::array<uint8_t, 3>{128, 128, 255}));
}

TEST(NormalMapTest, RefusesMeshesWithoutTextureAndBasesThatLackNothing) {
  const Sheet sheet = MakeSheet(kSideVertices, OnBump, Upright);
  EXPECT_THAT(
      NormalMap::Make(kMapPx, sheet.faces, {}, {kSquareCorners, kOutwardSquare, {}}).status().message(),
      HasSubstr("no texture coordinates"));
  ReducedMesh all{{}, sheet.faces, sheet.texture};
  all.vertices.resize(sheet.vertices.size());
  EXPECT_THAT(NormalMap::Make(kMapPx, sheet.faces, sheet.texture, all).status().message(),
              HasSubstr("--max-vertices"));
}

}  // namespace
}  // namespace weft

#include "services/results/report/mesh_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "services/results/report/mesh_colors.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr double kRadiusMm = 50;
const Eigen::Vector3d kUp(0, -1, 0);

// Rings of `n` around the y axis, outside facing out.
TriangleMesh Sphere(int n) {
  TriangleMesh mesh;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double a = M_PI * i / n, b = 2 * M_PI * j / n;
      mesh.vertices_mm.push_back(
          kRadiusMm * Eigen::Vector3d(std::sin(a) * std::cos(b), -std::cos(a), std::sin(a) * std::sin(b)));
      if (i == n) continue;
      const int here = i * n + j, next = i * n + (j + 1) % n;
      mesh.faces.push_back({here, here + n, next});
      mesh.faces.push_back({next, here + n, next + n});
    }
  }
  return mesh;
}

// An upright square of the given half width at depth z, facing a viewer who looks along +z.
void AddSquare(double half_mm, double z_mm, TriangleMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices_mm.size());
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    mesh.vertices_mm.emplace_back(half_mm * x, half_mm * y, z_mm);
  }
  mesh.faces.push_back({first, first + 3, first + 2});
  mesh.faces.push_back({first, first + 2, first + 1});
}

std::array<int, 4> PixelAt(const MeshView& view, int x, int y) {
  const uint8_t* p = &view.rgba[(static_cast<size_t>(y) * view.width_px + x) * 4];
  return {p[0], p[1], p[2], p[3]};
}

MeshView Render(const TriangleMesh& mesh, const std::vector<Eigen::Vector3f>& colors, MeshSide side,
                const MeshViewOptions& options = {}) {
  const absl::StatusOr<Viewpoint> viewpoint = ViewpointOf(mesh.vertices_mm, side, kUp);
  EXPECT_TRUE(viewpoint.ok()) << viewpoint.status();
  absl::StatusOr<MeshView> view = RenderMesh(mesh, colors, *viewpoint, options);
  EXPECT_TRUE(view.ok()) << view.status();
  return *std::move(view);
}

TEST(MeshView, SphereCoversItsCircle) {
  const TriangleMesh sphere = Sphere(128);
  const MeshView view = Render(sphere, PlainColors(sphere.vertices_mm.size()), MeshSide::kFront);
  double covered_px = 0;
  for (size_t i = 3; i < view.rgba.size(); i += 4) covered_px += view.rgba[i] / 255.0;
  const double expected_px = M_PI * std::pow(kRadiusMm * view.px_per_mm, 2);
  EXPECT_NEAR(covered_px, expected_px, 0.01 * expected_px);
}

TEST(MeshView, EverySideOfTheFrameIsKeptFree) {
  const TriangleMesh sphere = Sphere(32);
  MeshViewOptions options;
  options.width_px = 200;
  options.height_px = 120;
  options.margin_px = 10;
  const MeshView view = Render(sphere, PlainColors(sphere.vertices_mm.size()), MeshSide::kFront, options);
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      if (y < 9 || y > 110) {
        EXPECT_EQ(PixelAt(view, x, y)[3], 0);
      }
    }
  }
  EXPECT_NEAR(view.px_per_mm, 100 / (2 * kRadiusMm), 0.01);
  EXPECT_EQ(PixelAt(view, 100, 60)[3], 255);
}

TEST(MeshView, NearerSquareHidesTheFartherOneFromEachSide) {
  TriangleMesh mesh;
  AddSquare(50, 0, mesh);
  AddSquare(20, 10, mesh);
  std::vector<Eigen::Vector3f> colors(4, Eigen::Vector3f(1, 0, 0));
  colors.resize(8, Eigen::Vector3f(0, 0, 1));
  MeshViewOptions options;
  options.shading = 0;
  const MeshView front = Render(mesh, colors, MeshSide::kFront, options);
  const MeshView back = Render(mesh, colors, MeshSide::kBack, options);
  EXPECT_THAT(PixelAt(front, 240, 280), ::testing::ElementsAre(255, 0, 0, 255));
  const std::array<int, 4> behind = PixelAt(back, 240, 280);
  EXPECT_EQ(behind[0], 0);
  EXPECT_GT(behind[2], 100);
  EXPECT_LT(behind[2], 255) << "the inside is darker";
}

TEST(MeshView, FrontHasWorldUpOnTopAndIsNotMirrored) {
  TriangleMesh mesh;
  AddSquare(50, 0, mesh);
  // Corners in world axes: 0 top left, 1 top right, 2 bottom right, 3 bottom left; y runs down.
  const std::vector<Eigen::Vector3f> colors = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  MeshViewOptions options;
  options.shading = 0;
  options.width_px = options.height_px = 100;
  const MeshView front = Render(mesh, colors, MeshSide::kFront, options);
  EXPECT_GT(PixelAt(front, 11, 10)[0], PixelAt(front, 11, 10)[1] + 100);
  EXPECT_GT(PixelAt(front, 88, 10)[1], PixelAt(front, 88, 10)[0] + 100);
  EXPECT_GT(PixelAt(front, 88, 89)[2], PixelAt(front, 88, 89)[0] + 100);
  const MeshView back = Render(mesh, colors, MeshSide::kBack, options);
  EXPECT_GT(PixelAt(back, 11, 10)[1], PixelAt(back, 11, 10)[0] + 50);
}

TEST(MeshView, ViewpointLooksAtTheBroadSide) {
  TriangleMesh mesh;
  for (int i = 0; i < 40; ++i) {
    const double along = i - 20.0;
    mesh.vertices_mm.emplace_back(along, (i % 7) * 10.0, along + (i % 3) * 0.1);  // turned by 45 degrees
  }
  const absl::StatusOr<Viewpoint> front = ViewpointOf(mesh.vertices_mm, MeshSide::kFront, kUp);
  ASSERT_TRUE(front.ok());
  EXPECT_NEAR(front->towards_viewer.dot(Eigen::Vector3d(1, 0, -1).normalized()), 1, 1e-3);
  EXPECT_NEAR(front->right.cross(front->up).dot(front->towards_viewer), 1, 1e-12);
  EXPECT_NEAR(front->up.dot(kUp), 1, 1e-12);
}

TEST(MeshView, ClothOnTheFloorIsSeenFromAbove) {
  std::vector<Eigen::Vector3d> floor;
  for (int i = 0; i < 100; ++i) floor.emplace_back(i % 10 * 5.0, 3, i / 10 * 5.0);
  const absl::StatusOr<Viewpoint> front = ViewpointOf(floor, MeshSide::kFront, kUp);
  ASSERT_TRUE(front.ok());
  EXPECT_NEAR(front->towards_viewer.dot(kUp), 1, 1e-12);
}

TEST(MeshView, SameBytesAtEveryCall) {
  const TriangleMesh sphere = Sphere(40);
  const auto colors = PlainColors(sphere.vertices_mm.size());
  const MeshView once = Render(sphere, colors, MeshSide::kFront);
  const MeshView again = Render(sphere, colors, MeshSide::kFront);
  EXPECT_EQ(once.rgba, again.rgba);
  const auto png = EncodePng(once), png_again = EncodePng(again);
  ASSERT_TRUE(png.ok() && png_again.ok());
  EXPECT_EQ(*png, *png_again);
  EXPECT_THAT(*png, ::testing::StartsWith("\x89PNG"));
}

TEST(MeshView, BackgroundIsTransparentOrLight) {
  const TriangleMesh sphere = Sphere(24);
  const auto colors = PlainColors(sphere.vertices_mm.size());
  EXPECT_EQ(PixelAt(Render(sphere, colors, MeshSide::kFront), 0, 0)[3], 0);
  MeshViewOptions options;
  options.transparent = false;
  EXPECT_THAT(PixelAt(Render(sphere, colors, MeshSide::kFront, options), 0, 0),
              ::testing::ElementsAre(255, 255, 255, 255));
}

absl::Status Fails(const TriangleMesh& mesh, size_t colors, const MeshViewOptions& options = {}) {
  return RenderMesh(mesh, PlainColors(colors), Viewpoint{}, options).status();
}

TEST(MeshView, RefusesWhatCannotBeDrawnAndNamesIt) {
  EXPECT_THAT(Fails(TriangleMesh{}, 0).message(), HasSubstr("no faces"));
  EXPECT_THAT(ViewpointOf({}, MeshSide::kFront, kUp).status().message(), HasSubstr("no vertices"));
  EXPECT_THAT(ViewpointOf({{1, 2, 3}}, MeshSide::kFront, Eigen::Vector3d::Zero()).status().message(),
              HasSubstr("up"));

  TriangleMesh broken = Sphere(8);
  broken.vertices_mm[17].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Fails(broken, broken.vertices_mm.size()).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(Fails(broken, broken.vertices_mm.size()).message(), HasSubstr("vertex 17"));
  EXPECT_THAT(ViewpointOf(broken.vertices_mm, MeshSide::kFront, kUp).status().message(),
              HasSubstr("vertex 17"));

  TriangleMesh wrong_face = Sphere(8);
  wrong_face.faces[5][1] = 1000;
  EXPECT_THAT(Fails(wrong_face, wrong_face.vertices_mm.size()).message(), HasSubstr("face 5"));
  EXPECT_THAT(Fails(Sphere(8), 3).message(), HasSubstr("colors"));

  TriangleMesh point;
  point.vertices_mm.assign(3, Eigen::Vector3d(1, 1, 1));
  point.faces = {{0, 1, 2}};
  EXPECT_THAT(Fails(point, 3).message(), HasSubstr("no extent"));
}

TEST(MeshView, RefusesOptionsThatLeaveNoPicture) {
  const TriangleMesh sphere = Sphere(8);
  const auto fails = [&](const MeshViewOptions& options) {
    return std::string(Fails(sphere, sphere.vertices_mm.size(), options).message());
  };
  EXPECT_THAT(fails({.width_px = 0}), HasSubstr("width_px"));
  EXPECT_THAT(fails({.supersampling = 0}), HasSubstr("supersampling"));
  EXPECT_THAT(fails({.width_px = 100'000, .height_px = 100'000}), HasSubstr("samples"));
  EXPECT_THAT(fails({.margin_px = 240}), HasSubstr("margin_px"));
  EXPECT_THAT(fails({.shading = 2}), HasSubstr("shading"));
}

float Luma(const Eigen::Vector3f& c) { return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2]; }

TEST(MeshColors, MapGetsLighterAllTheWay) {
  for (int i = 0; i < 50; ++i) EXPECT_LT(Luma(MapColor(i / 50.0)), Luma(MapColor((i + 1) / 50.0)));
  EXPECT_EQ(MapColor(-3), MapColor(0));
  EXPECT_EQ(MapColor(7), MapColor(1));
}

TEST(MeshColors, ValuesThatAreNoNumbersAreGrey) {
  const auto colors = ScalarColors({0, std::nan(""), 2}, {0, 2});
  EXPECT_EQ(colors[0], MapColor(0));
  EXPECT_EQ(colors[1], UnknownColor());
  EXPECT_EQ(colors[2], MapColor(1));
}

TEST(MeshColors, RangeEndsAtARoundNumber) {
  EXPECT_DOUBLE_EQ(RoundRange({0.1, 0.2, 0.27}).high, 0.3);
  EXPECT_DOUBLE_EQ(RoundRange({0.1}).high, 0.1);
  EXPECT_DOUBLE_EQ(RoundRange({87, std::nan("")}).high, 100);
  EXPECT_DOUBLE_EQ(RoundRange({}).high, 1);
  EXPECT_DOUBLE_EQ(RoundRange({0, 0}).high, 1);
  std::vector<double> values(1000, 0.2);
  values[3] = 50;
  EXPECT_DOUBLE_EQ(RoundRange(values).high, 0.2);
}

TEST(MeshColors, HexIsWhatHtmlReads) {
  EXPECT_EQ(HexColor({1, 0.5f, 0}), "#ff8000");
  EXPECT_EQ(HexColor({2, -1, 0}), "#ff0000");
}

TEST(MeshColors, DifferencesDivergeFromNearlyWhite) {
  const ScalarRange range = RoundRangeAroundZero({-0.3, 0.1, 0.2, std::nan("")});
  EXPECT_DOUBLE_EQ(range.low, -0.3);
  EXPECT_DOUBLE_EQ(range.high, 0.3);
  const Eigen::Vector3f less = ScalarColor(-0.3, range), none = ScalarColor(0, range),
                        more = ScalarColor(0.3, range);
  EXPECT_GT(less.z(), less.x());  // blue
  EXPECT_GT(more.x(), more.z());  // orange
  EXPECT_GT(none.minCoeff(), 0.9f);
  EXPECT_EQ(ScalarColor(std::nan(""), range), UnknownColor());
  EXPECT_EQ(ScalarColor(-5, range), less);
}

// The light comes from above, on the left, from before the sheet: sheets that lean are lit by how far they
// face it.
TEST(MeshView, LightIsThatOfTheSurfacesTurn) {
  const auto lit = [](double turn_deg, const Eigen::Vector3d& axis, MeshSide side, double shading) {
    TriangleMesh mesh;
    AddSquare(50, 0, mesh);
    const Eigen::AngleAxisd turn(turn_deg * M_PI / 180, axis);
    for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = turn * vertex;
    MeshViewOptions options;
    options.width_px = options.height_px = 60, options.shading = shading;
    Viewpoint viewpoint;
    if (side == MeshSide::kBack) viewpoint.right *= -1, viewpoint.towards_viewer *= -1;
    const auto view =
        RenderMesh(mesh, std::vector<Eigen::Vector3f>(4, {0.5F, 0.75F, 0.25F}), viewpoint, options);
    EXPECT_TRUE(view.ok()) << view.status();
    const std::array<int, 4> pixel = PixelAt(*view, 30, 30);
    return absl::StrCat(pixel[0], " ", pixel[1], " ", pixel[2]);
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  EXPECT_EQ(lit(0, x, MeshSide::kFront, 0), "128 191 64");
  EXPECT_EQ(lit(0, x, MeshSide::kFront, 1), R"(115 174 57)");
  EXPECT_EQ(lit(0, x, MeshSide::kFront, 0.5), R"(122 183 61)");
  EXPECT_EQ(lit(40, x, MeshSide::kFront, 1), R"(83 127 39)");
  EXPECT_EQ(lit(-40, x, MeshSide::kFront, 1), R"(126 190 63)");
  EXPECT_EQ(lit(40, y, MeshSide::kFront, 1), R"(122 184 61)");
  EXPECT_EQ(lit(-40, y, MeshSide::kFront, 1), R"(90 136 43)");
  EXPECT_EQ(lit(0, x, MeshSide::kBack, 1), R"(87 132 41)");
  EXPECT_EQ(lit(40, x, MeshSide::kBack, 0.5), R"(96 145 46)");
}

TEST(MeshView, OptionsEndWhereTheirTextsSay) {
  const auto message = [](const auto& change) {
    MeshViewOptions options;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_EQ(message([](auto& o) { o.width_px = 0; }),
            "width_px and height_px: are 0 x 560, must be positive");
  EXPECT_EQ(message([](auto& o) { o.height_px = 0; }),
            "width_px and height_px: are 480 x 0, must be positive");
  EXPECT_EQ(message([](auto& o) { o.supersampling = 0; }), "supersampling: is 0, must be 1 to 16");
  EXPECT_EQ(message([](auto& o) { o.supersampling = 17; }), "supersampling: is 17, must be 1 to 16");
  EXPECT_EQ(message([](auto& o) { o.supersampling = 16; }), "");
  EXPECT_EQ(message([](auto& o) { o.width_px = o.height_px = 10'000, o.supersampling = 1; }), "");
  EXPECT_EQ(message([](auto& o) { o.width_px = 10'001, o.height_px = 10'000, o.supersampling = 1; }),
            "width_px, height_px, supersampling: more than 100000000 samples; lower one");
  EXPECT_EQ(message([](auto& o) { o.width_px = o.height_px = 5'001, o.supersampling = 2; }),
            "width_px, height_px, supersampling: more than 100000000 samples; lower one");
  EXPECT_EQ(message([](auto& o) { o.margin_px = -1; }), "margin_px: is -1, leaves no picture");
  EXPECT_EQ(message([](auto& o) { o.margin_px = 240; }), "margin_px: is 240, leaves no picture");
  EXPECT_EQ(message([](auto& o) { o.margin_px = 239; }), "");
  EXPECT_EQ(message([](auto& o) { o.shading = 1.01; }), "shading: is 1.01, must be 0 to 1");
  EXPECT_EQ(message([](auto& o) { o.shading = -0.01; }), "shading: is -0.01, must be 0 to 1");
  EXPECT_EQ(message([](auto& o) { o.shading = 0; }), "");
}

}  // namespace
}  // namespace weft

#include "evaluation/texture_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "evaluation/error_summary.h"
#include "simulation/renderer.h"
#include "tests/simulation/flat_studio.h"

namespace weft {
namespace {

constexpr double kFps = 30;

// A curved printed sheet before three cameras, photographed with blur and noise.
class TextureDriftTest : public testing::Test {
 protected:
  static constexpr int kRows = 24, kCols = 30;

  void SetUp() override {
    cloth_ = FlatSheet(kRows, kCols);
    garment_.rest = cloth_.rest;
    garment_.node_of_vertex = cloth_.cell_of_vertex;
    for (const double angle_deg : {-25.0, 0.0, 25.0}) {
      CameraModel camera = FlatCamera(1400, 600, angle_deg);
      camera.id = "c" + std::to_string(rig_.cameras.size());
      rig_.cameras.push_back(camera);
    }
  }

  // The cloth of a frame: a wave that travels, so that the surface moves by much more than the texture
  // drifts.
  TriangleMesh ClothAt(int frame) const {
    TriangleMesh mesh = cloth_.rest;
    for (auto& v : mesh.vertices_mm) {
      v.z() += 8 * std::sin(0.05 * v.x() + 0.15 * frame);
      v += Eigen::Vector3d(1.3, 0.4, -0.8) * frame;
    }
    return mesh;
  }
  // A registered mesh on the same surface whose vertices slide along x by so much per frame.
  std::vector<Eigen::Vector3d> SlidingMesh(int frame, double mm_per_frame) const {
    std::vector<Eigen::Vector3d> vertices = cloth_.rest.vertices_mm;
    for (auto& v : vertices) {  // a thread is where it is at rest, so the slide along x is the drift
      v.x() += mm_per_frame * frame;
      v.z() += 8 * std::sin(0.05 * v.x() + 0.15 * frame);
      v += Eigen::Vector3d(1.3, 0.4, -0.8) * frame;
    }
    return vertices;
  }

  GreyImage Photograph(int frame, int camera) const {
    StudioOptions look = PlainLook();
    look.light = LightOptions();
    look.light.rays = 32;
    const absl::StatusOr<Board> board = GenerateBoard(kRows, kCols, kFlatCellMm, 1);
    const auto scene = StudioScene::Build(MovingMesh{ClothAt(frame), {}}, cloth_.print, *board, {}, look);
    EXPECT_TRUE(scene.ok()) << scene.status();
    const auto picture = RenderView(*scene, rig_.cameras[camera], CameraOptions(), frame);
    EXPECT_TRUE(picture.ok()) << picture.status();
    return *ToGrey(ToFrame(*picture));
  }

  // A hand in front of half the cloth, with a pattern of its own that moves by `hand_px` to the right.
  void Cover(int frame, double hand_px, GreyImage* picture) const {
    for (int y = 0; y < picture->height_px; ++y)
      for (int x = 0; x < picture->width_px / 2; ++x)
        picture->value[static_cast<size_t>(y) * picture->width_px + x] =
            static_cast<float>(120 + 40 * std::sin(0.4 * (x - hand_px * frame)) + 40 * std::sin(0.3 * y));
  }

  // A hand in front of part of the cloth in all pictures; `told`: nothing was read there.
  TextureDriftField MeasureBehindHand(bool told) const {
    const auto drift = TextureDrift::Build(garment_, {});
    EXPECT_TRUE(drift.ok()) << drift.status();
    const auto mesh = VisibleMesh::Build(cloth_.rest.vertices_mm, cloth_.rest.faces, kFlatCellMm);
    std::vector<std::vector<bool>> uncovered(rig_.cameras.size());
    for (size_t c = 0; told && c < rig_.cameras.size(); ++c) {
      std::vector<Observation> read;
      for (size_t v = 0; v < cloth_.rest.vertices_mm.size(); ++v) {
        const auto pixel = rig_.cameras[c].Project(cloth_.rest.vertices_mm[v]);
        const VertexNode& cell = garment_.node_of_vertex[v];
        if (cell.row >= 0 && pixel && pixel->x() > rig_.cameras[c].width_px / 2.0 + 5)
          read.push_back({pixel->x(), pixel->y(), {cell.row, cell.col, NodeKind::kCenter}, 0.1f, 1});
      }
      uncovered[c] = ReadAround(garment_.node_of_vertex, read);
    }
    const UnwrapPlan plan = drift->Plan(rig_, *mesh, *mesh, uncovered);
    TextureDriftField field = drift->EmptyField();
    for (int c = 0; c < 3; ++c) {
      if (plan.of_camera[c].empty()) continue;
      GreyImage before = Photograph(0, c), after = before;
      Cover(0, 1.5, &before);
      Cover(1, 1.5, &after);
      drift->Measure(plan, c, rig_.cameras[c], mesh->vertices_mm(), before, mesh->vertices_mm(), after,
                     &field);
    }
    return field;
  }

  TextureDriftField Measure(double slide_mm) const {
    const auto drift = TextureDrift::Build(garment_, {});
    EXPECT_TRUE(drift.ok()) << drift.status();
    const auto before = VisibleMesh::Build(SlidingMesh(0, slide_mm), cloth_.rest.faces, kFlatCellMm);
    const auto after = VisibleMesh::Build(SlidingMesh(1, slide_mm), cloth_.rest.faces, kFlatCellMm);
    const UnwrapPlan plan = drift->Plan(rig_, *before, *after, {});
    TextureDriftField field = drift->EmptyField();
    for (int c = 0; c < 3; ++c)
      if (!plan.of_camera[c].empty())
        drift->Measure(plan, c, rig_.cameras[c], before->vertices_mm(), Photograph(0, c),
                       after->vertices_mm(), Photograph(1, c), &field);
    return field;
  }

  static std::vector<double> Measured(const TextureDriftField& field) {
    std::vector<double> mm;
    for (const double d : field.mm)
      if (!std::isnan(d)) mm.push_back(d);
    return mm;
  }

  Cloth cloth_;
  Template garment_;
  Rig rig_;
};

TEST_F(TextureDriftTest, SlidingTextureHasItsSpeed) {
  for (const double speed_mm_s : {2.0, 20.0}) {
    const TextureDriftField field = Measure(speed_mm_s / kFps);
    const auto found = Summarize(Measured(field));
    ASSERT_TRUE(found);
    EXPECT_GT(found->count, kRows * kCols / 2);
    EXPECT_LT(field.lost, 0.02 * static_cast<double>(field.tried));
    EXPECT_NEAR(found->mean * kFps, speed_mm_s, 0.05 * speed_mm_s);
  }
}

TEST_F(TextureDriftTest, WhatMovesInFrontOfTheClothIsNoDrift) {
  const auto fooled = Summarize(Measured(MeasureBehindHand(false)));
  const auto found = Summarize(Measured(MeasureBehindHand(true)));
  ASSERT_TRUE(fooled && found);
  EXPECT_GT(fooled->mean * kFps, 2);
  EXPECT_LT(found->mean * kFps, 0.3);
  EXPECT_GT(found->count, kRows * kCols / 5);
}

TEST_F(TextureDriftTest, TextureThatStaysHasNone) {
  const auto found = Summarize(Measured(Measure(0)));
  ASSERT_TRUE(found);
  EXPECT_LT(found->mean * kFps, 0.3);
}

}  // namespace
}  // namespace weft

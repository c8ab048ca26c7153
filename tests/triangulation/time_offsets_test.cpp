#include "triangulation/time_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "base/counter_random.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr double kFps = 30;

Rig Circle(int cameras) {
  Rig rig;
  for (int i = 0; i < cameras; ++i) {
    CameraModel camera;
    camera.id = "c" + std::to_string(i);
    camera.width_px = camera.height_px = 1000;
    camera.fx_px = camera.fy_px = 1200;
    camera.cx_px = camera.cy_px = 499.5;
    const double angle = 0.25 * i;
    camera.rotation = (Eigen::AngleAxisd(0.1 * (i % 3), Eigen::Vector3d::UnitX()) *
                       Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()))
                          .toRotationMatrix();
    camera.translation_mm = {0, 0, 2500};
    rig.cameras.push_back(camera);
  }
  return rig;
}

// A cloth of 20 x 20 nodes that sways, bends and drifts; no motion repeats.
Eigen::Vector3d NodeAt(int row, int col, double t_s, double speed) {
  const double u = 30.0 * (col - 10), v = 30.0 * (row - 10), t = speed * t_s;
  return {u + 60 * std::sin(2.1 * t + 0.003 * v) + 25 * t, v + 40 * std::sin(3.3 * t + 0.01 * u) - 10 * t * t,
          80 * std::sin(0.01 * u + 4.7 * t) + 30 * std::cos(1.3 * t)};
}

struct Scene {
  Rig rig;
  std::vector<double> offsets_s;  // added to a camera's times, they are true
  double speed = 1, noise_px = 0.1, wrong_share = 0.01;
};

std::vector<CameraFilm> FilmOf(const Scene& scene, double seconds) {
  std::vector<CameraFilm> films;
  for (size_t i = 0; i < scene.rig.cameras.size(); ++i) {
    CameraFilm film{static_cast<int>(i), 1 / kFps, {}};
    for (int frame = 0; frame < seconds * kFps; ++frame) {
      TimedObservations moment{frame / kFps, {}};
      for (int row = 0; row < 20; ++row)
        for (int col = 0; col < 20; ++col) {
          const uint64_t key = KeyOf(i, "noise") ^ KeyOf(static_cast<uint64_t>(frame), "frame");
          const auto number = static_cast<uint64_t>(20 * row + col);
          const bool wrong = UniformOf(key, 3 * number) < scene.wrong_share;
          const auto pixel = scene.rig.cameras[i].Project(
              NodeAt(wrong ? 19 - row : row, col, moment.time_s + scene.offsets_s[i], scene.speed));
          if (!pixel || !scene.rig.cameras[i].Contains(*pixel)) continue;
          moment.observations.push_back({pixel->x() + scene.noise_px * NormalOf(key, 2 * number),
                                         pixel->y() + scene.noise_px * NormalOf(key, 2 * number + 1),
                                         {row, col, NodeKind::kCenter},
                                         0.1f,
                                         1.0f});
        }
      film.moments.push_back(std::move(moment));
    }
    films.push_back(std::move(film));
  }
  return films;
}

TEST(TimeOffsets, OfUpToHalfASecondAreFoundToATenthOfAFrame) {
  Scene scene{Circle(6), {0.31, -0.213, 0.0, 0.487, -0.4456, 0.1021}};
  double mean = 0;
  for (const double offset : scene.offsets_s) mean += offset / 6;
  const auto found = FindTimeOffsets(scene.rig, FilmOf(scene, 2.0), {.max_offset_s = 1.0});
  ASSERT_TRUE(found.ok()) << found.status();
  for (size_t i = 0; i < 6; ++i) {
    ASSERT_TRUE((*found)[i].offset_s.has_value()) << i;
    const double error_s = *(*found)[i].offset_s - (scene.offsets_s[i] - mean);
    EXPECT_LT(std::abs(error_s) * kFps, 0.02) << i;
    EXPECT_LT(std::abs(error_s), 5 * (*found)[i].sigma_s + 1e-4) << i;
    EXPECT_LT((*found)[i].sigma_s * kFps, 0.05) << i;
  }
}

TEST(TimeOffsets, OfSlowClothHaveLargerSigmas) {
  Scene scene{Circle(4), {0.1, -0.2, 0.05, 0.05}};
  const auto quick = FindTimeOffsets(scene.rig, FilmOf(scene, 1.5), {});
  scene.speed = 0.4;
  const auto slow = FindTimeOffsets(scene.rig, FilmOf(scene, 1.5), {});
  ASSERT_TRUE(quick.ok() && slow.ok()) << quick.status() << slow.status();
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_GT((*slow)[i].sigma_s, (*quick)[i].sigma_s);
    EXPECT_NEAR(*(*slow)[i].offset_s, scene.offsets_s[i], 0.1 / kFps);
  }
}

TEST(TimeOffsets, OfClothAtRestCannotBeTold) {
  Scene scene{Circle(3), {0, 0.1, 0.2}};
  scene.speed = 0;
  const auto found = FindTimeOffsets(scene.rig, FilmOf(scene, 1.5), {});
  EXPECT_EQ(found.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("moves too little"));
}

TEST(TimeOffsets, OfACameraThatSeesNoCellOfTheOthersAreMissing) {
  Scene scene{Circle(4), {0.1, -0.1, 0.2, -0.2}};
  auto films = FilmOf(scene, 1.5);
  for (TimedObservations& moment : films[2].moments)
    for (Observation& seen : moment.observations) seen.node.row += 100;
  const auto found = FindTimeOffsets(scene.rig, films, {});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_FALSE((*found)[2].offset_s.has_value());
  EXPECT_NEAR(*(*found)[0].offset_s - *(*found)[1].offset_s, 0.2, 1e-3);
}

TEST(TimeOffsets, SayWhatIsWrong) {
  const Scene scene{Circle(2), {0, 0}};
  auto films = FilmOf(scene, 0.2);
  for (CameraFilm& film : films) film.moments.resize(1);
  EXPECT_THAT(std::string(FindTimeOffsets(scene.rig, films, {}).status().message()),
              HasSubstr("no two cameras see enough cells"));
  films[1].camera = 5;
  EXPECT_EQ(FindTimeOffsets(scene.rig, films, {}).status().code(), absl::StatusCode::kInvalidArgument);
  films.pop_back();
  EXPECT_THAT(std::string(FindTimeOffsets(scene.rig, films, {}).status().message()), HasSubstr("two films"));
}

}  // namespace
}  // namespace weft

#include "physics/garment_solver.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "alignment/untangle/self_intersection.h"
#include "simulation/cloth.h"

namespace weft {
namespace {

using Eigen::Vector3d;

// A flat sheet of cells of 5 mm, y down.
struct Sheet {
  Cloth cloth;
  std::vector<std::array<Eigen::Vector2d, 3>> flat_mm;

  Sheet(int rows, int cols) {
    ClothOptions options;
    options.shape = ClothShape::kSheet;
    options.rows = rows, options.cols = cols, options.cell_mm = 5;
    cloth = *BuildCloth(options);
    for (const auto& p : cloth.print.of_face) flat_mm.push_back({5 * p[0], 5 * p[1], 5 * p[2]});
  }
  GarmentSolver Solver(const JerseyOptions& jersey) const {
    return SolverFrom(cloth.rest.vertices_mm, jersey);
  }
  GarmentSolver SolverFrom(const std::vector<Vector3d>& x_mm, const JerseyOptions& jersey) const {
    return GarmentSolver(cloth.rest.faces, flat_mm, x_mm, 5, jersey);
  }
};

JerseyOptions WithoutAir() {
  JerseyOptions jersey;
  jersey.air_drag_per_s = 0;
  return jersey;
}

std::vector<Vector3d> Mapped(const std::vector<Vector3d>& x,
                             const std::function<Vector3d(const Vector3d&)>& f) {
  std::vector<Vector3d> out;
  for (const Vector3d& p : x) out.push_back(f(p));
  return out;
}

TEST(GarmentSolver, FallsFreely) {
  const Sheet sheet(6, 6);
  GarmentSolver solver = sheet.Solver(WithoutAir());
  const double step = 1e-3;
  for (int k = 0; k < 100; ++k) solver.Step(step, {});
  // Implicit Euler falls g h^2 n (n + 1) / 2 in n steps.
  const double fallen = 9810 * step * step * 100 * 101 / 2;
  for (size_t v = 0; v < solver.positions_mm().size(); ++v)
    EXPECT_LT((solver.positions_mm()[v] - sheet.cloth.rest.vertices_mm[v] - Vector3d(0, fallen, 0)).norm(),
              1e-3 * fallen);
}

TEST(GarmentSolver, HangingStripStretchesByItsWeight) {
  const Sheet sheet(40, 6);
  const JerseyOptions jersey;
  GarmentSolver solver = sheet.Solver(jersey);
  StepInput input;
  input.drag_per_s = 30;
  for (int j = 0; j < sheet.cloth.grid_cols; ++j) {
    input.held.push_back(sheet.cloth.vertex_at(0, j));
    input.held_at_mm.push_back(sheet.cloth.rest.vertices_mm[input.held.back()]);
  }
  for (int k = 0; k < 600; ++k) solver.Step(2e-3, input);
  // Strain at depth s below the hold: weight of what hangs below, over the stiffness.
  const double length = 200, density = jersey.density_kg_m2 * 1e-6, stiffness = jersey.stretch_n_per_m;
  const double expected = density * 9810 * length * length / (2 * stiffness);
  const int low = sheet.cloth.vertex_at(sheet.cloth.grid_rows - 1, sheet.cloth.grid_cols / 2);
  EXPECT_NEAR(solver.positions_mm()[low].y() - sheet.cloth.rest.vertices_mm[low].y(), expected,
              0.05 * expected);
}

TEST(GarmentSolver, BendingEnergyIsThatOfACylinder) {
  const Sheet sheet(40, 40);
  const JerseyOptions jersey;
  const GarmentSolver solver = sheet.Solver(jersey);
  const double radius = 80, area = 200.0 * 200.0;
  const double expected = jersey.bending_n_m * 1e6 * area / (2 * radius * radius);
  for (const double angle : {0.0, 0.8, 1.57}) {
    const Vector3d along(std::cos(angle), std::sin(angle), 0), axis(-along.y(), along.x(), 0);
    const std::vector<Vector3d> rolled =
        Mapped(sheet.cloth.rest.vertices_mm, [&](const Vector3d& p) -> Vector3d {
          const double turn = along.dot(p) / radius;
          return radius * std::sin(turn) * along + axis.dot(p) * axis -
                 Vector3d(0, 0, radius * std::cos(turn));
        });
    EXPECT_NEAR(solver.fabric().BendingEnergy(rolled) / expected, 1, 0.25) << angle;
  }
}

TEST(GarmentSolver, LosesEnergyAndKeepsMomentum) {
  const Sheet sheet(12, 12);
  // Stretched, sheared and bent; nothing acts from outside.
  const std::vector<Vector3d> start = Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) {
    return Vector3d(1.04 * p.x() + 0.05 * p.y(), 0.99 * p.y(), 3 * std::sin(p.x() / 9));
  });
  GarmentSolver solver = sheet.SolverFrom(start, WithoutAir());
  StepInput weightless;
  weightless.gravity_mm_s2.setZero();
  const auto& mass = solver.fabric().mass_kg();
  double before = 1e18, first = 0;
  for (int k = 0; k < 80; ++k) {
    solver.Step(1e-3, weightless);
    double energy = solver.fabric().MembraneEnergy(solver.positions_mm()) +
                    solver.fabric().BendingEnergy(solver.positions_mm());
    Vector3d momentum = Vector3d::Zero();
    double moving = 0;
    for (size_t v = 0; v < mass.size(); ++v) {
      const Vector3d& velocity = solver.velocities_mm_s()[v];
      energy += mass[v] * velocity.squaredNorm() / 2;
      momentum += mass[v] * velocity;
      moving += mass[v] * velocity.norm();
    }
    if (k == 0) first = energy;
    EXPECT_LT(energy, before * (1 + 1e-3)) << "step " << k;
    EXPECT_LT(momentum.norm(), 0.01 * moving) << "step " << k;
    before = energy;
  }
  EXPECT_LT(before, 0.5 * first);
}

TEST(GarmentSolver, ForcesAreTheSlopeOfTheEnergyFarBeyondWhereTheClothLocks) {
  const Sheet sheet(6, 6);
  const std::vector<Vector3d> x = Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) {
    return Vector3d(1.3 * p.x() + 0.4 * p.y(), 0.9 * p.y(), 2 * std::sin(p.x() / 9));
  });
  Fabric fabric(static_cast<int>(x.size()), sheet.cloth.rest.faces, sheet.flat_mm, {});
  fabric.Linearize(x);
  const auto energy = [&](size_t v, int axis, double by_mm) {
    std::vector<Vector3d> moved = x;
    moved[v][axis] += by_mm;
    return fabric.MembraneEnergy(moved) + fabric.BendingEnergy(moved);
  };
  for (size_t v = 0; v < x.size(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      const double slope = (energy(v, axis, 1e-4) - energy(v, axis, -1e-4)) / 2e-4;
      EXPECT_NEAR(fabric.forces()[v][axis], -slope, 1e-3 * (100 + std::abs(slope))) << v << " " << axis;
    }
}

// A sheet with a crease down its middle.
std::vector<Crease> CreaseDown(const Cloth& cloth, double angle_rad) {
  std::vector<Crease> out;
  const int j = cloth.grid_cols / 2;
  for (int i = 0; i + 1 < cloth.grid_rows; ++i)
    out.push_back({cloth.vertex_at(i, j), cloth.vertex_at(i + 1, j), angle_rad});
  return out;
}

TEST(GarmentSolver, ForcesOfACreaseAreTheSlopeOfItsEnergy) {
  const Sheet sheet(6, 6);
  const std::vector<Vector3d> x = Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) {
    return Vector3d(12 * std::sin(p.x() / 12), p.y(), 12 * std::cos(p.x() / 12));
  });
  Fabric fabric(static_cast<int>(x.size()), sheet.cloth.rest.faces, sheet.flat_mm, {},
                CreaseDown(sheet.cloth, 1.2));
  fabric.Linearize(x);
  const auto energy = [&](size_t v, int axis, double by_mm) {
    std::vector<Vector3d> moved = x;
    moved[v][axis] += by_mm;
    return fabric.MembraneEnergy(moved) + fabric.BendingEnergy(moved);
  };
  for (size_t v = 0; v < x.size(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      const double slope = (energy(v, axis, 1e-4) - energy(v, axis, -1e-4)) / 2e-4;
      EXPECT_NEAR(fabric.forces()[v][axis], -slope, 0.02 * (20 + std::abs(slope))) << v << " " << axis;
    }
}

TEST(GarmentSolver, FlatClothFoldsToTheAngleOfItsCrease) {
  const Sheet sheet(8, 12);
  for (const double angle : {-1.0, 1.5}) {
    JerseyOptions jersey;
    GarmentSolver solver(sheet.cloth.rest.faces, sheet.flat_mm, sheet.cloth.rest.vertices_mm, 5, jersey,
                         CreaseDown(sheet.cloth, angle));
    StepInput weightless;
    weightless.gravity_mm_s2.setZero();
    weightless.drag_per_s = 5;
    for (int k = 0; k < 600; ++k) solver.Step(2e-3, weightless);
    // Between both halves; the outer side is at -z, so an edge that stands out there leaves them behind it.
    const auto& x = solver.positions_mm();
    const int i = 4, j = sheet.cloth.grid_cols / 2;
    const Vector3d left = x[sheet.cloth.vertex_at(i, j)] - x[sheet.cloth.vertex_at(i, 1)];
    const Vector3d right = x[sheet.cloth.vertex_at(i, j + 5)] - x[sheet.cloth.vertex_at(i, j)];
    const double turned = std::atan2(left.cross(right).norm(), left.dot(right));
    EXPECT_NEAR(turned, std::abs(angle), 0.12);
    EXPECT_EQ(right.z() - left.z() > 0, angle > 0);
  }
}

TEST(GarmentSolver, ClothThatLocksBearsAPullThatWouldDoubleIt) {
  // At 400 N/m a linear sheet would be twice as long under this pull.
  const Sheet sheet(40, 6);
  GarmentSolver solver = sheet.Solver({});
  StepInput input;
  input.drag_per_s = 30;
  input.gravity_mm_s2 = {0, 400e3 / (0.18e-6 * 200 / 2) / 1e3, 0};
  for (int j = 0; j < sheet.cloth.grid_cols; ++j) {
    input.held.push_back(sheet.cloth.vertex_at(0, j));
    input.held_at_mm.push_back(sheet.cloth.rest.vertices_mm[input.held.back()]);
  }
  for (int k = 0; k < 300; ++k) solver.Step(1e-3, input);
  double most = 0;
  for (const auto& [along_x, along_y] : solver.fabric().Stretches(solver.positions_mm()))
    most = std::max({most, along_x, along_y});
  EXPECT_GT(most, 1.2);
  EXPECT_LT(most, 1.45);
}

TEST(GarmentSolver, TautClothOnACylinderLiesStill) {
  const Sheet sheet(8, 40);
  Obstacle cylinder;
  cylinder.distance = [](const Vector3d& p, double) {
    const Vector3d out(p.x(), 0, p.z());
    return SurfaceDistance{out.norm() - 40, out.normalized()};
  };
  cylinder.velocity_mm_s = [](const Vector3d&) -> Vector3d { return Vector3d::Zero(); };
  // Half around it, then straight to both ends, which are pulled by 3 %.
  const std::vector<Vector3d> start = Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) {
    constexpr double kRadius = 42, kQuarter = 66;
    const double side = p.x() < 0 ? -1 : 1, along = std::abs(p.x());
    if (along > kQuarter) return Vector3d(side * kRadius, p.y(), along - kQuarter);
    return Vector3d(kRadius * std::sin(p.x() / kRadius), p.y(), -kRadius * std::cos(p.x() / kRadius));
  });
  GarmentSolver solver = sheet.SolverFrom(start, {});
  StepInput input;
  input.obstacle = &cylinder;
  input.gravity_mm_s2.setZero();
  for (int i = 0; i < sheet.cloth.grid_rows; ++i)
    for (const int j : {0, sheet.cloth.grid_cols - 1}) {
      input.held.push_back(sheet.cloth.vertex_at(i, j));
      input.held_at_mm.push_back(start[input.held.back()] + Vector3d(0, 0, 3));
    }
  for (int k = 0; k < 300; ++k) solver.Step(2e-3, input);
  double fastest = 0;
  for (const Vector3d& v : solver.velocities_mm_s()) fastest = std::max(fastest, v.norm());
  EXPECT_LT(fastest, 5);
}

TEST(GarmentSolver, ASpringOfAGripLengthensByItsLoad) {
  const Sheet sheet(6, 6);
  GarmentSolver solver = sheet.Solver({});
  StepInput input;
  input.drag_per_s = 30;
  input.grip_n_per_m = 5;
  double mass = 0;
  for (const double m : solver.fabric().mass_kg()) mass += m;
  for (int j = 0; j < sheet.cloth.grid_cols; ++j) {
    const int v = sheet.cloth.vertex_at(0, j);
    input.grips.push_back({v, sheet.cloth.rest.vertices_mm[v]});
  }
  for (int k = 0; k < 600; ++k) solver.Step(2e-3, input);
  double sunk_mm = 0;
  for (const Grip& g : input.grips)
    sunk_mm += (solver.positions_mm()[g.vertex] - g.at_mm).y() / static_cast<double>(input.grips.size());
  const double expected_mm = mass * 9810 / (input.grip_n_per_m * static_cast<double>(input.grips.size()));
  EXPECT_NEAR(sunk_mm, expected_mm, 0.03 * expected_mm);
}

// A sheet whose upper and lower borders are pushed together fast, so that it crumples between them.
std::vector<Vector3d> Crumple(int threads, int steps) {
  const Sheet sheet(30, 24);
  const std::vector<Vector3d> start = Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) {
    return Vector3d(p.x(), p.y(), 2 * std::sin(p.y() / 7) + std::sin(p.x() / 11));
  });
  GarmentSolver solver = sheet.SolverFrom(start, {});
  StepInput input;
  for (const int i : {0, sheet.cloth.grid_rows - 1})
    for (int j = 0; j < sheet.cloth.grid_cols; ++j) {
      input.held.push_back(sheet.cloth.vertex_at(i, j));
      input.held_at_mm.push_back(start[input.held.back()]);
    }
  tbb::task_arena(threads).execute([&] {
    for (int k = 0; k < steps; ++k) {
      for (size_t h = 0; h < input.held.size(); ++h)
        input.held_at_mm[h].y() += (h < input.held.size() / 2 ? 1 : -1) * 60.0 / steps;
      solver.Step(1.5e-3, input);
    }
  });
  EXPECT_TRUE(FindSelfIntersections(solver.positions_mm(), sheet.cloth.rest.faces).empty());
  return solver.positions_mm();
}

TEST(GarmentSolver, CrumpledClothDoesNotPassThroughItself) {
  const std::vector<Vector3d> x = Crumple(1, 250);
  double low = 1e9, high = -1e9;
  for (const Vector3d& p : x) low = std::min(low, p.z()), high = std::max(high, p.z());
  EXPECT_GT(high - low, 20) << "the cloth has no folds";
}

TEST(GarmentSolver, AnyNumberOfThreadsGivesTheSameBytes) { EXPECT_EQ(Crumple(1, 40), Crumple(3, 40)); }

TEST(GarmentSolver, ASphereIsNotEntered) {
  const Sheet sheet(24, 24);
  const Vector3d center(0, 40, 0);
  Obstacle sphere;
  sphere.distance = [&](const Vector3d& p, double) {
    return SurfaceDistance{(p - center).norm() - 30, (p - center).normalized()};
  };
  sphere.velocity_mm_s = [](const Vector3d&) -> Vector3d { return Vector3d::Zero(); };
  StepInput input;
  input.obstacle = &sphere;
  // Lies flat above the sphere and falls onto it.
  GarmentSolver solver = sheet.SolverFrom(
      Mapped(sheet.cloth.rest.vertices_mm, [](const Vector3d& p) { return Vector3d(p.x(), 0, p.y()); }), {});
  for (int k = 0; k < 200; ++k) solver.Step(1.5e-3, input);
  double least = 1e9;
  for (const Vector3d& p : solver.positions_mm()) least = std::min(least, (p - center).norm() - 30);
  EXPECT_GT(least, 0);
  EXPECT_LT(least, 3) << "the cloth does not lie on the sphere";
  EXPECT_TRUE(FindSelfIntersections(solver.positions_mm(), sheet.cloth.rest.faces).empty());
}

// A ball is driven through a sheet whose border is held: it passes, and the sheet is whole afterwards.
TEST(GarmentSolver, ClothIsLetGoBeforeABodyTearsIt) {
  const Sheet sheet(20, 20);
  GarmentSolver solver = sheet.Solver({});
  const std::vector<Vector3d>& rest = sheet.cloth.rest.vertices_mm;
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : rest) middle += p / static_cast<double>(rest.size());
  StepInput input;
  input.gravity_mm_s2.setZero();
  for (size_t v = 0; v < rest.size(); ++v)
    if ((rest[v] - middle).cwiseAbs().maxCoeff() > 45) {
      input.held.push_back(static_cast<int>(v));
      input.held_at_mm.push_back(rest[v]);
    }
  constexpr double kRadiusMm = 15, kSpeedMmPerS = 600, kStepS = 1e-3;
  double longest = 0;
  for (int k = 0; k < 500; ++k) {
    const Vector3d ball = middle + Vector3d(0, 0, -40 + kSpeedMmPerS * kStepS * k);
    Obstacle obstacle;
    obstacle.distance = [&](const Vector3d& p, double) {
      return SurfaceDistance{(p - ball).norm() - kRadiusMm, (p - ball).normalized()};
    };
    obstacle.velocity_mm_s = [&](const Vector3d&) { return Vector3d(0, 0, kSpeedMmPerS); };
    input.obstacle = &obstacle;
    solver.Step(kStepS, input);
    for (const Face& f : sheet.cloth.rest.faces)
      for (int i = 0; i < 3; ++i)
        longest =
            std::max(longest, (solver.positions_mm()[f[i]] - solver.positions_mm()[f[(i + 1) % 3]]).norm() /
                                  (rest[f[i]] - rest[f[(i + 1) % 3]]).norm());
  }
  EXPECT_GT(longest, 1.5);
  EXPECT_LT(longest, 2.6);
  for (size_t v = 0; v < rest.size(); ++v) EXPECT_LT(std::abs(solver.positions_mm()[v].z()), 15) << v;
}

}  // namespace
}  // namespace weft

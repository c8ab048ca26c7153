#include "alignment/temporal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <random>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using ::testing::HasSubstr;
using testing::Mapped;
using testing::Rolled;
using testing::SheetTemplate;

constexpr int kWaveRows = 30, kWaveCols = 36;

bool IsUnseen(int v) { return std::hypot(v / kWaveCols - kWaveRows / 2, v % kWaveCols - kWaveCols / 2) <= 7; }

// The sheet at a time: it moves evenly and bends a little more each frame.
std::vector<Eigen::Vector3d> SheetAt(const TriangleMesh& rest, double frame) {
  return Mapped(rest.vertices_mm, [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(Rolled(p, 60 - frame) + Eigen::Vector3d(4 * frame, -3 * frame, 0));
  });
}

// Registered on its own: hidden vertices are off by a wave that differs from frame to frame.
RegisteredMesh RegisteredWave(const TriangleMesh& rest, int frame, double wave_mm) {
  RegisteredMesh mesh;
  mesh.vertices_mm = SheetAt(rest, frame);
  for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
    mesh.state.push_back(IsUnseen(v) ? VertexState::kInferred : VertexState::kObserved);
    mesh.views.push_back(IsUnseen(v) ? 0 : 5);
    mesh.sigma_mm.push_back(IsUnseen(v) ? 1.5f : 0.05f);
    if (IsUnseen(v)) mesh.vertices_mm[v].z() += wave_mm * std::sin(0.4 * v + 2.1 * frame);
  }
  return mesh;
}

double UnseenError(const RegisteredMesh& mesh, const std::vector<Eigen::Vector3d>& truth) {
  return testing::MeanError(mesh.vertices_mm, truth, IsUnseen);
}

class Temporal : public ::testing::Test {
 protected:
  const Template garment_ = SheetTemplate(FlatSheet(kWaveRows, kWaveCols));
  const AlignmentModel model_{garment_};
  const RegisteredMesh previous_ = RegisteredWave(garment_.rest, 0, 1.2),
                       own_ = RegisteredWave(garment_.rest, 1, 1.2),
                       next_ = RegisteredWave(garment_.rest, 2, 1.2);
};

TEST_F(Temporal, SmoothsHiddenVerticesAndKeepsObservedOnesWithinTheirSigma) {
  for (const bool weigh_by_sigma : {false, true}) {
    TemporalOptions options;
    options.weigh_by_sigma = weigh_by_sigma;
    const auto refined = RefineInTime(model_, previous_, own_, next_, options);
    ASSERT_TRUE(refined.ok()) << refined.status();
    const auto truth = SheetAt(garment_.rest, 1);
    EXPECT_LT(UnseenError(refined->mesh, truth), 0.6 * UnseenError(own_, truth));
    for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
      EXPECT_EQ(refined->mesh.state[v], own_.state[v]);
      if (!IsUnseen(v)) {
        EXPECT_LE((refined->mesh.vertices_mm[v] - own_.vertices_mm[v]).norm(), own_.sigma_mm[v]);
        EXPECT_EQ(refined->mesh.sigma_mm[v], own_.sigma_mm[v]);
      }
    }
  }
}

TEST_F(Temporal, VerticesOnARayOfTheFrameStayThere) {
  const auto truth = SheetAt(garment_.rest, 1);
  std::vector<RayTarget> rays;
  RegisteredMesh own = own_;
  for (int v = 0; v < kWaveRows * kWaveCols; v += 2) {
    const Eigen::Vector3d camera_mm(500, 300, 1500);
    rays.push_back({v, camera_mm, (truth[v] - camera_mm).normalized(), 5e-5});
    if (IsUnseen(v)) own.vertices_mm[v] += rays.back().WayMm(own.vertices_mm[v]);
  }
  const auto without = RefineInTime(model_, previous_, own, next_, {});
  const auto with = RefineInTime(model_, previous_, own, next_, {}, rays);
  ASSERT_TRUE(without.ok() && with.ok());
  EXPECT_LT(UnseenError(with->mesh, truth), 0.7 * UnseenError(without->mesh, truth));
  for (const RayTarget& ray : rays) {
    if (IsUnseen(ray.vertex)) {
      EXPECT_LT(ray.WayMm(with->mesh.vertices_mm[ray.vertex]).norm(), 0.2);
    } else {
      EXPECT_EQ(with->mesh.vertices_mm[ray.vertex], without->mesh.vertices_mm[ray.vertex]);
    }
  }
}

TEST_F(Temporal, LeavesObservedVerticesAloneWhereAskedTo) {
  TemporalOptions options;
  options.max_observed_sigmas = 0;
  const auto refined = RefineInTime(model_, previous_, own_, next_, options);
  ASSERT_TRUE(refined.ok());
  for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
    if (IsUnseen(v)) continue;
    EXPECT_EQ(refined->mesh.vertices_mm[v], own_.vertices_mm[v]);
  }
}

// Five frames of an accelerating sheet, each vertex measured with noise of its own.
TEST_F(Temporal, SharesTheNoiseOfObservedVerticesOverThreeFrames) {
  constexpr double kPointNoiseMm = 0.04;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, kPointNoiseMm);
  std::vector<RegisteredMesh> measured, refined;
  for (int frame = 0; frame < 5; ++frame) {
    measured.push_back(RegisteredWave(garment_.rest, frame, 0.5));
    for (Eigen::Vector3d& p : measured.back().vertices_mm) {
      p += Eigen::Vector3d(noise(random), noise(random) + 0.4 * frame * frame, noise(random));
    }
  }
  for (int frame = 1; frame < 4; ++frame) {
    auto result = RefineInTime(model_, measured[frame - 1], measured[frame], measured[frame + 1], {});
    ASSERT_TRUE(result.ok()) << result.status();
    refined.push_back(std::move(result->mesh));
  }
  const auto observed = [](int v) { return !IsUnseen(v); };
  const auto truth = [&](int frame) {
    std::vector<Eigen::Vector3d> at = SheetAt(garment_.rest, frame);
    for (Eigen::Vector3d& p : at) p.y() += 0.4 * frame * frame;
    return at;
  };
  EXPECT_LT(testing::MeanError(refined[1].vertices_mm, truth(2), observed),
            0.85 * testing::MeanError(measured[2].vertices_mm, truth(2), observed));
  // How much a vertex jumps against its true way, from one frame to the next.
  const auto jump = [&](const RegisteredMesh& first, const RegisteredMesh& second) {
    double sum = 0;
    int count = 0;
    const auto from = truth(2), to = truth(3);
    for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
      if (IsUnseen(v)) continue;
      sum += (second.vertices_mm[v] - to[v] - first.vertices_mm[v] + from[v]).norm();
      ++count;
    }
    return sum / count;
  };
  EXPECT_LT(jump(refined[1], refined[2]), 0.55 * jump(measured[2], measured[3]));
}

TEST_F(Temporal, TrustsNeighboursThatSawWhatTheFrameDidNot) {
  RegisteredMesh before = previous_, after = next_;
  before.vertices_mm = SheetAt(garment_.rest, 0);
  after.vertices_mm = SheetAt(garment_.rest, 2);
  for (RegisteredMesh* mesh : {&before, &after}) {
    mesh->state.assign(kWaveRows * kWaveCols, VertexState::kObserved);
    mesh->sigma_mm.assign(kWaveRows * kWaveCols, 0.05f);
  }
  const auto refined = RefineInTime(model_, before, own_, after, {});
  ASSERT_TRUE(refined.ok());
  EXPECT_LT(UnseenError(refined->mesh, SheetAt(garment_.rest, 1)), 0.2);
  const int middle = kWaveRows / 2 * kWaveCols + kWaveCols / 2;
  EXPECT_EQ(refined->mesh.state[middle], VertexState::kInferred);
  EXPECT_LT(refined->mesh.sigma_mm[middle], own_.sigma_mm[middle]);
}

// The one before or the one after; the other one and the own frame know nothing of the place.
TEST_F(Temporal, CarriesOverWhatOneNeighbourSaw) {
  const std::vector<Eigen::Vector3d> truth = SheetAt(garment_.rest, 1);
  for (const bool before : {true, false}) {
    RegisteredMesh previous = previous_, next = next_;
    RegisteredMesh& seen = before ? previous : next;
    seen.vertices_mm = SheetAt(garment_.rest, before ? 0 : 2);
    seen.state.assign(seen.state.size(), VertexState::kObserved);
    seen.sigma_mm.assign(seen.sigma_mm.size(), 0.05f);
    const auto result = RefineInTime(model_, previous, own_, next, {});
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LT(UnseenError(result->mesh, truth), 0.2);
    EXPECT_GT(UnseenError(own_, truth), 0.5);
    for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
      if (!IsUnseen(v)) continue;
      ASSERT_EQ(result->mesh.state[v], VertexState::kInferred);
      ASSERT_LT(result->mesh.sigma_mm[v], own_.sigma_mm[v]);
    }
  }
}

TEST_F(Temporal, BridgesAFailedFrameAndSaysSo) {
  const RegisteredMesh before = RegisteredWave(garment_.rest, 0, 0),
                       after = RegisteredWave(garment_.rest, 3, 0);
  const auto bridge = BridgeInTime(model_, before, after, {1, 2}, {});
  ASSERT_TRUE(bridge.ok()) << bridge.status();
  const auto truth = SheetAt(garment_.rest, 1);
  EXPECT_LT(testing::MaxDistance(bridge->mesh.vertices_mm, truth), 1);
  for (int v = 0; v < kWaveRows * kWaveCols; ++v) {
    EXPECT_EQ(bridge->mesh.state[v], VertexState::kBridged);
    EXPECT_EQ(bridge->mesh.views[v], 0);
    EXPECT_GT(bridge->mesh.sigma_mm[v], before.sigma_mm[v]);
  }
  // No copy of either side.
  EXPECT_GT(testing::MaxDistance(bridge->mesh.vertices_mm, before.vertices_mm), 3);
  EXPECT_GT(testing::MaxDistance(bridge->mesh.vertices_mm, after.vertices_mm), 3);
}

TEST_F(Temporal, GivesTheSameBytesAtAnyThreadCount) {
  const tbb::global_control more_than_cores(tbb::global_control::max_allowed_parallelism, 4);
  const auto run = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return RefineInTime(model_, previous_, own_, next_, {}); });
  };
  const auto one = run(1), two = run(2), four = run(4);
  ASSERT_TRUE(one.ok() && two.ok() && four.ok());
  for (const auto* more : {&two, &four}) {
    EXPECT_EQ(std::memcmp(one->mesh.vertices_mm.data(), (*more)->mesh.vertices_mm.data(),
                          one->mesh.vertices_mm.size() * sizeof(Eigen::Vector3d)),
              0);
  }
}

TEST_F(Temporal, RefusesMeshesOfAnotherTemplateAndWrongOptions) {
  RegisteredMesh other = next_;
  other.vertices_mm.pop_back();
  EXPECT_EQ(RefineInTime(model_, previous_, own_, other, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(BridgeInTime(model_, previous_, next_, {0, 1}, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
  TemporalOptions options;
  options.weight = 0;
  EXPECT_THAT(RefineInTime(model_, previous_, own_, next_, options).status().message(),
              HasSubstr("temporal.weight"));
}

TEST_F(Temporal, StopsWhenCancelled) {
  const auto refined = RefineInTime(model_, previous_, own_, next_, {}, {}, [] { return true; });
  EXPECT_EQ(refined.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace weft

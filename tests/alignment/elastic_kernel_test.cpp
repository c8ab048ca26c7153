// The builds of the elastic kernels against each other and against the energies as they are defined.
#include "alignment/elastic_kernel.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "alignment/distortion.h"
#include "alignment/sliced_mesh.h"
#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

// A sheet of 13 x 9 vertices, no whole number of slices, everything about it at random.
struct CrumpledSheet {
  CrumpledSheet()
      : rest(testing::FlatSheet(13, 9)), graph(BuildMeshGraph(rest)), mesh(SliceMesh(rest, graph)) {
    const size_t size = static_cast<size_t>(mesh.slices) * kSliceLanes;
    std::mt19937 random(7);
    std::uniform_real_distribution<float> number(-1, 1);
    position.resize(4 * size), rotation.resize(4 * size);
    for (auto& target : targets) target.resize(size);
    for (auto& weight : weights) weight.resize(size);
    for (size_t v = 0; v < size; ++v) {
      const bool exists = v < rest.vertices_mm.size();
      Eigen::Quaternionf turn(2, number(random), number(random), number(random));
      turn.normalize();
      const float record[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
      for (int k = 0; k < 4; ++k) rotation[4 * v + k] = record[k];
      for (int k = 0; exists && k < 3; ++k) {
        position[4 * v + k] = static_cast<float>(rest.vertices_mm[v][k]) + number(random);
        targets[k][v] = position[4 * v + k] + number(random);
      }
      for (int k = 0; exists && k < 6; ++k)
        weights[k][v] = (k == 0 || k == 3 || k == 5 ? 2 : 0) + 0.5f * number(random);
    }
  }

  EnergyTables terms() const {
    EnergyTables tables{{}, {}, 3, 0.2f};
    for (int k = 0; k < 3; ++k) tables.target[k] = targets[k].data();
    for (int k = 0; k < 6; ++k) tables.weight[k] = weights[k].data();
    return tables;
  }

  TriangleMesh rest;
  MeshGraph graph;
  SlicedMesh mesh;
  Records position, rotation;
  std::vector<float> targets[3], weights[6];
};

struct KernelResults {
  double energy = 0;
  std::vector<float> half_gradient[3];
  Records fitted;
  bool operator==(const KernelResults&) const = default;
};

KernelResults ResultsOf(const ElasticKernels& kernels, const CrumpledSheet& sheet) {
  KernelResults out;
  float* half_gradient[3];
  for (int k = 0; k < 3; ++k) {
    out.half_gradient[k].resize(sheet.targets[k].size());
    half_gradient[k] = out.half_gradient[k].data();
  }
  out.fitted.resize(sheet.rotation.size());
  const SliceRange all{0, sheet.mesh.slices};
  out.energy = kernels.energy(sheet.mesh.tables(), all, sheet.terms(), sheet.position.data(),
                              sheet.rotation.data(), half_gradient);
  kernels.fit_rotations(sheet.mesh.tables(), all, {3, -1.4f, 0.7f, 2}, sheet.position.data(),
                        sheet.rotation.data(), out.fitted.data());
  return out;
}

TEST(ElasticKernels, GiveTheEnergiesByTheirDefinition) {
  const CrumpledSheet sheet;
  Deformation deformation;
  std::vector<Eigen::Vector3d> targets_mm;
  std::vector<Eigen::Matrix3d> weights;
  for (size_t v = 0; v < sheet.rest.vertices_mm.size(); ++v) {
    const float *p = &sheet.position[4 * v], *q = &sheet.rotation[4 * v];
    deformation.position_mm.emplace_back(p[0], p[1], p[2]);
    deformation.rotation.push_back(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix());
    targets_mm.emplace_back(sheet.targets[0][v], sheet.targets[1][v], sheet.targets[2][v]);
    const auto w = [&](int k) { return static_cast<double>(sheet.weights[k][v]); };
    weights.emplace_back(
        (Eigen::Matrix3d() << w(0), w(1), w(2), w(1), w(3), w(4), w(2), w(4), w(5)).finished());
  }
  const double expected = DetectionEnergy(targets_mm, weights, deformation.position_mm) +
                          ReducedDistortionEnergy(sheet.rest, sheet.graph, deformation, {3, 0.2});
  EXPECT_NEAR(ResultsOf(BestElasticKernels(), sheet).energy, expected, 1e-5 * expected);
}

#ifdef __x86_64__
TEST(ElasticKernels, SameBytesFromEveryInstructionSet) {
  const CrumpledSheet sheet;
  const KernelResults expected = ResultsOf(baseline::kElasticKernels, sheet);
  EXPECT_NE(expected.fitted, sheet.rotation);
  if (__builtin_cpu_supports("avx2")) {
    EXPECT_EQ(ResultsOf(avx2::kElasticKernels, sheet), expected);
  }
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
    EXPECT_EQ(ResultsOf(avx512::kElasticKernels, sheet), expected);
  }
}
#endif

}  // namespace
}  // namespace weft

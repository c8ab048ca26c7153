#include "pattern/image/ink_model.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace weft {
namespace {

// As ink_model.h describes the model: the share of a uniform component, over a volume of 4.
constexpr double kOutlierShare = 0.01, kUniform = kOutlierShare / 4;
// Variance that is added to every ink's, for what light and print vary.
constexpr double kFloorVariance = 0.03 * 0.03;

Eigen::Vector3d ToEigen(const Rgb& color) { return {color[0], color[1], color[2]}; }

double Density(const Eigen::Vector3d& color, const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d off = color - mean;
  return std::exp(-0.5 * off.dot(covariance.inverse() * off)) /
         std::sqrt(std::pow(2 * M_PI, 3) * covariance.determinant());
}

struct Gaussian {
  Eigen::Vector3d mean;
  Eigen::Matrix3d root;  // of the covariance

  Eigen::Matrix3d Covariance() const { return root * root.transpose(); }
};

// Far from each other, each with a covariance of its own.
std::vector<Gaussian> SomeInks(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<Gaussian> inks;
  for (int k = 0; k < kCellColors; ++k) {
    Gaussian ink;
    ink.mean = {0.5 + 0.5 * (k % 2), 0.5 + 0.5 * (k / 2 % 2), 0.5 + 0.5 * (k / 4 % 2)};
    for (int a = 0; a < 9; ++a) ink.root(a / 3, a % 3) = 0.03 * normal(random) + (a % 4 == 0 ? 0.06 : 0);
    inks.push_back(ink);
  }
  return inks;
}

std::vector<InkSample> DrawSamples(const std::vector<Gaussian>& inks, int of_each, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<InkSample> samples;
  for (int n = 0; n < of_each; ++n) {
    for (int k = 0; k < kCellColors; ++k) {
      const Eigen::Vector3d z(normal(random), normal(random), normal(random));
      const Eigen::Vector3d c = inks[k].mean + inks[k].root * z;
      samples.push_back({{static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())},
                         static_cast<CellColor>(k)});
    }
  }
  return samples;
}

// The model's squared Mahalanobis distance of `off` from an ink's mean, from densities alone.
double SquaredDistance(const InkModel& model, int ink, const Eigen::Vector3d& off) {
  const auto density = [&](const Eigen::Vector3d& at) {
    const Rgb color = {static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())};
    return model.Likelihoods(color)[ink] - kUniform;
  };
  const Eigen::Vector3d mean = ToEigen(model.mean(static_cast<CellColor>(ink)));
  return 2 * std::log(density(mean) / density(mean + off));
}

const InkModel& Start() {
  static const InkModel start = InkModel::Faded(0.35f, {1, 1, 1});
  return start;
}

TEST(InkModel, FittedRecoversMeansAndCovariances) {
  for (const uint32_t seed : {1, 2, 3}) {
    std::mt19937 random(seed);
    const std::vector<Gaussian> inks = SomeInks(random);
    const InkModel model = InkModel::Fitted(DrawSamples(inks, 4000, random), Start());
    for (int k = 0; k < kCellColors; ++k) {
      const Eigen::Matrix3d covariance = inks[k].Covariance();
      const Eigen::Vector3d off = ToEigen(model.mean(static_cast<CellColor>(k))) - inks[k].mean;
      EXPECT_LT(std::sqrt(off.dot(covariance.inverse() * off)), 0.1) << "mean of ink " << k;
      // Along any direction the scatter is that of the samples, or somewhat more: what the cut of the
      // outermost tenth takes away from heavy tails is given back to these.
      const Eigen::Matrix3d full = covariance + kFloorVariance * Eigen::Matrix3d::Identity();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(full);
      for (int axis = 0; axis < 3; ++axis) {
        const double sigma = std::sqrt(axes.eigenvalues()[axis]);
        const double measured = SquaredDistance(model, k, sigma * axes.eigenvectors().col(axis));
        EXPECT_GT(1 / measured, 0.95) << "variance of ink " << k;
        EXPECT_LT(1 / measured, 1.9) << "variance of ink " << k;
      }
    }
  }
}

TEST(InkModel, FittedIgnoresATwelfthOfOutliers) {
  for (const uint32_t seed : {4, 5, 6}) {
    std::mt19937 random(seed);
    const std::vector<Gaussian> inks = SomeInks(random);
    std::vector<InkSample> samples = DrawSamples(inks, 1200, random);
    const InkModel clean = InkModel::Fitted(samples, Start());
    // Cells on the wrong board cell: any other ink's colour.
    for (size_t k = 0; k < samples.size(); k += 12) samples[k].color = samples[k + 1 + random() % 6].color;
    const InkModel model = InkModel::Fitted(samples, Start());
    for (int k = 0; k < kCellColors; ++k) {
      const Eigen::Vector3d off = ToEigen(model.mean(static_cast<CellColor>(k))) - inks[k].mean;
      EXPECT_LT(off.norm(), 0.02) << "ink " << k;
      for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(0.05, 0.05, 0.08)}) {
        const double ratio = SquaredDistance(model, k, axis) / SquaredDistance(clean, k, axis);
        EXPECT_GT(ratio, 0.35) << "ink " << k;
        EXPECT_LT(ratio, 1.2) << "ink " << k;
      }
    }
  }
}

TEST(InkModel, InksWithFewSamplesStayAsTheyWere) {
  std::mt19937 random(7);
  std::vector<InkSample> samples = DrawSamples(SomeInks(random), 200, random);
  std::erase_if(samples,
                [n = 0](const InkSample& s) mutable { return s.label == CellColor::kBlue && ++n > 11; });
  const InkModel model = InkModel::Fitted(samples, Start());
  EXPECT_EQ(model.mean(CellColor::kBlue), Start().mean(CellColor::kBlue));
  EXPECT_NE(model.mean(CellColor::kRed), Start().mean(CellColor::kRed));
  const int blue = static_cast<int>(CellColor::kBlue);
  const Rgb near_blue = {0.6f, 0.7f, 1.2f};
  EXPECT_EQ(model.Likelihoods(near_blue)[blue], Start().Likelihoods(near_blue)[blue]);
}

TEST(InkModel, FadedInksAreTheBoardsColoursMixedWithGrey) {
  const Rgb light = {0.9f, 1.2f, 0.7f};
  for (const double fade : {0.0, 0.4, 0.75}) {
    const InkModel model = InkModel::Faded(static_cast<float>(fade), light);
    Eigen::Matrix<double, kCellColors, 3> mixed;
    for (int k = 0; k < kCellColors; ++k) {
      const auto rgb = CellColorRgb(static_cast<CellColor>(k));
      const Eigen::Vector3d color = Eigen::Vector3d(rgb[0], rgb[1], rgb[2]) / 255;
      mixed.row(k) = ((1 - fade) * color + fade * color.mean() * Eigen::Vector3d::Ones()).transpose();
    }
    for (int k = 0; k < kCellColors; ++k) {
      Eigen::Vector3d mean;
      for (int c = 0; c < 3; ++c) mean[c] = mixed(k, c) * light[c] / mixed.col(c).mean();
      EXPECT_LT((ToEigen(model.mean(static_cast<CellColor>(k))) - mean).norm(), 1e-5);
      // Light varies by a fifth along the colour, noise by a tenth.
      const Eigen::Matrix3d covariance =
          0.04 * mean * mean.transpose() + (0.01 + kFloorVariance) * Eigen::Matrix3d::Identity();
      for (const Rgb color : {Rgb{1, 1, 1}, Rgb{0.3f, 0.9f, 0.4f}, Rgb{1.5f, 0.2f, 0.1f}}) {
        const double expected = (1 - kOutlierShare) * Density(ToEigen(color), mean, covariance) + kUniform;
        EXPECT_NEAR(model.Likelihoods(color)[k], expected, 1e-4 * expected) << "ink " << k;
      }
    }
  }
}

TEST(InkModel, DensitiesIntegrateToTheShareOfTheirGaussian) {
  std::mt19937 random(8);
  const InkModel fitted = InkModel::Fitted(DrawSamples(SomeInks(random), 300, random), Start());
  for (const InkModel& model : {Start(), fitted}) {
    constexpr double kStep = 0.05;
    std::array<double, kCellColors> sum = {};
    for (double r = -1; r < 3.5; r += kStep) {
      for (double g = -1; g < 3.5; g += kStep) {
        for (double b = -1; b < 3.5; b += kStep) {
          const auto density =
              model.Likelihoods({static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)});
          for (int k = 0; k < kCellColors; ++k) sum[k] += (density[k] - kUniform) * std::pow(kStep, 3);
        }
      }
    }
    for (int k = 0; k < kCellColors; ++k) EXPECT_NEAR(sum[k], 1 - kOutlierShare, 0.004) << "ink " << k;
  }
}

TEST(InkModel, ColoursThatAreNoInkAreEquallyLikelyUnderAll) {
  for (const float likelihood : Start().Likelihoods({9, 0, 5})) EXPECT_NEAR(likelihood, kUniform, 1e-9);
}

}  // namespace
}  // namespace weft

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "base/median.h"
#include "pattern/view_decoder.h"
#include "simulation/observation_model.h"
#include "tests/benchmark/decode_score.h"
#include "tests/benchmark/logistic_fit.h"
#include "tests/benchmark/refit.h"

namespace weft::testing {
namespace {

// The mean of log(r / sigma) where r is the length of a Gaussian error in the plane, sigma per axis: (log 2 -
// Euler's constant) / 2.
constexpr double kMeanLogRayleigh = 0.0579657578;

struct Outcome {
  CellSight sight;
  bool found = false;
  double error_px = 0;  // of what was found
};

absl::Status AddOutcomes(const std::vector<std::string>& folders, std::vector<Outcome>* out) {
  for (const std::string& folder : folders) {
    const auto take = ReadTrueTake(folder);
    if (!take.ok()) return take.status();
    const auto index = BoardIndex::Build(take->board);
    if (!index.ok()) return index.status();
    for (const TrueView& view : take->views) {
      const auto decoder = ViewDecoder::Read(view.image, *index, {});
      if (!decoder.ok()) return decoder.status();
      (*decoder)->Decode();
      const NodesOfView truth(view);
      std::map<BoardNode, double> right;
      for (const Observation& seen : (*decoder)->Observations()) {
        if (seen.node.kind != NodeKind::kCenter) continue;
        if (truth.Assess(seen.node, seen.x_px, seen.y_px) != Verdict::kRight) continue;
        const Eigen::Vector2d& at = truth.Find(seen.node)->pixel_px;
        right[seen.node] = std::hypot(seen.x_px - at.x(), seen.y_px - at.y());
      }
      const SeenCells cells = SightsOf(view.truth);
      for (size_t k = 0; k < cells.at.size(); ++k) {
        const auto found = right.find(view.truth.nodes[cells.at[k]].node);
        out->push_back({cells.sight[k], found != right.end(), found == right.end() ? 0 : found->second});
      }
    }
  }
  return absl::OkStatus();
}

Eigen::VectorXd Regressors(const CellSight& sight) {
  const std::array<double, kSightRegressors> x = RegressorsOf(sight);
  return Eigen::Map<const Eigen::VectorXd>(x.data(), kSightRegressors);
}

LogisticModel FitFound(const std::vector<Outcome>& outcomes) {
  constexpr double kRidge = 10;
  return FitLogistic(kSightRegressors, kRidge, [&](const auto& add) {
    for (const Outcome& o : outcomes) add(Regressors(o.sight), o.found, 1);
  });
}

// Least squares of the errors' logarithms: a few wild errors count little.
LogisticModel FitSigma(const std::vector<Outcome>& outcomes) {
  Eigen::MatrixXd normal = 1e-9 * Eigen::MatrixXd::Identity(1 + kSightRegressors, 1 + kSightRegressors);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(1 + kSightRegressors);
  for (const Outcome& o : outcomes) {
    if (!o.found || !(o.error_px > 0)) continue;
    Eigen::VectorXd x(1 + kSightRegressors);
    x << 1, Regressors(o.sight);
    normal += x * x.transpose();
    right += (std::log(o.error_px) - kMeanLogRayleigh) * x;
  }
  const Eigen::VectorXd all = normal.ldlt().solve(right);
  return {all[0], all.tail(kSightRegressors)};
}

void PrintWeights(const char* name, const LogisticModel& model) {
  std::printf("constexpr std::array<double, 1 + kSightRegressors> %s = {%.3f", name, model.constant);
  for (const double weight : model.weights) std::printf(", %.3f", weight);
  std::printf("};\n");
}

// Shares and errors against what the models say, by class of cell.
void PrintCalibration(const std::string& name, const std::vector<Outcome>& outcomes,
                      const LogisticModel& found, const LogisticModel& sigma) {
  constexpr std::array<double, 6> kPitchPx = {0, 4, 6, 8, 12, 1e9};
  std::printf("// %s: found, the model's share; median error, the model's (px)\n", name.c_str());
  std::printf("// %-20s %8s %8s %8s %8s %8s\n", "pitch, edge", "cells", "found", "model", "error", "model");
  for (size_t p = 0; p + 1 < kPitchPx.size(); ++p) {
    for (int edge = 1; edge <= CellSight::kFarFromEdge; ++edge) {
      double cells = 0, seen = 0, expected = 0;
      std::vector<double> errors, sigmas;
      for (const Outcome& o : outcomes) {
        if (o.sight.edge_cells != edge || o.sight.pitch_px < kPitchPx[p] ||
            o.sight.pitch_px >= kPitchPx[p + 1])
          continue;
        const Eigen::VectorXd x = Regressors(o.sight);
        ++cells;
        seen += o.found ? 1 : 0;
        expected += 1 / (1 + std::exp(-found.LogOdds(x)));
        if (!o.found) continue;
        errors.push_back(o.error_px);
        sigmas.push_back(std::exp(sigma.LogOdds(x)));
      }
      if (cells < 50 || errors.empty()) continue;
      // Half of the errors of a Gaussian in the plane are below 1.1774 of its standard deviation per axis.
      std::printf("// from %2.0f px, %s%d %9s %7.0f %7.1f%% %7.1f%% %8.3f %8.3f\n", kPitchPx[p],
                  edge == CellSight::kFarFromEdge ? ">=" : "  ", edge, "", cells, 100 * seen / cells,
                  100 * expected / cells, Quantile(errors, 0.5), 1.1774 * Quantile(sigmas, 0.5));
    }
  }
}

}  // namespace

absl::Status RefitObservation(const RefitTakes& takes) {
  std::vector<Outcome> fitted, held_out;
  absl::Status status = AddOutcomes(takes.fitted, &fitted);
  if (status.ok()) status = AddOutcomes(takes.held_out, &held_out);
  if (!status.ok()) return status;
  const LogisticModel found = FitFound(fitted), sigma = FitSigma(fitted);
  PrintCalibration("fitted", fitted, found, sigma);
  if (!held_out.empty()) PrintCalibration("held out", held_out, found, sigma);
  PrintWeights("kFoundLogOdds", found);
  PrintWeights("kLogSigmaPx", sigma);
  return absl::OkStatus();
}

}  // namespace weft::testing

#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "base/median.h"
#include "pattern/view_decoder.h"
#include "tests/benchmark/decode_score.h"
#include "tests/benchmark/refit.h"

namespace weft::testing {
namespace {

constexpr std::array<const char*, 4> kNames = {"8 around", "5 to 7", "3 to 4", "0 to 2"};
int KindOf(int around) { return around == 8 ? 0 : around >= 5 ? 1 : around >= 3 ? 2 : 3; }

// Errors over CellFit::sigma_px of right cells, by how many cells are known around.
using Ratios = std::array<std::vector<double>, kNames.size()>;

absl::Status AddRatios(const std::string& folder, Ratios* ratios) {
  return ForEachView(folder, [ratios](const NodesOfView& truth, ViewDecoder& decoder) {
    decoder.Decode();
    const BoardState& state = decoder.state();
    for (const ViewCell& cell : state.cells()) {
      const BoardNode node{cell.row, cell.col, NodeKind::kCenter};
      const CellPose& pose = cell.fit.pose;
      if (truth.Assess(node, pose.x, pose.y) != Verdict::kRight) continue;
      const NodeTruth& at = *truth.Find(node);
      const int around = __builtin_popcount(state.Around(cell.row, cell.col));
      (*ratios)[KindOf(around)].push_back(std::hypot(pose.x - at.pixel_px.x(), pose.y - at.pixel_px.y()) /
                                          cell.fit.sigma_px);
    }
  });
}

// The factor by which a share of the errors is as large as a Gaussian with sigma per axis says.
double FactorAt(const std::vector<double>& ratios, double share) {
  return Quantile(ratios, share) / std::sqrt(-2 * std::log(1 - share));
}

void Print(const std::string& name, const Ratios& ratios) {
  std::printf("// %s\n// %-10s %8s %7s %7s %7s %7s\n", name.c_str(), "", "cells", "rms", "50 %", "68 %",
              "95 %");
  for (size_t k = 0; k < kNames.size(); ++k) {
    double squares = 0;
    for (const double ratio : ratios[k]) squares += ratio * ratio;
    if (ratios[k].empty()) continue;
    std::printf("// %-10s %8zu %7.2f %7.2f %7.2f %7.2f\n", kNames[k], ratios[k].size(),
                std::sqrt(squares / static_cast<double>(2 * ratios[k].size())), FactorAt(ratios[k], 0.5),
                FactorAt(ratios[k], 0.68), FactorAt(ratios[k], 0.95));
  }
}

}  // namespace

absl::Status RefitSigma(const RefitTakes& takes) {
  Ratios all;
  for (const std::string& folder : takes.fitted) {
    Ratios of_take;
    if (absl::Status status = AddRatios(folder, &of_take); !status.ok()) return status;
    Print(folder, of_take);
    for (size_t k = 0; k < all.size(); ++k) all[k].insert(all[k].end(), of_take[k].begin(), of_take[k].end());
  }
  Print("all takes", all);
  for (const std::string& folder : takes.held_out) {
    Ratios of_take;
    if (absl::Status status = AddRatios(folder, &of_take); !status.ok()) return status;
    Print("held out: " + folder, of_take);
  }
  std::vector<double> pooled;
  for (const auto& ratios : all) pooled.insert(pooled.end(), ratios.begin(), ratios.end());
  std::printf("inline constexpr float kSigmaFactor = %.1ff;\n", FactorAt(pooled, 0.68));
  return absl::OkStatus();
}

}  // namespace weft::testing

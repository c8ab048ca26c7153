#include <array>
#include <cstdio>
#include <utility>
#include <vector>

#include "base/median.h"
#include "pattern/surface/growth.h"
#include "pattern/view_decoder.h"
#include "tests/benchmark/decode_score.h"
#include "tests/benchmark/refit.h"

namespace weft::testing {
namespace {

constexpr int kSteps = 4;      // of a fit in growth
constexpr size_t kEvery = 11;  // th cell

// What is added to the explained share after the first step, two, three.
using Gains = std::array<std::vector<double>, kSteps - 1>;

// Weighs the neighbours as growth does that knows one of them.
PredictedCell PredictedFrom(const ViewCell& near, const ViewCell& cell) {
  constexpr float kUnknownWeight = 0.3f;
  const auto dr = static_cast<float>(cell.row - near.row), dc = static_cast<float>(cell.col - near.col);
  PredictedCell predicted{.row = cell.row, .col = cell.col, .pose = near.fit.pose.Shifted(dc, dr)};
  predicted.in_sight.fill(kUnknownWeight);
  predicted.in_sight[4] = 1;
  predicted.in_sight[static_cast<size_t>(4 - 3 * (cell.row - near.row) - (cell.col - near.col))] = 1;
  return predicted;
}

// Fits that are taken in the end count; most need one step only, so a limit has to leave 99.9 % of them.
void AddFit(const CellFitter& fitter, const PredictedCell& predicted, Gains* gains) {
  const FitLimits limits = GrowthOptions().fit;
  const CellFit last = fitter.Fit(predicted, {.iterations = kSteps, .min_explained = -1e9f});
  if (Reject(last, limits)) return;
  for (int steps = 1; steps < kSteps; ++steps) {
    const CellFit fit = fitter.Fit(predicted, {.iterations = steps, .min_explained = -1e9f});
    (*gains)[steps - 1].push_back(last.explained - fit.explained);
  }
}

absl::Status AddTake(const std::string& folder, Gains* gains) {
  return ForEachView(folder, [gains](const NodesOfView& truth, ViewDecoder& decoder) {
    decoder.Decode();
    const CellFitter* fitter = decoder.fitter();
    if (fitter == nullptr) return;
    const BoardState& state = decoder.state();
    for (size_t k = 0; k < state.cells().size(); k += kEvery) {
      const ViewCell& cell = state.cells()[k];
      const BoardNode node{cell.row, cell.col, NodeKind::kCenter};
      if (truth.Assess(node, cell.fit.pose.x, cell.fit.pose.y) != Verdict::kRight) continue;
      for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
        if (const ViewCell* near = state.Find(cell.row + dr, cell.col + dc))
          AddFit(*fitter, PredictedFrom(*near, cell), gains);
      }
    }
  });
}

void Print(const char* name, const Gains& gains) {
  std::printf("// %s: %zu fits\n// %-12s %8s %8s %8s %8s\n", name, gains[0].size(), "steps done", "50 %",
              "95 %", "99 %", "99.9 %");
  for (size_t k = 0; k < gains.size(); ++k) {
    std::printf("// %-12zu %8.3f %8.3f %8.3f %8.3f\n", k + 1, Quantile(gains[k], 0.5),
                Quantile(gains[k], 0.95), Quantile(gains[k], 0.99), Quantile(gains[k], 0.999));
  }
}

}  // namespace

absl::Status RefitRejection(const RefitTakes& takes) {
  Gains fitted, held_out;
  for (const std::string& folder : takes.fitted) {
    if (absl::Status status = AddTake(folder, &fitted); !status.ok()) return status;
  }
  for (const std::string& folder : takes.held_out) {
    if (absl::Status status = AddTake(folder, &held_out); !status.ok()) return status;
  }
  Print("fitted", fitted);
  if (!takes.held_out.empty()) Print("held out", held_out);
  std::printf("constexpr float kStillToGain[] = {%.2ff, %.2ff, %.2ff};\n", Quantile(fitted[0], 0.999),
              Quantile(fitted[1], 0.999), Quantile(fitted[2], 0.999));
  return absl::OkStatus();
}

}  // namespace weft::testing

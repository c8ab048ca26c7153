#include <array>
#include <cstdio>
#include <string>
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

// How far the explained share ends above what a step predicts: the first one of all, the second, the third;
// and that of a fit of one step.
struct Surpluses {
  std::array<std::vector<double>, kSteps - 1> of_all;
  std::vector<double> of_one;
};

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
void AddFit(const CellFitter& fitter, const PredictedCell& predicted, Surpluses* surpluses) {
  const auto fit_in = [&](int steps) {
    return fitter.Fit(predicted, {.iterations = steps, .min_explained = -1e9f});
  };
  const CellFit last = fit_in(kSteps), first = fit_in(1);
  if (!Reject(first, GrowthOptions().fit)) surpluses->of_one.push_back(first.explained - first.predicted);
  if (Reject(last, GrowthOptions().fit)) return;
  for (int steps = 1; steps < kSteps; ++steps)
    surpluses->of_all[steps - 1].push_back(last.explained - fit_in(steps).predicted);
}

absl::Status AddTake(const std::string& folder, Surpluses* surpluses) {
  return ForEachView(folder, [surpluses](const NodesOfView& truth, ViewDecoder& decoder) {
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
          AddFit(*fitter, PredictedFrom(*near, cell), surpluses);
      }
    }
  });
}

void Print(const char* name, const Surpluses& surpluses) {
  std::printf("// %s\n// %-12s %8s %8s %8s %8s %8s\n", name, "step", "fits", "50 %", "95 %", "99 %",
              "99.9 %");
  const auto print = [](const std::string& step, const std::vector<double>& values) {
    std::printf("// %-12s %8zu %8.3f %8.3f %8.3f %8.3f\n", step.c_str(), values.size(), Quantile(values, 0.5),
                Quantile(values, 0.95), Quantile(values, 0.99), Quantile(values, 0.999));
  };
  for (int k = 0; k + 1 < kSteps; ++k) print(std::to_string(k + 1), surpluses.of_all[k]);
  print("the only one", surpluses.of_one);
}

}  // namespace

absl::Status RefitRejection(const RefitTakes& takes) {
  Surpluses fitted, held_out;
  for (const std::string& folder : takes.fitted) {
    if (absl::Status status = AddTake(folder, &fitted); !status.ok()) return status;
  }
  for (const std::string& folder : takes.held_out) {
    if (absl::Status status = AddTake(folder, &held_out); !status.ok()) return status;
  }
  Print("fitted", fitted);
  if (!takes.held_out.empty()) Print("held out", held_out);
  std::printf("constexpr float kAbovePrediction[] = {%.2ff, %.2ff, %.2ff}, kAbovePredictionOfOne = %.2ff;\n",
              Quantile(fitted.of_all[0], 0.999), Quantile(fitted.of_all[1], 0.999),
              Quantile(fitted.of_all[2], 0.999), Quantile(fitted.of_one, 0.999));
  return absl::OkStatus();
}

}  // namespace weft::testing

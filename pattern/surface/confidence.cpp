#include "pattern/surface/confidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "pattern/surface/center_sweep.h"
#include "pattern/surface/edge_runs.h"

namespace weft {
namespace {

// Weights of the evidence, in its order. `refit_decode confidence` prints them from the takes of
// docs/decoding-accuracy.md, "Data for fitted constants" (November 2026).
constexpr float kConstant = -7.36f;
constexpr Evidence kWeights = {3.32f,  1.20f,  2.56f,  2.24f,  2.37f,  -0.58f,
                               -0.27f, -0.18f, -0.43f, -1.04f, -1.01f, -0.73f};

// Least log odds of a cell that was read: of 130,000 in takes of `weft simulate`, all of pieces above 20 nats
// were right. In narrow strips most neighbours are missing, which says little then.
constexpr float kReadLogOdds = 6;

float Length(float x, float y) { return std::sqrt(x * x + y * y); }

// How clearly the ink leads the others, 0 to 1.
float RelativeLead(const CellFit& fit) {
  const float contrast2 = std::max(fit.center_contrast * fit.center_contrast, 1e-6f);
  return std::clamp(fit.ink_lead / contrast2, 0.0f, 1.0f);
}

// Sums over the cells around one.
struct Surroundings {
  float known = 0, explained = 0, light = 0, lead = 0, shape = 0;
  // Where they expect the cell, less where it is; each half way between what its own edges say and what the
  // cell's edges say. In px, with weights.
  float x = 0, y = 0, weights = 0;
  std::array<bool, 9> present = {};  // or cut off by the border of the image

  void Add(const CellPose& here, const CellFit& near, float dr, float dc) {
    const CellPose& f = near.pose;
    known += 1;
    explained += std::clamp(near.explained, 0.0f, 1.0f);
    light += near.gain;
    lead += RelativeLead(near);
    shape += (Length(here.ax - f.ax, here.ay - f.ay) + Length(here.bx - f.bx, here.by - f.by)) /
             here.ShorterEdge();
    const float weight = dc != 0 && dr != 0 ? 0.5f : 1.0f;
    x += weight * (f.x - 0.5f * (dc * (f.ax + here.ax) + dr * (f.bx + here.bx)) - here.x);
    y += weight * (f.y - 0.5f * (dc * (f.ay + here.ay) + dr * (f.by + here.by)) - here.y);
    weights += weight;
  }

  // Distance between a cell and where it is expected, in cells.
  float Misfit(const CellPose& here) const {
    return Length(here.by * x - here.bx * y, here.ax * y - here.ay * x) / (weights * here.Area());
  }
};

Surroundings Around(const BoardState& state, const ViewCell& cell) {
  const CellPose& f = cell.fit.pose;
  Surroundings around;
  for (int k = 0; k < 9; ++k) {
    const ViewCell* other = state.Find(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    const float dr = static_cast<float>(k / 3 - 1), dc = static_cast<float>(k % 3 - 1);
    const float x = f.x + dc * f.ax + dr * f.bx, y = f.y + dc * f.ay + dr * f.by;
    const bool outside = x < 0 || y < 0 || x > static_cast<float>(state.width_px() - 1) ||
                         y > static_cast<float>(state.height_px() - 1);
    around.present[k] = other != nullptr || outside;
    if (k != 4 && other != nullptr) around.Add(f, other->fit, dr, dc);
  }
  return around;
}

float LogOdds(const Evidence& evidence) {
  float odds = kConstant;
  for (int k = 0; k < kReasons; ++k) odds += kWeights[k] * evidence[k];
  return odds;
}

}  // namespace

std::optional<Evidence> EvidenceFor(const BoardState& state, const ViewCell& cell) {
  const Surroundings around = Around(state, cell);
  if (around.known == 0) return std::nullopt;
  const CellFit& fit = cell.fit;
  const auto& p = around.present;
  const auto count = [&p](std::initializer_list<int> places) {
    return static_cast<float>(std::count_if(places.begin(), places.end(), [&p](int k) { return p[k]; }));
  };
  const float quads = static_cast<float>(p[0] && p[1] && p[3]) + static_cast<float>(p[1] && p[2] && p[5]) +
                      static_cast<float>(p[3] && p[6] && p[7]) + static_cast<float>(p[5] && p[7] && p[8]);
  const CellPose& f = fit.pose;
  const float height_px = f.Area() / std::max(Length(f.ax, f.ay), Length(f.bx, f.by));
  const float share = 1 / around.known;
  const int run = RunAtEdge(state, cell.row, cell.col);
  // A fit of chance may have no light, or less than none.
  const float relative_gain = std::max(fit.gain / (share * around.light), 0.1f);
  const float light = std::min(std::abs(std::log(relative_gain)), 2.0f);
  return Evidence{share * around.explained,
                  RelativeLead(fit),
                  share * around.lead,
                  count({0, 1, 2, 3, 5, 6, 7, 8}) / 8,
                  quads / 4,
                  std::log(std::clamp(around.Misfit(f), 0.01f, 1.0f)),
                  std::log(std::max(light, 0.005f)),
                  std::log(std::clamp(share * around.shape, 0.02f, 2.0f)),
                  std::log(std::clamp(fit.sigma_px / height_px, 0.005f, 1.0f)),
                  static_cast<float>(run == 1),
                  static_cast<float>(run == 2),
                  static_cast<float>(run == 3)};
}

float Confidence(const ViewCell& cell, const std::optional<Evidence>& evidence) {
  if (!evidence) return 0;
  float log_odds = LogOdds(*evidence);
  if (cell.is_read) log_odds = std::max(log_odds, kReadLogOdds);
  return 1 / (1 + std::exp(-log_odds));
}

void ScoreCells(const CellFitter& fitter, BoardState* state) {
  SweepUnscored(fitter, state);
  for (size_t k = 0; k < state->cells().size(); ++k) {
    ViewCell& cell = state->cell(k);
    // What has changed along an edge may be farther away than what the sweep looks at.
    if (!state->IsScored(cell) || RunAtEdge(*state, cell.row, cell.col) != kNoEdge)
      cell.confidence = Confidence(cell, EvidenceFor(*state, cell));
  }
  state->MarkScored();
}

}  // namespace weft

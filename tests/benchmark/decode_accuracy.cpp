// How right decoding is, and whether it knows: recall and precision, errors against sigma_px by class and
// against the Cramer-Rao bound (center_bound.h), and confidence against the share that is right. Usage:
// accuracy_decode [--darker N] [TAKE...] with folders that `weft simulate` wrote; without any, a small take
// is made here. The first and middle frame of each are judged. With --darker, pictures are made N times as
// dark.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/median.h"
#include "tests/benchmark/center_bound.h"
#include "tests/benchmark/decode_score.h"

namespace weft {
namespace {

using testing::DecodeScore;
using testing::ScoredObservation;

void PrintClass(const char* name, const std::vector<ScoredObservation>& all,
                const std::function<bool(const ScoredObservation&)>& in) {
  std::vector<double> errors, ratios;
  double squares = 0, beyond = 0;
  for (const ScoredObservation& j : all) {
    if (!j.right || !in(j)) continue;
    beyond += j.beyond;
    errors.push_back(j.error_px);
    ratios.push_back(j.error_px / j.sigma_px);
    squares += ratios.back() * ratios.back();
  }
  const double rms = std::sqrt(squares / static_cast<double>(std::max<size_t>(ratios.size(), 1)));
  const double coordinates = 2 * static_cast<double>(std::max<size_t>(ratios.size(), 1));
  std::printf("%-22s %8zu  %6.3f %6.3f   %6.2f %6.2f %6.2f %6.2f  %6.2f\n", name, errors.size(),
              Quantile(errors, 0.5), Quantile(errors, 0.95), rms, Quantile(ratios, 0.5),
              Quantile(ratios, 0.95), Quantile(ratios, 0.99), 100 * beyond / coordinates);
}

void PrintPrecision(const DecodeScore& score) {
  std::printf("precision: %.5f (%zu cells wrong)\n", score.Precision(), score.WrongCells());
  size_t all[3] = {}, wrong[3] = {}, on_crest[3] = {};
  for (const ScoredObservation& o : score.observations) {
    if (o.node.kind != NodeKind::kCenter) continue;
    const int kind = o.pitch_px >= 3 ? 0 : o.pitch_px > 0 ? 1 : 2;
    ++all[kind];
    wrong[kind] += !o.right;
    on_crest[kind] += o.on_crest;
  }
  constexpr const char* kKinds[] = {"of 3 px and more", "of less", "nowhere in sight"};
  for (int k = 0; k < 3; ++k) {
    std::printf("  of %6zu %-17s %5zu wrong, %5zu of them on the crest of a fold\n", all[k], kKinds[k],
                wrong[k], on_crest[k]);
  }
  std::printf("\n");
}

void PrintErrors(const std::vector<ScoredObservation>& all) {
  std::printf("%-22s %8s  %13s   %27s  %s\n", "", "", "error px", "error / sigma_px", "an axis,");
  std::printf("%-22s %8s  %6s %6s   %6s %6s %6s %6s  %s\n", "class", "n", "50 %", "95 %", "rms", "50 %",
              "95 %", "99 %", "% > 3");
  // Of two axes that each err by sigma.
  std::printf("%-22s %8s  %6s %6s   %6.2f %6.2f %6.2f %6.2f  %6.2f\n", "(as sigma_px says)", "", "", "", 1.41,
              1.18, 2.45, 3.03, 0.27);
  const auto cell = [](const ScoredObservation& j) { return j.node.kind == NodeKind::kCenter; };
  PrintClass("cells", all, cell);
  PrintClass("  inside, 8 around", all,
             [&](const ScoredObservation& j) { return cell(j) && j.neighbors == 8; });
  PrintClass("  border, 5 to 7", all,
             [&](const ScoredObservation& j) { return cell(j) && j.neighbors >= 5 && j.neighbors < 8; });
  PrintClass("  border, 0 to 4", all, [&](const ScoredObservation& j) { return cell(j) && j.neighbors < 5; });
  constexpr std::array<double, 7> kPitches = {0, 3, 4, 5, 7, 10, 1e9};
  for (size_t k = 0; k + 1 < kPitches.size(); ++k) {
    const std::string name =
        kPitches[k + 1] > 1e6 ? "  pitch above 10 px"
                              : "  pitch below " + std::to_string(static_cast<int>(kPitches[k + 1])) + " px";
    PrintClass(name.c_str(), all, [&](const ScoredObservation& j) {
      return cell(j) && j.pitch_px >= kPitches[k] && j.pitch_px < kPitches[k + 1];
    });
  }
  PrintClass("corners", all, [&](const ScoredObservation& j) { return !cell(j); });
}

void PrintReliability(const std::vector<ScoredObservation>& all) {
  constexpr std::array<float, 8> kEdges = {0, 0.95f, 0.98f, 0.99f, 0.995f, 0.998f, 0.9995f, 1.01f};
  std::printf("\n%-22s %8s  %9s %9s\n", "confidence", "n", "says", "is right");
  for (size_t k = 0; k + 1 < kEdges.size(); ++k) {
    double says = 0;
    size_t n = 0, right = 0;
    for (const ScoredObservation& j : all) {
      if (j.node.kind != NodeKind::kCenter || j.confidence < kEdges[k] || j.confidence >= kEdges[k + 1])
        continue;
      ++n;
      right += j.right;
      says += j.confidence;
    }
    if (n == 0) continue;
    std::printf("%.4f to %.4f       %8zu  %9.5f %9.5f\n", kEdges[k], std::min(kEdges[k + 1], 1.0f), n,
                says / static_cast<double>(n), static_cast<double>(right) / static_cast<double>(n));
  }
}

// Whole cells with all neighbours in sight and observed.
void PrintBounds(const std::vector<ScoredObservation>& all) {
  std::printf("\n%-22s %8s  %8s  %15s %15s\n", "center_bound.h", "", "error px", "bound by noise",
              "by residuals");
  std::printf("%-22s %8s  %8s  %7s %7s %7s %7s\n", "class", "n", "50 %", "px", "error /", "px", "error /");
  std::printf("%-22s %8s  %8s  %7s %7.2f %7s %7.2f\n", "(at the bound)", "", "", "", 1.18, "", 1.18);
  constexpr std::array<double, 8> kPitches = {0, 1e9, 3, 4, 5, 7, 10, 1e9};
  for (size_t k = 0; k + 1 < kPitches.size(); ++k) {
    std::vector<double> errors, bounds[2], ratios[2];
    for (const ScoredObservation& j : all) {
      if (!j.right || j.neighbors < 8 || !(j.bound_px > 0)) continue;
      if (j.pitch_px < kPitches[k] || j.pitch_px >= kPitches[k + 1]) continue;
      errors.push_back(j.error_px);
      for (int n = 0; n < 2; ++n) {
        bounds[n].push_back(n == 0 ? j.bound_px : j.residual_bound_px);
        ratios[n].push_back(j.error_px / bounds[n].back());
      }
    }
    if (errors.empty()) continue;
    const std::string name =
        k == 0 ? "cells, 8 around" : "  pitch from " + std::to_string(static_cast<int>(kPitches[k])) + " px";
    std::printf("%-22s %8zu  %8.4f  %7.4f %7.2f %7.4f %7.2f\n", name.c_str(), errors.size(),
                Quantile(errors, 0.5), Quantile(bounds[0], 0.5), Quantile(ratios[0], 0.5),
                Quantile(bounds[1], 0.5), Quantile(ratios[1], 0.5));
  }
}

// Decodes the views of a take, with the bounds of their centres.
void ScoreTake(const testing::TrueTake& take, DecodeScore* score, std::vector<double>* blurs_px,
               std::vector<double>* noises) {
  const BoardIndex index = *BoardIndex::Build(take.board);
  for (const testing::TrueView& view : take.views) {
    const size_t first = score->observations.size();
    testing::Score(*DecodeView(view.image, index, {}), view, score);
    const testing::PictureLook look = testing::MeasureLook(view, take.board);
    blurs_px->push_back(look.appearance.sigma_px);
    noises->push_back(look.noise);
    const auto bounds = testing::CenterBounds(view, take.board, look);
    for (size_t k = first; k < score->observations.size(); ++k) {
      const auto bound = bounds.find(score->observations[k].node);
      if (bound == bounds.end()) continue;
      score->observations[k].bound_px = bound->second.noise_px;
      score->observations[k].residual_bound_px = bound->second.residual_px;
    }
  }
}

// Underexposed: values so many times smaller, with noise of 0.7 grey levels.
void Darken(double times, testing::TrueTake* take) {
  std::mt19937 random(0);
  std::normal_distribution<double> noise(0, 0.7);
  for (testing::TrueView& view : take->views) {
    auto pixels = std::make_shared<std::vector<uint8_t>>(*view.image.pixels);
    for (uint8_t& value : *pixels)
      value = static_cast<uint8_t>(std::clamp(std::lround(value / times + noise(random)), 0L, 255L));
    view.image.pixels = std::move(pixels);
  }
}

int Run(std::vector<std::string> folders) {
  double darker = 1;
  if (folders.size() > 1 && folders[0] == "--darker") {
    darker = std::max(1.0, std::atof(folders[1].c_str()));
    folders.erase(folders.begin(), folders.begin() + 2);
  }
  DecodeScore all;
  std::vector<double> blurs_px, noises;
  for (const std::string& folder : folders) {
    auto take = testing::ReadTrueTake(folder);
    if (!take.ok()) {
      std::fprintf(stderr, "accuracy_decode: %s\n", std::string(take.status().message()).c_str());
      return 2;
    }
    if (darker > 1) Darken(darker, &*take);
    ScoreTake(*take, &all, &blurs_px, &noises);
  }
  if (folders.empty()) {
    testing::TrueTake take = testing::MakeSmallTake();
    if (darker > 1) Darken(darker, &take);
    ScoreTake(take, &all, &blurs_px, &noises);
  }
  std::printf("recall of %zu scoreable cells: %.4f\n", all.cells.size(), all.Recall());
  for (const auto& [least, most] : {std::pair{3, 4}, {4, 5}, {5, 7}, {7, 10}, {10, 1000}}) {
    const size_t cells = all.CellsOf(least, most);
    if (cells == 0) continue;
    std::printf("  of %6zu from %d px%s: %.4f\n", cells, least,
                most < 1000 ? (" to " + std::to_string(most) + " px").c_str() : "", all.Recall(least, most));
  }
  PrintPrecision(all);
  PrintErrors(all.observations);
  PrintBounds(all.observations);
  std::printf("blur %.2f px and noise %.2f grey levels in the median of the pictures\n",
              Quantile(blurs_px, 0.5), Quantile(noises, 0.5));
  PrintReliability(all.observations);
  return 0;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) { return weft::Run({argv + 1, argv + argc}); }

#include "pattern/patch_decoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace weft {
namespace {

Rgb SampleColor(const ColorImage& image, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(image.width_px - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(image.height_px - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(0, image.width_px - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, image.height_px - 2));
  const int x1 = std::min(x0 + 1, image.width_px - 1), y1 = std::min(y0 + 1, image.height_px - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  Rgb out;
  for (int c = 0; c < 3; ++c) {
    out[c] = (1 - fy) * ((1 - fx) * image.at(x0, y0)[c] + fx * image.at(x1, y0)[c]) +
             fy * ((1 - fx) * image.at(x0, y1)[c] + fx * image.at(x1, y1)[c]);
  }
  return out;
}

struct Reading {
  std::array<int, 9> cells;
  std::array<int, 9> best;    // likeliest ink
  std::array<int, 9> second;  // runner-up
  std::array<float, 9> lead;
};

std::optional<Reading> ReadWindow(const MeasuredPatch& patch, int i, int j) {
  Reading reading;
  for (int k = 0; k < 9; ++k) {
    const int cell = patch.CellAt(i + k / 3, j + k % 3);
    if (cell < 0) return std::nullopt;
    reading.cells[k] = cell;
    const auto& ll = patch.log_likelihoods[cell];
    int best = 0, second = 1;
    for (int c = 0; c < kCellColors; ++c) {
      if (ll[c] > ll[best]) best = c;
    }
    if (best == 1) second = 0;
    for (int c = 0; c < kCellColors; ++c) {
      if (c != best && ll[c] > ll[second]) second = c;
    }
    reading.best[k] = best;
    reading.second[k] = second;
    reading.lead[k] = ll[best] - ll[second];
  }
  return reading;
}

uint32_t Code(const std::array<int, 9>& colors) {
  uint32_t code = 0;
  for (const int c : colors) code = code * kCellColors + static_cast<uint32_t>(c);
  return code;
}

// Poses of lattice cell (0, 0) that the window at (i, j) may mean: as read, and with one of its two weakest
// cells read as its runner-up.
void PosesOf(const Reading& reading, int i, int j, const BoardIndex& board, std::vector<BoardPose>* poses) {
  const auto add = [&](const std::array<int, 9>& colors) {
    const auto found = board.FindCode(Code(colors));
    if (!found) return;
    const BoardCell origin = found->ToBoard(-i, -j);
    poses->push_back({origin.row, origin.col, found->quarter_turns});
  };
  poses->clear();
  add(reading.best);
  std::array<int, 9> order;
  std::iota(order.begin(), order.end(), 0);
  std::partial_sort(order.begin(), order.begin() + 2, order.end(), [&](int s, int t) {
    return reading.lead[s] != reading.lead[t] ? reading.lead[s] < reading.lead[t] : s < t;
  });
  for (int k = 0; k < 2; ++k) {
    if (reading.lead[order[k]] > 4) break;
    auto colors = reading.best;
    colors[order[k]] = reading.second[order[k]];
    add(colors);
  }
}

// Log likelihood of one cell on the board over that of a random ink.
float CellEvidence(const MeasuredPatch& patch, int cell, const BoardPose& pose, const Board& board) {
  const PatchCell& c = patch.lattice.cells[cell];
  const BoardCell at = pose.ToBoard(c.i, c.j);
  const auto& ll = patch.log_likelihoods[cell];
  double mean = 0;
  for (const float l : ll) mean += std::exp(l) / kCellColors;
  const float background = static_cast<float>(std::log(mean));
  if (!board.Contains(at.row, at.col)) return *std::min_element(ll.begin(), ll.end()) - background;
  return ll[static_cast<int>(board.at(at.row, at.col))] - background;
}

// Cells next to the piece (8-neighbours) whose colours are less likely under its pose than by chance.
int CountContradicted(const MeasuredPatch& patch, const DecodedPiece& piece, const Board& board) {
  std::vector<int> ring;
  for (const int cell : piece.cells) {
    const PatchCell& c = patch.lattice.cells[cell];
    for (int k = 0; k < 9; ++k) {
      const int near = patch.CellAt(c.i + k / 3 - 1, c.j + k % 3 - 1);
      if (near >= 0 && !std::binary_search(piece.cells.begin(), piece.cells.end(), near))
        ring.push_back(near);
    }
  }
  std::sort(ring.begin(), ring.end());
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  return static_cast<int>(std::count_if(
      ring.begin(), ring.end(), [&](int cell) { return CellEvidence(patch, cell, piece.pose, board) < 0; }));
}

struct Vote {
  std::vector<std::pair<int, int>> windows;  // (i, j)
};

}  // namespace

absl::Status PatchDecodeOptions::Validate() const {
  if (!(min_evidence > 0)) return absl::InvalidArgumentError("patches.min_evidence must be above 0");
  if (!(min_margin > 0)) return absl::InvalidArgumentError("patches.min_margin must be above 0");
  if (!(max_contradicted >= 0)) {
    return absl::InvalidArgumentError("patches.max_contradicted must not be negative");
  }
  return absl::OkStatus();
}

int MeasuredPatch::CellAt(int i, int j) const {
  if (i < lattice.i_min || i > lattice.i_max || j < lattice.j_min || j > lattice.j_max) return -1;
  return grid[static_cast<size_t>(i - lattice.i_min) * columns() + (j - lattice.j_min)];
}

MeasuredPatch MeasurePatch(const LatticePatch& patch, const std::vector<Keypoint>& points,
                           const ColorImage& image) {
  MeasuredPatch out;
  out.lattice = patch;
  out.grid.assign(static_cast<size_t>(patch.i_max - patch.i_min + 1) * out.columns(), -1);
  for (size_t k = 0; k < patch.cells.size(); ++k) {
    const PatchCell& c = patch.cells[k];
    out.grid[static_cast<size_t>(c.i - patch.i_min) * out.columns() + (c.j - patch.j_min)] =
        static_cast<int>(k);
  }
  std::vector<Rgb> raw(patch.cells.size());
  std::vector<float> bright(patch.cells.size());
  for (size_t k = 0; k < raw.size(); ++k) {
    const Keypoint& p = points[patch.cells[k].keypoint];
    raw[k] = SampleColor(image, p.x_px, p.y_px);
    bright[k] = (raw[k][0] + raw[k][1] + raw[k][2]) / 3;
  }
  out.colors.resize(raw.size());
  constexpr int kReach = 3;
  for (size_t k = 0; k < raw.size(); ++k) {
    const PatchCell& c = patch.cells[k];
    float light = 0;
    int n = 0;
    for (int i = c.i - kReach; i <= c.i + kReach; ++i) {
      for (int j = c.j - kReach; j <= c.j + kReach; ++j) {
        const int other = out.CellAt(i, j);
        if (other < 0) continue;
        light += bright[other];
        ++n;
      }
    }
    light = std::max(light / static_cast<float>(n), 1.0f);
    for (int channel = 0; channel < 3; ++channel) out.colors[k][channel] = raw[k][channel] / light;
  }
  return out;
}

void ClassifyPatch(const InkModel& inks, MeasuredPatch* patch) {
  patch->log_likelihoods.resize(patch->colors.size());
  for (size_t k = 0; k < patch->colors.size(); ++k) {
    patch->log_likelihoods[k] = inks.LogLikelihoods(patch->colors[k]);
  }
}

std::vector<DecodedPiece> DecodePatch(const MeasuredPatch& patch, const BoardIndex& board) {
  std::map<BoardPose, Vote> votes;
  std::vector<BoardPose> poses;
  for (int i = patch.lattice.i_min; i + 2 <= patch.lattice.i_max; ++i) {
    for (int j = patch.lattice.j_min; j + 2 <= patch.lattice.j_max; ++j) {
      const auto reading = ReadWindow(patch, i, j);
      if (!reading) continue;
      PosesOf(*reading, i, j, board, &poses);
      for (const BoardPose& pose : poses) votes[pose].windows.push_back({i, j});
    }
  }
  std::vector<std::pair<BoardPose, const Vote*>> ranked;
  for (const auto& [pose, vote] : votes) ranked.push_back({pose, &vote});
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& s, const auto& t) {
    return s.second->windows.size() > t.second->windows.size();
  });
  constexpr size_t kMostPieces = 24;
  if (ranked.size() > kMostPieces) ranked.resize(kMostPieces);
  std::vector<DecodedPiece> pieces;
  std::vector<bool> taken(patch.lattice.cells.size(), false);
  for (const auto& [pose, vote] : ranked) {
    DecodedPiece piece;
    piece.pose = pose;
    for (const auto& [i, j] : vote->windows) {
      bool free = true;
      for (int k = 0; k < 9; ++k) free &= !taken[patch.CellAt(i + k / 3, j + k % 3)];
      if (!free) continue;
      piece.centers.push_back(patch.CellAt(i + 1, j + 1));
      for (int k = 0; k < 9; ++k) piece.cells.push_back(patch.CellAt(i + k / 3, j + k % 3));
    }
    if (piece.centers.empty()) continue;
    for (std::vector<int>* list : {&piece.cells, &piece.centers}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
    for (const int cell : piece.cells) {
      taken[cell] = true;
      piece.evidence += CellEvidence(patch, cell, pose, board.board());
    }
    float runner_up = 0;  // random colours
    for (const auto& [other, unused] : ranked) {
      if (other == pose) continue;
      float evidence = 0;
      for (const int cell : piece.cells) evidence += CellEvidence(patch, cell, other, board.board());
      runner_up = std::max(runner_up, evidence);
    }
    piece.margin = piece.evidence - runner_up;
    piece.contradicted = CountContradicted(patch, piece, board.board());
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

bool LooksMirrored(const MeasuredPatch& patch, const BoardIndex& board) {
  int upright = 0, in_mirror = 0;
  for (int i = patch.lattice.i_min; i + 2 <= patch.lattice.i_max; ++i) {
    for (int j = patch.lattice.j_min; j + 2 <= patch.lattice.j_max; ++j) {
      const auto reading = ReadWindow(patch, i, j);
      if (!reading) continue;
      std::array<int, 9> mirrored;
      for (int k = 0; k < 9; ++k) mirrored[k] = reading->best[3 * (k / 3) + 2 - k % 3];
      in_mirror += board.FindCode(Code(mirrored)).has_value();
      upright += board.FindCode(Code(reading->best)).has_value();
    }
  }
  return in_mirror > 2 * upright;
}

}  // namespace weft

#include "pattern/seeds/patch_decoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace weft {
namespace {

// A 3x3 window of a lattice: its first cell is at (i, j), its cells of the patch stand row by row.
struct PatchWindow {
  int i = 0, j = 0;
  std::array<int, 9> cells = {};
};

// False where one of its cells is missing.
bool WindowAt(const MeasuredPatch& patch, int i, int j, PatchWindow* window) {
  window->i = i;
  window->j = j;
  const int* row = patch.grid.data() + static_cast<size_t>(i - patch.lattice.i_min) * patch.columns() +
                   (j - patch.lattice.j_min);
  int least = 0;
  for (int k = 0; k < 9; ++k) {
    window->cells[k] = row[static_cast<size_t>(k / 3) * patch.columns() + k % 3];
    least = std::min(least, window->cells[k]);
  }
  return least >= 0;
}

uint32_t CodeOf(const MeasuredPatch& patch, const PatchWindow& window) {
  uint32_t code = 0;
  for (const int cell : window.cells) code = code * kCellColors + patch.readings[cell].best;
  return code;
}

// Whether the likeliest inks of all nine cells are the board's under the pose.
bool Agrees(const MeasuredPatch& patch, const PatchWindow& window, const BoardPose& pose,
            const Board& board) {
  const int i = window.i, j = window.j;
  const BoardCell first = pose.ToBoard(i, j), last = pose.ToBoard(i + 2, j + 2);
  if (!board.Contains(first.row, first.col) || !board.Contains(last.row, last.col)) return false;
  const BoardCell down = pose.ToBoard(i + 1, j), right = pose.ToBoard(i, j + 1);
  for (int k = 0; k < 9; ++k) {
    const int di = k / 3, dj = k % 3;
    const CellColor color = board.at(first.row + di * (down.row - first.row) + dj * (right.row - first.row),
                                     first.col + di * (down.col - first.col) + dj * (right.col - first.col));
    if (static_cast<uint8_t>(color) != patch.readings[window.cells[k]].best) return false;
  }
  return true;
}

// Poses of lattice cell (0, 0) that the window may mean: as read, or else with one of its two weakest cells
// read as its runner-up.
void PosesOf(const MeasuredPatch& patch, const PatchWindow& window, const BoardIndex& board,
             std::vector<BoardPose>* poses) {
  const std::array<int, 9>& cells = window.cells;
  constexpr float kUnclear = 4;
  const auto add = [&](uint32_t code) {
    const auto found = board.FindCode(code);
    if (!found) return;
    const BoardCell origin = found->ToBoard(-window.i, -window.j);
    poses->push_back({origin.row, origin.col, found->quarter_turns});
  };
  poses->clear();
  const uint32_t code = CodeOf(patch, window);
  add(code);
  int weakest = -1, weak = -1;
  for (int k = 0; k < 9; ++k) {
    const float lead = patch.readings[cells[k]].lead;
    if (weakest < 0 || lead < patch.readings[cells[weakest]].lead) {
      weak = weakest;
      weakest = k;
    } else if (weak < 0 || lead < patch.readings[cells[weak]].lead) {
      weak = k;
    }
  }
  static constexpr std::array<uint32_t, 9> kPlace = {5764801, 823543, 117649, 16807, 2401, 343, 49, 7, 1};
  for (const int k : {weakest, weak}) {
    const CellReading& reading = patch.readings[cells[k]];
    if (reading.lead > kUnclear) break;
    add(code + kPlace[k] * reading.second - kPlace[k] * reading.best);
  }
}

// Cells next to the piece (8-neighbours) whose colours are less likely under its pose than by chance.
int CountContradicted(const MeasuredPatch& patch, const DecodedPiece& piece, const Board& board) {
  std::vector<bool> seen(patch.lattice.cells.size(), false);
  for (const int cell : piece.cells) seen[cell] = true;
  int contradicted = 0;
  for (const int cell : piece.cells) {
    const PatchCell& c = patch.lattice.cells[cell];
    for (int k = 0; k < 9; ++k) {
      const int near = patch.CellAt(c.i + k / 3 - 1, c.j + k % 3 - 1);
      if (near < 0 || seen[near]) continue;
      seen[near] = true;
      contradicted += CellEvidence(patch, near, piece.pose, board) < 0;
    }
  }
  return contradicted;
}

// Windows that read one pose.
struct Vote {
  BoardPose pose;
  std::vector<std::pair<int, int>> windows;  // (i, j)
};

// One vote per pose, most windows first.
std::vector<Vote> CountVotes(const MeasuredPatch& patch, const BoardIndex& board) {
  std::map<BoardPose, size_t> index;
  std::vector<Vote> votes;
  std::vector<BoardPose> poses;
  PatchWindow window;
  size_t last = 0;  // the next window usually reads the same
  for (int i = patch.lattice.i_min; i + 2 <= patch.lattice.i_max; ++i) {
    for (int j = patch.lattice.j_min; j + 2 <= patch.lattice.j_max; ++j) {
      if (!WindowAt(patch, i, j, &window)) continue;
      if (last < votes.size() && Agrees(patch, window, votes[last].pose, board.board())) {
        votes[last].windows.push_back({i, j});
        continue;
      }
      PosesOf(patch, window, board, &poses);
      for (const BoardPose& pose : poses) {
        const auto [at, added] = index.emplace(pose, votes.size());
        if (added) votes.push_back({pose, {}});
        votes[at->second].windows.push_back({i, j});
        if (&pose == &poses.front()) last = at->second;
      }
    }
  }
  std::stable_sort(votes.begin(), votes.end(), [](const Vote& s, const Vote& t) {
    return s.windows.size() != t.windows.size() ? s.windows.size() > t.windows.size() : s.pose < t.pose;
  });
  return votes;
}

// How much better the piece's pose is on its cells than the best of the others, and than random colours.
float Margin(const MeasuredPatch& patch, const DecodedPiece& piece, const std::vector<Vote>& votes,
             const Board& board) {
  constexpr size_t kMostCells = 200;
  const size_t step = (piece.cells.size() + kMostCells - 1) / kMostCells;
  const auto evidence = [&](const BoardPose& pose) {
    float sum = 0;
    for (size_t k = 0; k < piece.cells.size(); k += step)
      sum += CellEvidence(patch, piece.cells[k], pose, board);
    return sum;
  };
  float runner_up = 0;
  for (const Vote& vote : votes) {
    if (vote.pose != piece.pose) runner_up = std::max(runner_up, evidence(vote.pose));
  }
  return evidence(piece.pose) - runner_up;
}

// Mean brightness of the 7x7 cells around each one, as far as they are known; at least 1.
std::vector<float> LightAround(const MeasuredPatch& patch, const std::vector<float>& bright) {
  constexpr int kReach = 3;
  const int columns = patch.columns(), rows = patch.lattice.i_max - patch.lattice.i_min + 1;
  // Sums over all cells above and to the left.
  struct Sum {
    double bright = 0;
    int cells = 0;
  };
  std::vector<Sum> sums(static_cast<size_t>(rows + 1) * (columns + 1));
  const auto at = [&](int i, int j) -> Sum& { return sums[static_cast<size_t>(i) * (columns + 1) + j]; };
  for (int i = 0; i < rows; ++i) {
    Sum row;
    for (int j = 0; j < columns; ++j) {
      const int cell = patch.grid[static_cast<size_t>(i) * columns + j];
      if (cell >= 0) {
        row.bright += bright[cell];
        ++row.cells;
      }
      at(i + 1, j + 1) = {at(i, j + 1).bright + row.bright, at(i, j + 1).cells + row.cells};
    }
  }
  std::vector<float> light(bright.size());
  for (size_t k = 0; k < light.size(); ++k) {
    const int i = patch.lattice.cells[k].i - patch.lattice.i_min,
              j = patch.lattice.cells[k].j - patch.lattice.j_min;
    const int i0 = std::max(i - kReach, 0), i1 = std::min(i + kReach + 1, rows);
    const int j0 = std::max(j - kReach, 0), j1 = std::min(j + kReach + 1, columns);
    const double sum = at(i1, j1).bright - at(i0, j1).bright - at(i1, j0).bright + at(i0, j0).bright;
    const int cells = at(i1, j1).cells - at(i0, j1).cells - at(i1, j0).cells + at(i0, j0).cells;
    light[k] = std::max(static_cast<float>(sum / cells), 1.0f);
  }
  return light;
}

}  // namespace

absl::Status PatchDecodeOptions::Validate() const {
  if (!(min_evidence > 0)) return absl::InvalidArgumentError("patches.min_evidence must be above 0");
  if (!(min_margin > 0)) return absl::InvalidArgumentError("patches.min_margin must be above 0");
  if (!(max_contradicted >= 0)) {
    return absl::InvalidArgumentError("patches.max_contradicted must not be negative");
  }
  if (!(min_evidence_contradicted > 0)) {
    return absl::InvalidArgumentError("patches.min_evidence_contradicted must be above 0");
  }
  return absl::OkStatus();
}

Rgb SampleColor(const ColorImage& image, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(image.width_px - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(image.height_px - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(0, image.width_px - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, image.height_px - 2));
  const int x1 = std::min(x0 + 1, image.width_px - 1), y1 = std::min(y0 + 1, image.height_px - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  // All channels at a time.
  typedef float Channels __attribute__((vector_size(16)));
  const auto pixel = [&image](int px, int py) {
    const uint8_t* p = image.at(px, py);
    return Channels{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0};
  };
  const Channels sample = (1 - fy) * ((1 - fx) * pixel(x0, y0) + fx * pixel(x1, y0)) +
                          fy * ((1 - fx) * pixel(x0, y1) + fx * pixel(x1, y1));
  return {sample[0], sample[1], sample[2]};
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
  const std::vector<float> light = LightAround(out, bright);
  for (size_t k = 0; k < raw.size(); ++k) {
    for (int channel = 0; channel < 3; ++channel) out.colors[k][channel] = raw[k][channel] / light[k];
  }
  return out;
}

CellReading ReadCell(const InkModel& inks, const Rgb& color) {
  const std::array<float, kCellColors> likelihoods = inks.Likelihoods(color);
  CellReading reading;
  float sum = 0;
  int best = 0, second = 1;
  for (const float p : likelihoods) sum += p;
  for (int c = 1; c < kCellColors; ++c) {
    if (likelihoods[c] > likelihoods[best]) best = c;
  }
  if (best == 1) second = 0;
  for (int c = 0; c < kCellColors; ++c) {
    if (c != best && likelihoods[c] > likelihoods[second]) second = c;
  }
  // Most inks are as unlikely as can be.
  const float least = *std::min_element(likelihoods.begin(), likelihoods.end());
  const float least_evidence = std::log(least * (kCellColors / sum));
  for (int c = 0; c < kCellColors; ++c) {
    const float p = likelihoods[c];
    reading.evidence[c] = p == least ? least_evidence : std::log(p * (kCellColors / sum));
  }
  reading.best = static_cast<uint8_t>(best);
  reading.second = static_cast<uint8_t>(second);
  reading.lead = reading.evidence[best] - reading.evidence[second];
  return reading;
}

float CellEvidence(const MeasuredPatch& patch, int cell, const BoardPose& pose, const Board& board) {
  const PatchCell& c = patch.lattice.cells[cell];
  const BoardCell at = pose.ToBoard(c.i, c.j);
  const auto& evidence = patch.readings[cell].evidence;
  if (!board.Contains(at.row, at.col)) return *std::min_element(evidence.begin(), evidence.end());
  return evidence[static_cast<int>(board.at(at.row, at.col))];
}

void ClassifyPatch(const InkModel& inks, MeasuredPatch* patch) {
  patch->readings.resize(patch->colors.size());
  for (size_t k = 0; k < patch->colors.size(); ++k) patch->readings[k] = ReadCell(inks, patch->colors[k]);
}

std::vector<DecodedPiece> DecodePatch(const MeasuredPatch& patch, const BoardIndex& board) {
  constexpr size_t kMostPieces = 24;
  std::vector<Vote> votes = CountVotes(patch, board);
  if (votes.size() > kMostPieces) votes.resize(kMostPieces);
  std::vector<DecodedPiece> pieces;
  std::vector<bool> taken(patch.lattice.cells.size(), false);
  std::vector<uint8_t> role(patch.lattice.cells.size());  // 1 in the piece, 2 middle of a window
  PatchWindow window;
  const std::array<int, 9>& cells = window.cells;
  for (const Vote& vote : votes) {
    std::fill(role.begin(), role.end(), 0);
    for (const auto& [i, j] : vote.windows) {
      WindowAt(patch, i, j, &window);
      if (std::any_of(cells.begin(), cells.end(), [&](int cell) { return taken[cell]; })) continue;
      for (const int cell : cells) role[cell] |= 1;
      role[cells[4]] |= 2;
    }
    DecodedPiece piece;
    piece.pose = vote.pose;
    for (size_t k = 0; k < role.size(); ++k) {
      if (role[k] == 0) continue;
      piece.cells.push_back(static_cast<int>(k));
      if (role[k] & 2) piece.centers.push_back(static_cast<int>(k));
    }
    if (piece.centers.empty()) continue;
    for (const int cell : piece.cells) {
      taken[cell] = true;
      piece.evidence += CellEvidence(patch, cell, vote.pose, board.board());
    }
    piece.margin = Margin(patch, piece, votes, board.board());
    piece.contradicted = CountContradicted(patch, piece, board.board());
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

bool LooksMirrored(const MeasuredPatch& patch, const BoardIndex& board) {
  int upright = 0, in_mirror = 0;
  PatchWindow window;
  for (int i = patch.lattice.i_min; i + 2 <= patch.lattice.i_max; ++i) {
    for (int j = patch.lattice.j_min; j + 2 <= patch.lattice.j_max; ++j) {
      if (!WindowAt(patch, i, j, &window)) continue;
      upright += board.FindCode(CodeOf(patch, window)).has_value();
      for (const int row : {0, 3, 6}) std::swap(window.cells[row], window.cells[row + 2]);
      in_mirror += board.FindCode(CodeOf(patch, window)).has_value();
    }
  }
  return in_mirror > 2 * upright;
}

}  // namespace weft

#include "pattern/board/board_generation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "base/random.h"
#include "base/status_macros.h"
#include "pattern/board/code_set.h"

namespace weft {
namespace {

// What a mirrored copy costs, in wrong colours that lead to another window.
constexpr float kMirrorCost = 8;
// What a colour's surplus of all its fair share costs.
constexpr float kBalanceCost = 30;
constexpr int kMaxStepsOfOneDeadEnd = 20000;
constexpr int64_t kMaxStepsPerCell = 30;
// How much the cost of the next cell counts beside the cell's own.
constexpr float kNextCost = 0.9f;
// 6,464,682 windows have no equal 4-neighbours, four rotations each.
constexpr int64_t kDistinctWindows = 6464682 / 4;

class BoardMaker {
 public:
  BoardMaker(uint64_t seed, const BoardProgress& progress, Board* board)
      : progress_(progress), board_(*board), random_(seed) {
    fair_share_ = static_cast<float>(board_.cells.size()) / kCellColors;
  }

  // Takes the windows of another board; their number.
  int64_t KeepApartFrom(const Board& other) {
    int64_t taken = 0;
    for (int row = 0; row + 3 <= other.rows; ++row) {
      for (int col = 0; col + 3 <= other.cols; ++col) {
        if (!other.HasWindow(row, col)) continue;
        used_.Add(RotatedCodes(BoardWindow(other, row, col)));
        ++taken;
      }
    }
    return taken;
  }
  absl::Status Fill();

 private:
  // Cost of a window that is not in the set yet; negative where it must not be.
  float WindowCost(const Window& window, const std::array<uint32_t, 4>& codes) const {
    if (EqualsItsRotation(codes) || used_.Contains(codes[0])) return -1;
    const Window mirrored = Mirrored(window);
    const uint32_t mirror = WindowCode(mirrored);
    const bool meets_mirror =
        used_.Contains(mirror) || std::find(codes.begin(), codes.end(), mirror) != codes.end();
    return static_cast<float>(used_.CountOneAway(window)) + (meets_mirror ? kMirrorCost : 0);
  }

  float BalanceCost(CellColor color) const {
    return kBalanceCost * (static_cast<float>(colors_[static_cast<int>(color)]) / fair_share_ - 1);
  }

  bool Report(double share) const { return !progress_ || progress_(share); }

  bool Place(size_t index, uint8_t* tried);
  float NextCost(int row, int col, const std::array<uint32_t, 4>& codes);
  void TakeBack(size_t index);

  const BoardProgress& progress_;
  Board& board_;
  Random random_;
  CodeSet used_;
  std::array<int64_t, kCellColors> colors_{};
  float fair_share_ = 1;
};

// Cell by cell in reading order; a cell completes the window whose lower right it is. Depth first: where no
// colour fits, the cell before takes its next one. Where that leads nowhere for long, some rows are begun
// anew.
absl::Status BoardMaker::Fill() {
  const size_t cells = board_.cells.size();
  std::vector<uint8_t> tried(cells, 0);
  size_t next = 0, furthest = 0, begin_anew = board_.cols;
  int64_t steps = 0, last_progress = 0;
  for (; next < cells; ++steps) {
    if (steps > kMaxStepsPerCell * static_cast<int64_t>(cells) + 100000) {
      return absl::ResourceExhaustedError(
          absl::StrCat("no board of ", board_.rows, "x", board_.cols,
                       " cells with unique windows was found (the search got to row ", furthest / board_.cols,
                       "); make it smaller, give the masks of its panels, or try "
                       "another seed"));
    }
    if (Place(next, &tried[next])) {
      if (++next <= furthest) continue;
      furthest = next;
      last_progress = steps;
      begin_anew = board_.cols;
      if (furthest % 4096 == 0 && !Report(static_cast<double>(furthest) / static_cast<double>(cells)))
        return absl::CancelledError("stopped");
      continue;
    }
    tried[next] = 0;
    if (next == 0) continue;
    size_t first = next - 1;
    if (steps - last_progress > kMaxStepsOfOneDeadEnd) {
      first = next - std::min(next, begin_anew);
      begin_anew *= 2;
      last_progress = steps;
    }
    while (next > first) {
      TakeBack(--next);
      if (next > first) tried[next] = 0;
    }
  }
  return absl::OkStatus();
}

// Least cost of the next cell of the row, negative where no colour fits it. `codes` are those of the window
// before.
float BoardMaker::NextCost(int row, int col, const std::array<uint32_t, 4>& codes) {
  if (!board_.HasWindow(row - 2, col - 2)) return 0;
  const size_t index = static_cast<size_t>(row) * board_.cols + col;
  float least = -1;
  used_.Add(codes);
  for (int candidate = 0; candidate < kCellColors; ++candidate) {
    const CellColor color = static_cast<CellColor>(candidate);
    if (board_.at(row, col - 1) == color || board_.at(row - 1, col) == color) continue;
    board_.cells[index] = color;
    const Window window = BoardWindow(board_, row - 2, col - 2);
    const float cost = WindowCost(window, RotatedCodes(window));
    if (cost >= 0 && (least < 0 || cost < least)) least = cost;
  }
  used_.Remove(codes);
  return least;
}

bool BoardMaker::Place(size_t index, uint8_t* tried) {
  const int row = static_cast<int>(index / board_.cols), col = static_cast<int>(index % board_.cols);
  const bool counts = board_.HasWindow(row - 2, col - 2);
  float least = 0;
  int best = -1;
  std::array<uint32_t, 4> best_codes{};
  for (int candidate = 0; candidate < kCellColors; ++candidate) {
    const CellColor color = static_cast<CellColor>(candidate);
    if ((*tried >> candidate & 1) != 0) continue;
    if (col > 0 && board_.at(row, col - 1) == color) continue;
    if (row > 0 && board_.at(row - 1, col) == color) continue;
    board_.cells[index] = color;
    std::array<uint32_t, 4> codes{};
    // Chance decides between equals, and now and then against the best, so that taking back leads elsewhere.
    float cost = BalanceCost(color) + 0.01f * static_cast<float>(random_.Below(256));
    if (counts) {
      const Window window = BoardWindow(board_, row - 2, col - 2);
      codes = RotatedCodes(window);
      const float own = WindowCost(window, codes);
      if (own < 0) continue;
      cost += own;
      const float next = NextCost(row, col + 1, codes);
      if (next < 0) continue;
      cost += kNextCost * next;
    }
    if (best >= 0 && cost >= least) continue;
    least = cost;
    best = candidate;
    best_codes = codes;
  }
  if (best < 0) return false;
  board_.cells[index] = static_cast<CellColor>(best);
  *tried |= static_cast<uint8_t>(1 << best);
  ++colors_[best];
  if (counts) used_.Add(best_codes);
  return true;
}

void BoardMaker::TakeBack(size_t index) {
  const int row = static_cast<int>(index / board_.cols), col = static_cast<int>(index % board_.cols);
  --colors_[static_cast<int>(board_.cells[index])];
  if (board_.HasWindow(row - 2, col - 2)) used_.Remove(RotatedCodes(BoardWindow(board_, row - 2, col - 2)));
}

}  // namespace

absl::Status BoardGenerationOptions::Validate() const {
  const auto bad = [](const std::string& what) { return absl::InvalidArgumentError(what); };
  if (rows >= 3 && cols >= 3 && !panels.empty()) {
    if (panels.size() != static_cast<size_t>(rows) * cols)
      return bad(absl::StrCat("panels has ", panels.size(), " entries, a board of ", rows, "x", cols,
                              " needs ", static_cast<size_t>(rows) * cols));
    if (std::all_of(panels.begin(), panels.end(), [](uint8_t p) { return p == 0; }))
      return bad("panels has no cell that belongs to a panel");
  }
  for (const Board& other : apart_from) WEFT_RETURN_IF_ERROR(other.Validate());
  return absl::OkStatus();
}

absl::StatusOr<Board> GenerateBoard(const BoardGenerationOptions& options, const BoardProgress& progress) {
  Board board;
  board.rows = options.rows;
  board.cols = options.cols;
  board.cell_mm = options.cell_mm;
  board.square_fraction = options.square_fraction;
  if (options.rows > 0 && options.cols > 0 && options.rows <= 4096 && options.cols <= 4096) {
    board.cells.assign(static_cast<size_t>(options.rows) * options.cols, CellColor::kRed);
  }
  WEFT_RETURN_IF_ERROR(options.Validate());
  board.panels = options.panels;
  WEFT_RETURN_IF_ERROR(board.Validate());
  const int64_t windows = int64_t{options.rows - 2} * (options.cols - 2);
  int64_t taken = 0;
  BoardMaker maker(options.seed, progress, &board);
  for (const Board& other : options.apart_from) taken += maker.KeepApartFrom(other);
  if (options.panels.empty() && windows > kDistinctWindows - taken) {
    return absl::ResourceExhaustedError(
        absl::StrCat("a board of ", options.rows, "x", options.cols, " cells has ", windows,
                     " windows, only ", kDistinctWindows - taken, taken > 0 ? " are free" : " exist",
                     "; make it smaller, or give the masks of its panels"));
  }
  WEFT_RETURN_IF_ERROR(maker.Fill());
  board.id = board.ContentHash();
  return board;
}

}  // namespace weft

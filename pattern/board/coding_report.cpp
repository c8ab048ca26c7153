#include "pattern/board/coding_report.h"

#include <algorithm>
#include <numeric>

#include "base/random.h"
#include "base/status_macros.h"
#include "pattern/board/board_index.h"
#include "pattern/board/code_set.h"

namespace weft {
namespace {

constexpr int kSizes[] = {3, 4, 5};

// Upper left cells of the windows of a size: 1 where they lie within one panel. [rows - size + 1][cols - size
// + 1]
std::vector<uint8_t> ValidWindows(const Board& board, int size) {
  const int rows = board.rows - size + 1, cols = board.cols - size + 1;
  std::vector<uint8_t> valid(static_cast<size_t>(std::max(0, rows)) * std::max(0, cols), 1);
  if (board.panels.empty()) return valid;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      bool whole = true;
      for (int r = row; r + 3 <= row + size && whole; ++r)
        for (int c = col; c + 3 <= col + size && whole; ++c) whole = board.HasWindow(r, c);
      // Parts of 3x3 that overlap share their panel.
      valid[static_cast<size_t>(row) * cols + col] = whole;
    }
  }
  return valid;
}

// Distance from a square of colours to the nearest window of the board that is not at `own`.
int NearestDistance(const Board& board, const std::vector<CellColor>& square, int size,
                    const std::vector<uint8_t>& valid, BoardCell own) {
  const int rows = board.rows - size + 1, cols = board.cols - size + 1;
  int nearest = size * size;
  std::vector<uint8_t> distance(cols);
  for (int row = 0; row < rows; ++row) {
    std::fill(distance.begin(), distance.end(), 0);
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) {
        const CellColor* line = board.cells.data() + static_cast<size_t>(row + i) * board.cols + j;
        const CellColor color = square[i * size + j];
        for (int col = 0; col < cols; ++col) distance[col] += line[col] != color;
      }
    }
    const uint8_t* counts = valid.data() + static_cast<size_t>(row) * cols;
    for (int col = 0; col < cols; ++col) {
      if (distance[col] < nearest && counts[col] && BoardCell{row, col} != own) nearest = distance[col];
    }
  }
  return nearest;
}

WindowDistances MeasureDistances(const Board& board, int size, const CodingReportOptions& options) {
  WindowDistances out;
  out.size = size;
  out.count.assign(size * size + 1, 0);
  const std::vector<uint8_t> valid = ValidWindows(board, size);
  std::vector<size_t> windows;
  for (size_t i = 0; i < valid.size(); ++i)
    if (valid[i]) windows.push_back(i);
  if (windows.size() < 2) return out;
  Random random(options.seed + size);
  const int cols = board.cols - size + 1;
  out.samples = static_cast<int>(std::min<size_t>(options.samples, windows.size()));
  out.least = size * size;
  for (int k = 0; k < out.samples; ++k) {
    std::swap(windows[k], windows[k + random.Below(static_cast<uint32_t>(windows.size() - k))]);
    const int row = static_cast<int>(windows[k] / cols), col = static_cast<int>(windows[k] % cols);
    std::vector<CellColor> square(size * size), turned(size * size);
    for (int i = 0; i < size * size; ++i) square[i] = board.at(row + i / size, col + i % size);
    int nearest = size * size;
    for (int turn = 0; turn < 4; ++turn) {
      const bool own = turn == 0;
      nearest = std::min(nearest, NearestDistance(board, square, size, valid,
                                                  own ? BoardCell{row, col} : BoardCell{-1, -1}));
      for (int i = 0; i < size; ++i)
        for (int j = 0; j < size; ++j) turned[i * size + j] = square[j * size + size - 1 - i];
      square.swap(turned);
    }
    ++out.count[nearest];
    out.least = std::min(out.least, nearest);
    out.mean += nearest;
  }
  out.mean /= out.samples;
  return out;
}

void MeasureCodes(const Board& board, CodingReport* report) {
  CodeSet codes;
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      if (!board.HasWindow(row, col)) continue;
      codes.Add(RotatedCodes(BoardWindow(board, row, col)));
      ++report->windows;
    }
  }
  int64_t aliases = 0, ambiguous = 0;
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      if (!board.HasWindow(row, col)) continue;
      const Window window = BoardWindow(board, row, col);
      report->mirrored += codes.Contains(WindowCode(Mirrored(window)));
      int all = 0;
      for (int cell = 0; cell < 9; ++cell) {
        const int here = codes.CountOneAway(window, cell);
        all += here;
        ambiguous += here > 0;
      }
      aliases += all;
      report->one_away += all > 0;
    }
  }
  if (report->windows == 0) return;
  report->alias_odds =
      static_cast<double>(aliases) / (9.0 * (kCellColors - 1) * static_cast<double>(report->windows));
  report->erasure_odds = static_cast<double>(ambiguous) / (9.0 * static_cast<double>(report->windows));
}

void MeasureColors(const Board& board, CodingReport* report) {
  int64_t diagonal = 0, equal_diagonal = 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const CellColor color = board.at(row, col);
      ++report->colors[static_cast<int>(color)];
      report->equal_neighbors += board.Contains(row, col + 1) && board.at(row, col + 1) == color;
      report->equal_neighbors += board.Contains(row + 1, col) && board.at(row + 1, col) == color;
      for (const int side : {-1, 1}) {
        if (!board.Contains(row + 1, col + side)) continue;
        ++diagonal;
        equal_diagonal += board.at(row + 1, col + side) == color;
      }
    }
  }
  report->equal_diagonal_share =
      diagonal > 0 ? static_cast<double>(equal_diagonal) / static_cast<double>(diagonal) : 0;
}

}  // namespace

absl::Status CodingReportOptions::Validate() const {
  if (samples < 1) return absl::InvalidArgumentError("samples must be at least 1");
  return absl::OkStatus();
}

absl::StatusOr<CodingReport> MakeCodingReport(const Board& board, const CodingReportOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(board.Validate());
  CodingReport report;
  MeasureCodes(board, &report);
  MeasureColors(board, &report);
  for (const int size : kSizes) report.distances.push_back(MeasureDistances(board, size, options));
  return report;
}

}  // namespace weft

#include "pattern/board/panel_mask.h"

#include <array>
#include <map>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr int kLeastCells = 9;
constexpr int kMaxPanels = 255;

// Connected pieces (4-neighbours) of the cells that are not 0, numbered from 1 in reading order.
std::vector<int> Pieces(const std::vector<int>& cells, int rows, int cols) {
  std::vector<int> piece(cells.size(), 0);
  std::vector<size_t> open;
  int count = 0;
  for (size_t first = 0; first < cells.size(); ++first) {
    if (cells[first] == 0 || piece[first] != 0) continue;
    piece[first] = ++count;
    open.push_back(first);
    while (!open.empty()) {
      const size_t at = open.back();
      open.pop_back();
      const int row = static_cast<int>(at / cols), col = static_cast<int>(at % cols);
      const auto visit = [&](bool inside, size_t to) {
        if (!inside || cells[to] == 0 || piece[to] != 0) return;
        piece[to] = count;
        open.push_back(to);
      };
      visit(row > 0, at - cols);
      visit(row + 1 < rows, at + cols);
      visit(col > 0, at - 1);
      visit(col + 1 < cols, at + 1);
    }
  }
  return piece;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> PanelsFromMask(const Frame& mask) {
  WEFT_RETURN_IF_ERROR(mask.Validate());
  const std::string who = mask.origin.empty() ? "panel mask" : mask.origin;
  if (mask.format != PixelFormat::kGrey8 && mask.format != PixelFormat::kRgb8)
    return absl::InvalidArgumentError(absl::StrCat(who, ": a panel mask is a grey or a coloured image"));
  const int bytes = BytesPerPixel(mask.format);
  std::map<std::array<uint8_t, 3>, int> labels;
  std::vector<int> cells;
  for (int row = 0; row < mask.height_px; ++row) {
    for (int col = 0; col < mask.width_px; ++col) {
      const uint8_t* pixel = mask.row(row) + bytes * col;
      const std::array<uint8_t, 3> color = {pixel[0], pixel[bytes / 2], pixel[bytes - 1]};
      const bool black = color == std::array<uint8_t, 3>{0, 0, 0};
      cells.push_back(black ? 0 : labels.try_emplace(color, labels.size() + 1).first->second);
    }
  }
  if (labels.size() == 1) cells = Pieces(cells, mask.height_px, mask.width_px);
  std::map<int, int> sizes;
  for (const int label : cells)
    if (label != 0) ++sizes[label];
  std::map<int, int> number;
  for (const auto& [label, size] : sizes)
    if (size >= kLeastCells) number.try_emplace(label, number.size() + 1);
  if (number.empty())
    return absl::InvalidArgumentError(absl::StrCat(who, ": no panel; cells of panels are not black"));
  if (number.size() > kMaxPanels) {
    return absl::InvalidArgumentError(
        absl::StrCat(who, ": ", number.size(), " panels, at most ", kMaxPanels,
                     " are possible; a mask must not be smoothed or compressed"));
  }
  std::vector<uint8_t> panels;
  for (const int label : cells) {
    const auto entry = number.find(label);
    panels.push_back(entry == number.end() ? 0 : static_cast<uint8_t>(entry->second));
  }
  return panels;
}

Frame PanelsToMask(const std::vector<uint8_t>& panels, int rows, int cols) {
  Frame mask;
  mask.width_px = cols;
  mask.height_px = rows;
  mask.format = PixelFormat::kGrey8;
  mask.pixels = std::make_shared<std::vector<uint8_t>>(panels);
  mask.origin = "panels";
  return mask;
}

}  // namespace weft

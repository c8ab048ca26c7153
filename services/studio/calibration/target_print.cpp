#include "services/studio/calibration/target_print.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/calibration/tag_detection.h"
#include "services/studio/print/vector_file.h"

namespace weft {
namespace {

constexpr double kAroundMm = 10, kFootMm = 12, kLineMm = 100;

struct Rect {
  double x, y, width, height;  // mm from the top left of the page
};

struct BoardPage {
  double width_mm = 0, height_mm = 0;
  std::vector<Rect> black;
  std::string text;
  double text_mm = 0;                   // its size
  double text_x_mm = 0, text_y_mm = 0;  // of its baseline
};

absl::StatusOr<BoardPage> LayOut(const TagBoard& board) {
  WEFT_RETURN_IF_ERROR(CalibrationTarget{"", {board}, {}}.Validate());
  const TagFamilyInfo family = *FindTagFamily(board.family);
  const double module = board.tag_mm / family.border_modules;
  const double quiet = module * (family.width_modules - family.border_modules) / 2;
  BoardPage page;
  const double edge = kAroundMm + quiet;  // of the page to the first tag's border
  page.width_mm = std::max(board.width_mm() + 2 * edge, kLineMm + 2 * edge);
  page.height_mm = board.height_mm() + 2 * edge + kFootMm;
  for (int tag = 0; tag < board.rows * board.cols; ++tag) {
    WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> modules, TagModules(board.family, board.tag_ids[tag]));
    const Eigen::Vector3d corner = FlatCorner(board, 4 * tag);
    const double left = corner.x() + board.width_mm() / 2 + edge - quiet,
                 top = corner.y() + board.height_mm() / 2 + edge - quiet;
    const int n = family.width_modules;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n;) {  // runs of black modules
        int end = x;
        while (end < n && modules[y * n + end] == 0) ++end;
        if (end > x) page.black.push_back({left + x * module, top + y * module, (end - x) * module, module});
        x = end + 1;
      }
    }
  }
  const double foot = page.height_mm - kAroundMm;
  page.black.push_back({edge, foot - 0.15, kLineMm, 0.3});
  for (const double x : {edge, edge + kLineMm}) page.black.push_back({x - 0.1, foot - 2, 0.2, 4});
  page.text = absl::StrFormat(
      "Weft board %s   %s %d x %d, ids %d to %d   tag %.3f mm, gap %.3f mm   this line: 100 mm", board.id,
      board.family, board.rows, board.cols, board.tag_ids.front(), board.tag_ids.back(), board.tag_mm,
      board.gap_mm);
  // As large as the page has room for; the letters of DejaVu Sans are 0.6 of their size wide.
  page.text_mm = std::min(2.4, (page.width_mm - 2 * edge) / (0.6 * static_cast<double>(page.text.size())));
  page.text_x_mm = edge;
  page.text_y_mm = foot - 3;
  return page;
}

void Draw(const BoardPage& page, cairo_t* context) {
  cairo_set_source_rgb(context, 1, 1, 1);
  cairo_paint(context);
  cairo_set_source_rgb(context, 0, 0, 0);
  // One fill for all, so that viewers draw no seams between modules.
  for (const Rect& r : page.black) cairo_rectangle(context, r.x, r.y, r.width, r.height);
  cairo_fill(context);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, page.text_mm);
  cairo_move_to(context, page.text_x_mm, page.text_y_mm);
  cairo_show_text(context, page.text.c_str());
}

}  // namespace

absl::Status WriteBoardPrint(const TagBoard& board, const std::string& stem) {
  WEFT_ASSIGN_OR_RETURN(const BoardPage page, LayOut(board));
  const PageSize size{page.width_mm, page.height_mm};
  absl::Status status = WritePdf(stem + ".pdf", absl::StrCat("weft calibration board ", board.id), {size},
                                 [&](size_t, cairo_t* context) { Draw(page, context); });
  status.Update(WriteSvg(stem + ".svg", size, [&](cairo_t* context) { Draw(page, context); }));
  return status;
}

}  // namespace weft

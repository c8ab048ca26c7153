#include "services/calibration/target_print.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/calibration/tag_detection.h"

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
  double text_x_mm = 0, text_y_mm = 0;  // of its baseline
};

absl::StatusOr<BoardPage> LayOut(const TagBoard& board) {
  if (absl::Status status = CalibrationTarget{"", {board}, {}}.Validate(); !status.ok()) return status;
  const TagFamilyInfo family = *FindTagFamily(board.family);
  const double module = board.tag_mm / family.border_modules;
  const double quiet = module * (family.width_modules - family.border_modules) / 2;
  BoardPage page;
  const double edge = kAroundMm + quiet;  // of the page to the first tag's border
  page.width_mm = std::max(board.width_mm() + 2 * edge, kLineMm + 2 * edge);
  page.height_mm = board.height_mm() + 2 * edge + kFootMm;
  for (int tag = 0; tag < board.rows * board.cols; ++tag) {
    const absl::StatusOr<std::vector<uint8_t>> modules = TagModules(board.family, board.tag_ids[tag]);
    if (!modules.ok()) return modules.status();
    const Eigen::Vector3d corner = FlatCorner(board, 4 * tag);
    const double left = corner.x() + board.width_mm() / 2 + edge - quiet,
                 top = corner.y() + board.height_mm() / 2 + edge - quiet;
    const int n = family.width_modules;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n;) {  // runs of black modules
        int end = x;
        while (end < n && (*modules)[y * n + end] == 0) ++end;
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
  page.text_x_mm = edge;
  page.text_y_mm = foot - 3;
  return page;
}

std::string EscapeXml(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::string EscapePdf(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '(' || c == ')' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x80 ? c : '?';
  }
  return out;
}

}  // namespace

absl::StatusOr<std::string> BoardSvg(const TagBoard& board) {
  const absl::StatusOr<BoardPage> page = LayOut(board);
  if (!page.ok()) return page.status();
  std::string path;
  for (const Rect& r : page->black) {
    absl::StrAppendFormat(&path, "M%.4f %.4fh%.4fv%.4fh-%.4fz", r.x, r.y, r.width, r.height, r.width);
  }
  return absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.4fmm\" height=\"%.4fmm\" viewBox=\"0 0 %.4f "
      "%.4f\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n<path d=\"%s\" fill=\"#000\"/>\n"
      "<text x=\"%.3f\" y=\"%.3f\" font-family=\"Helvetica, Arial, sans-serif\" "
      "font-size=\"2.4\">%s</text>\n</svg>\n",
      page->width_mm, page->height_mm, page->width_mm, page->height_mm, path, page->text_x_mm,
      page->text_y_mm, EscapeXml(page->text));
}

absl::StatusOr<std::string> BoardPdf(const TagBoard& board) {
  const absl::StatusOr<BoardPage> page = LayOut(board);
  if (!page.ok()) return page.status();
  constexpr double kPointsPerMm = 72 / 25.4;
  // In mm with y downwards; one fill for all, so that viewers draw no seams between modules.
  std::string content = absl::StrFormat("%.8f 0 0 -%.8f 0 %.6f cm 0 g\n", kPointsPerMm, kPointsPerMm,
                                        page->height_mm * kPointsPerMm);
  for (const Rect& r : page->black)
    absl::StrAppendFormat(&content, "%.4f %.4f %.4f %.4f re\n", r.x, r.y, r.width, r.height);
  absl::StrAppendFormat(&content, "f\nBT /F1 2.4 Tf 1 0 0 -1 %.3f %.3f Tm (%s) Tj ET\n", page->text_x_mm,
                        page->text_y_mm, EscapePdf(page->text));
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R >>", "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      absl::StrFormat("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.6f %.6f] /Contents 4 0 R /Resources << "
                      "/Font << /F1 5 0 R "
                      ">> >> >>",
                      page->width_mm * kPointsPerMm, page->height_mm * kPointsPerMm),
      absl::StrCat("<< /Length ", content.size(), " >>\nstream\n", content, "endstream"),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>"};
  std::string out = "%PDF-1.4\n";
  std::vector<size_t> offsets;
  for (size_t i = 0; i < objects.size(); ++i) {
    offsets.push_back(out.size());
    absl::StrAppend(&out, i + 1, " 0 obj\n", objects[i], "\nendobj\n");
  }
  const size_t table = out.size();
  absl::StrAppend(&out, "xref\n0 ", objects.size() + 1, "\n0000000000 65535 f \n");
  for (const size_t offset : offsets) absl::StrAppendFormat(&out, "%010d 00000 n \n", offset);
  absl::StrAppend(&out, "trailer\n<< /Size ", objects.size() + 1, " /Root 1 0 R >>\nstartxref\n", table,
                  "\n%%EOF\n");
  return out;
}

}  // namespace weft

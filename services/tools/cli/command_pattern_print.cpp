// weft pattern print: a board as a print file.
#include <cstdio>

#include "services/formats/files/board_file.h"
#include "services/studio/print/print_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/progress.h"

namespace weft {
namespace {

struct PrintCommandOptions {
  std::string board;
  std::string out;
  std::string panels;
  double cell_mm = 0;
  bool whole = false;
  bool json = false;
  PrintOptions print;
  PrintFileOptions file;
};

absl::StatusOr<Board> LoadPrintedBoard(const PrintCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(Board board, ReadBoard(options.board));
  if (options.cell_mm > 0) board.cell_mm = options.cell_mm;
  if (!options.panels.empty()) {
    WEFT_ASSIGN_OR_RETURN(board.panels, ReadPanelMask(options.panels, board.rows, board.cols));
  }
  return board;
}

void PrintResult(const PrintCommandOptions& options, const PrintLayout& layout,
                 const std::vector<std::string>& files) {
  if (options.json) {
    std::printf("{\"cell_mm\": %g, \"ink_line_mm\": %g, \"files\": [", layout.cell_mm, layout.ink_line_mm);
    for (size_t i = 0; i < files.size(); ++i) std::printf("%s\"%s\"", i ? ", " : "", files[i].c_str());
    std::printf("], \"pages\": [");
    for (size_t i = 0; i < layout.pages.size(); ++i) {
      std::printf("%s{\"width_mm\": %.3f, \"height_mm\": %.3f, \"pieces\": [", i ? ", " : "",
                  layout.pages[i].width_mm, layout.pages[i].height_mm);
      for (size_t k = 0; k < layout.pages[i].pieces.size(); ++k) {
        const PrintPiece& p = layout.pages[i].pieces[k];
        std::printf(
            "%s{\"panel\": %d, \"x_mm\": %.4f, \"y_mm\": %.4f, \"row\": %d, \"col\": %d, \"rows\": %d, "
            "\"cols\": %d}",
            k ? ", " : "", p.panel, p.x_mm, p.y_mm, p.row, p.col, p.rows, p.cols);
      }
      std::printf("]}");
    }
    std::printf("]}\n");
    return;
  }
  std::printf("%s%s: %zu page%s, cells of %g mm, ink lines of %g mm\n", files.front().c_str(),
              files.size() > 1 ? " ..." : "", layout.pages.size(), layout.pages.size() == 1 ? "" : "s",
              layout.cell_mm, layout.ink_line_mm);
  for (size_t i = 0; i < layout.pages.size(); ++i) {
    std::printf("page %zu: %.0f x %.0f mm\n", i + 1, layout.pages[i].width_mm, layout.pages[i].height_mm);
    for (const PrintPiece& piece : layout.pages[i].pieces) std::printf("  %s\n", piece.label.c_str());
  }
}

absl::Status Print(const PrintCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const Board board, LoadPrintedBoard(options));
  PrintOptions print = options.print;
  print.panels = !options.whole;
  WEFT_ASSIGN_OR_RETURN(const PrintLayout layout, LayOutBoard(board, print));
  absl::StatusOr<std::vector<std::string>> files;
  {
    Progress progress("print", layout.pages.size(), ProgressVisible(quiet));
    files = WritePrintFiles(board, layout, options.out, options.file, [&](size_t) { progress.Advance(); });
  }
  if (!files.ok()) return files.status();
  PrintResult(options, layout, *files);
  return absl::OkStatus();
}

}  // namespace

void AddPatternPrintCommand(CLI::App& pattern, CommandLine& line) {
  const auto [print, options] = AddCommand<PrintCommandOptions>(
      pattern, line, Print, "print",
      "Write a board as a print file in true mm. Boards wider than the fabric come in tiles that overlap, "
      "with crosses that come to lie upon each other; boards with panels come panel by panel, with seam and "
      "cut lines. Each page has swatches of the inks and bars of known length at its head: measure them on "
      "the cloth.",
      "  weft pattern print shirt_board --out shirt.pdf --page-width-mm 1500\n"
      "  weft pattern print board.png --cell-mm 2.7 --out board.tif --dpi 360 --page-width-mm 900 "
      "--page-height-mm 1200\n"
      "  weft pattern print shirt_board --panels panels.png --seam-allowance-mm 12 --out panels.svg");
  AddRequired(*print, "BOARD", options->board, "board.json, its folder, or an image with one pixel per cell");
  AddRequired(*print, "--out FILE", options->out,
              "FILE.pdf (all pages), FILE.svg or FILE.tif (one file per page)");
  AddOption(*print, "--cell-mm MM", options->cell_mm,
            "Pitch of the cells; needed where the board does not say it", CLI::PositiveNumber);
  AddOption(*print, "--ink-line-mm MM", options->print.ink_line_mm,
            "Width of the lines between cells, instead of the board's", CLI::NonNegativeNumber);
  AddOption(*print, "--page-width-mm MM", options->print.page_width_mm, "Printable width of the fabric",
            CLI::PositiveNumber);
  AddOption(*print, "--page-height-mm MM", options->print.page_height_mm,
            "Length of a page; 0: as long as it takes", CLI::NonNegativeNumber);
  AddOption(*print, "--margin-mm MM", options->print.margin_mm, "Free on all sides", CLI::NonNegativeNumber);
  AddOption(*print, "--overlap-mm MM", options->print.overlap_mm, "Overlap of tiles", CLI::NonNegativeNumber);
  AddOption(*print, "--panels MASK", options->panels,
            "Mask of the panels, one pixel per cell, black outside");
  AddOption(*print, "--seam-allowance-mm MM", options->print.seam_allowance_mm,
            "Printed around each panel, for sewing", CLI::NonNegativeNumber);
  print->add_flag("--whole", options->whole, "The whole board, even where it has panels");
  AddOption(*print, "--dpi N", options->file.dpi, "Resolution of TIFF", CLI::PositiveNumber);
  print->add_flag("--json", options->json, "Print JSON");
}

}  // namespace weft

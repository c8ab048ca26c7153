// weft template check: is a template the garment that was meant?
#include <cstdio>
#include <string>

#include "absl/strings/str_format.h"
#include "base/named_status.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/template_summary.h"

namespace weft {
namespace {

struct TemplateCheckOptions {
  std::string folder;
  std::string board;
  int openings = -1;
  bool json = false;
};

// Against the board, or the size of cells that a built template knows.
absl::StatusOr<TemplateSize> SizeOf(const TemplateCheckOptions& options, const Template& garment,
                                    const GarmentParts& parts) {
  absl::StatusOr<TemplateSize> size;
  if (options.board.empty()) {
    size = CheckTemplateSize(garment, parts.cell_mm, parts.any_scale);
  } else {
    WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(options.board));
    WEFT_RETURN_IF_ERROR(CheckTemplateFitsBoard(garment, board));
    size = CheckTemplateOnBoard(garment, board, parts.any_scale);
  }
  if (size.ok()) return size;
  return Naming(options.folder, size.status());
}

absl::Status CheckTemplate(const TemplateCheckOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Template garment, ReadTemplate(options.folder));
  WEFT_ASSIGN_OR_RETURN(const GarmentParts parts, ReadGarmentParts(options.folder));
  WEFT_ASSIGN_OR_RETURN(const TemplateSize size, SizeOf(options, garment, parts));
  absl::StatusOr<v1::TemplateSummary> summary = SummarizeTemplate(garment, parts);
  absl::Status status = summary.status();
  if (status.ok()) {
    status = CheckOpeningCount(*summary, options.openings >= 0 ? options.openings : parts.expected_openings);
  }
  if (!status.ok()) {
    return Naming(options.folder, status);
  }
  AddPrintScale(size, &*summary);
  const v1::Verdict verdict = TemplateVerdict(*summary);
  if (options.json) {
    *summary->mutable_verdict() = verdict;
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(*summary));
  } else {
    PrintVerdict(verdict);
    std::fputs(TemplateSummaryText(*summary).c_str(), stdout);
    for (const std::string& note : size.unchecked) absl::PrintF("size     %s\n", note);
  }
  return VerdictStatus(verdict);
}

}  // namespace

void AddTemplateCheckCommand(CLI::App& garment, CommandLine& line) {
  const auto [command, options] = AddCommand<TemplateCheckOptions>(
      garment, line, CheckTemplate, "check",
      "Check a template: files that belong together, a clean surface (every edge with one or two faces that "
      "run the same way round and show the printed side), vertices that lie on the mesh as on the board, "
      "edges as long as on the print, seams and openings as template.json lists them. Prints what it is.",
      "  weft template check shirt --openings 4\n"
      "  weft template check shirt --board board.json --json");
  AddRequired(*command, "template DIR", options->folder, "Folder of the template, or its template.json");
  AddOption(*command, "--board BOARD", options->board, "Board that it must have been sewn from");
  AddOption(*command, "--openings N", options->openings,
            "Openings that the garment must have; -1: as many as its builder expected, if said",
            CLI::Range(-1, 100));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.TemplateSummary)");
}

}  // namespace weft

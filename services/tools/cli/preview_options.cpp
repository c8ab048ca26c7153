#include "services/tools/cli/preview_options.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/template_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/command_line.h"

namespace weft {

void AddPreviewOptions(CLI::App& command, PreviewCommandOptions& options) {
  CLI::Option* preview =
      AddOption(command, "--preview DIR", options.folder,
                "Write a page there, index.html, that shows what the cameras see and loads itself again: "
                "pictures, exposure, focus, with --board also cells that are read and coverage");
  CLI::Option* board = AddOption(command, "--board BOARD", options.board,
                                 "board.json or board.png of the cloth, for the preview")
                           ->needs(preview);
  AddOption(command, "--template DIR", options.garment,
            "The garment, for a coverage of its cells alone, painted on its shape")
      ->needs(board);
  AddOption(command, "--preview-interval S", options.interval_s, "Seconds between pages, at least",
            CLI::Range(0.1, 3600.0))
      ->needs(preview);
  AddOption(command, "--decoded-views N", options.decoded_views,
            "Cameras that are decoded for a page, in turn", CLI::Range(0, 1000))
      ->needs(board);
}

absl::StatusOr<std::unique_ptr<LivePreview>> StartPreview(const PreviewCommandOptions& options,
                                                          const std::string& take) {
  if (options.folder.empty()) return nullptr;
  LivePreviewOptions preview;
  preview.folder = options.folder;
  preview.title = std::filesystem::path(take).filename().string();
  preview.interval_s = options.interval_s;
  preview.decoded_views = options.decoded_views;
  if (!options.board.empty()) {
    WEFT_ASSIGN_OR_RETURN(preview.board, ReadBoard(options.board));
  }
  if (!options.garment.empty()) {
    std::vector<std::string> notes;
    WEFT_ASSIGN_OR_RETURN(Template garment, ReadTemplateFor(*preview.board, options.garment, &notes));
    for (const std::string& note : notes) PrintWarning(note);
    preview.garment = std::move(garment);
  }
  return LivePreview::Start(preview);
}

void WarnOfPreview(const absl::Status& status) {
  if (!status.ok()) PrintWarning(absl::StrCat("the preview: ", status.message()));
}

}  // namespace weft

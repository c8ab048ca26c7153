// The options of a live preview.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "services/studio/preview/live_preview.h"

namespace weft {

struct PreviewCommandOptions {
  std::string folder;  // empty: no preview
  std::string board;
  std::string garment;
  double interval_s = 1;
  int decoded_views = 2;
};

// --preview, --board, --template, --preview-interval, --decoded-views.
void AddPreviewOptions(CLI::App& command, PreviewCommandOptions& options);

// Null where none is asked for. Errors of LivePreview and of the files of board and template.
absl::StatusOr<std::unique_ptr<LivePreview>> StartPreview(const PreviewCommandOptions& options,
                                                          const std::string& take);
// A page that could not be written is a warning.
void WarnOfPreview(const absl::Status& status);

}  // namespace weft

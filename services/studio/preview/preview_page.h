// The page of a live preview.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/image/frame.h"
#include "capture/image/picture_quality.h"
#include "services/results/report/job_report.h"
#include "services/studio/preview/coverage.h"

namespace weft {

struct PreviewCamera {
  std::string id;
  std::string missing;     // why it has no picture in this set
  Frame thumbnail;         // RGB; without pixels where it is missing
  PictureQuality quality;  // of the cloth where cells were read, else of the whole picture
  bool is_cloth = false;   // which of the two
  double best_focus = 0;   // of this camera so far, and of the same of the two
  int64_t cells = -1;      // that it read when it was last decoded; -1: not yet, or nobody asked for it
};

struct PreviewCoverage {
  std::array<int64_t, kCoverageClasses> cells{};
  size_t cameras = 0;                 // decoded so far
  std::vector<MeshPicture> pictures;  // garment or board, transparent around it
};

struct PreviewPage {
  std::string title;
  std::string state;     // of the recording, in words; may be empty
  bool is_over = false;  // the last page
  double refresh_s = 1;  // loads itself again after so long, unless it is over
  int64_t made_unix_ms = 0;
  std::optional<uint64_t> set;  // none: no frame set came yet
  uint64_t passed_over = 0;     // frame sets that came while the page before was made
  std::vector<PreviewCamera> cameras;
  std::optional<PreviewCoverage> coverage;
};

// One self-contained HTML file. What needs attention is said in words, first of all; a page that is no longer
// renewed says so by a script of a few lines.
std::string PreviewHtml(const PreviewPage& page);

// What is wrong with a camera's picture, in words; empty where nothing is.
std::string PictureFault(const PreviewCamera& camera);

}  // namespace weft

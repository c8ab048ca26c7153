// What `weft template build` starts from: clouds, from files or out of the images of a dump, and panels.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template_build/build_template.h"
#include "pattern/board/board.h"
#include "services/formats/options/pipeline_options.h"

namespace weft {

struct TemplateSourceFiles {
  std::vector<std::string> sources;  // clouds, and dumps with their rig
  std::string rig;                   // of the dumps; empty where there is none
  std::string board;
  std::string panels;      // image with a pixel per cell; empty: found in the clouds
  std::string clouds_out;  // folder for the clouds of dumps: <frame>.ply
  std::string frames;      // of the dumps (FindFrameRange); empty: all
  std::string mosaic;      // of grey images of the dumps (MosaicFromName); empty: none
  int samples = 8;         // frames of a dump, spread evenly over those
};

// Reads the files; decodes and triangulates the dumps' frames in the calling thread's TBB arena with progress
// on stderr. Frames without a cloud are warned of and left out. InvalidArgument: a dump without --rig, panels
// of another size than the board; FailedPrecondition: no frame of a dump has a cloud; Cancelled: `stop` was
// requested. Clouds that were computed by then are kept.
absl::StatusOr<TemplateSources> ReadTemplateSources(const TemplateSourceFiles& files, const Board& board,
                                                    const PipelineOptions& options, bool quiet,
                                                    const std::stop_token& stop);

}  // namespace weft

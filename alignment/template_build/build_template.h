// A garment's template from clouds of it: panels, seams, openings, rest state.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "alignment/template_build/board_panels.h"
#include "alignment/template_build/lift.h"
#include "alignment/template_build/panel_sheet.h"
#include "alignment/template_build/rest_shape.h"
#include "alignment/template_build/seams.h"
#include "pattern/board/board.h"
#include "triangulation/cloud.h"

namespace weft {

struct TemplateBuildOptions {
  std::string id = "template";
  int openings = -1;  // expected; -1 takes what is found
  // A hole with a longer border stays open, one that was hardly seen with half as much again; 0: 60 pitches.
  double max_hole_mm = 0;
  bool corners = false;           // a vertex at every inner corner between cells, too
  int max_clouds = 4;             // that tell of the seams; all tell which cells are in the garment
  bool allow_open_seams = false;  // borders that look like a seam beyond the greatest gap stay open
  PanelOptions panels;
  SeamOptions seams;

  absl::Status Validate() const;
};

// What a build starts from.
struct TemplateSources {
  std::vector<Cloud> clouds;
  std::vector<std::string> cloud_names;  // for messages
  // Panels on the board, [rows][cols], 0 outside; empty: as the clouds show them.
  std::vector<uint8_t> panel_labels;
};

struct BuiltTemplate {
  Template garment;
  GarmentParts parts;
  PanelSheet sheet;                          // its vertices are the garment's first ones
  double measured_pitch_mm = 0;              // in the clouds
  std::vector<TemplateBorder> closed_holes;  // between seams, longest first
  int seam_faces = 0;                        // of the strips; the last faces are theirs and those of holes
  int euler = 0, genus = 0;
  RestStrain strain;
  int filled_cells = 0, speck_cells = 0, contradicting_points = 0;
  int reference = 0;  // cloud in whose pose the template rests
  std::vector<std::string> warnings;
};

// Finds the panels and seams, sews, closes small holes between seams and checks the openings. The rest
// pose is that of the fullest cloud. Vertices are the cells, panel by panel, then those between panels,
// which have no node, then the corners on request. Errors name what is missing and where. InvalidArgument:
// no clouds, cells off the board, pitch of another board. FailedPrecondition: panels that no cloud shows
// together, a panel without seam, a border too far from its partner, unexpected openings, handles.
// `on_progress` (may be empty) gets the share done. Parallel loops run in the caller's TBB arena; the same
// result at any thread count.
absl::StatusOr<BuiltTemplate> BuildTemplate(const Board& board, const TemplateSources& sources,
                                            const TemplateBuildOptions& options,
                                            const std::function<void(double)>& on_progress = {});

}  // namespace weft

// All options of a registration, made once per job and handed down by const reference.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/cell_prediction.h"
#include "alignment/template_build/build_template.h"
#include "alignment/temporal.h"
#include "pattern/decoder.h"
#include "pattern/surface/predicted_cells.h"
#include "triangulation/clean.h"
#include "triangulation/footprint.h"
#include "triangulation/triangulate.h"
#include "weft/v1/options.pb.h"

namespace weft {

// From observations to a cloud.
struct CloudOptions {
  TriangulationOptions triangulation;
  CleaningOptions cleaning;
  FootprintOptions footprint;

  absl::Status Validate() const;
};

// Whether, and how, missed cells are looked for where the first mesh expects them.
struct SecondPassOptions {
  bool enabled = true;
  // Cells that so many cameras measured are not looked for again.
  int enough_views = 6;
  PredictionOptions prediction;
  GuidedOptions guided;

  absl::Status Validate() const;
};

// The stages' own structs; a struct made by default is the preset "best". The solver and the untangling of
// the temporal refinement are those of the alignment.
struct PipelineOptions {
  DecodeOptions decode;
  CloudOptions cloud;
  SecondPassOptions second_pass;
  AlignOptions alignment;
  TemporalOptions temporal;
  TemplateBuildOptions template_build;

  absl::Status Validate() const;
};

// The options of `message`; those that it leaves out are as in the preset "best". InvalidArgument names an
// option beyond its range, and the range.
absl::StatusOr<PipelineOptions> ReadOptions(const v1::PipelineOptions& message);

// Every option, with its value.
v1::PipelineOptions MessageOf(const PipelineOptions& options);

}  // namespace weft

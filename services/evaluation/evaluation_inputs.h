// What `weft evaluate` is asked, and the files that it works on.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/frame_source.h"
#include "capture/rig.h"
#include "evaluation/camera_errors.h"
#include "evaluation/geodesic_distortion.h"
#include "evaluation/texture_drift.h"
#include "evaluation/truth_score.h"

namespace weft {

struct EvaluationRequest {
  std::string result;  // folder of a job's results
  // Empty paths are taken from <result>/job.json, the truth from the folder `truth` of the dump.
  std::string truth, dump, rig, garment;
  double fps = 0;  // of the take; 0: by the times of the truth, else 30 with a remark
  int samples =
      20;  // frames at which what takes long is measured (geodesics, texture drift), spread evenly; 0: all
  bool quick = false;  // leaves that out altogether
  EvaluationOptions scores;
  GeodesicOptions geodesics;
  TextureDriftOptions texture;
  CameraErrorOptions cameras;

  absl::Status Validate() const;
};

// A measure that could not be taken, and why; or an assumption that was made.
struct EvaluationRemark {
  std::string metric;  // "texture drift"
  std::string reason;
};

struct ListedFrame {
  std::string name;
  int position = 0;     // in the take: frames are consecutive when their positions are
  int dump_index = -1;  // in the dump; -1 when it is not there
};

// Pieces that are missing are empty, with a remark in `remarks`.
struct EvaluationInputs {
  std::string result, truth, dump_path;
  double fps = 0;
  std::optional<Rig> rig;
  std::optional<Template> garment;
  std::unique_ptr<FrameSource> dump;
  std::vector<ListedFrame> frames;  // of the truth where there is one, else of the result
  std::vector<EvaluationRemark> remarks;
};

// Files that the request names must be readable; those that job.json names may be missing.
// FailedPrecondition: rig or template are not those of the job, both hashes named. NotFound: a truth or a
// result without frames.
absl::StatusOr<EvaluationInputs> LoadEvaluationInputs(const EvaluationRequest& request);

}  // namespace weft

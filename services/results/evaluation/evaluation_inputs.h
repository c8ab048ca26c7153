// What `weft evaluate` is asked, and the files that it works on.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/joint_template.h"
#include "alignment/template.h"
#include "base/natural_order.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "evaluation/camera_errors.h"
#include "evaluation/geodesic_distortion.h"
#include "evaluation/texture_drift.h"
#include "evaluation/truth_by_node.h"
#include "evaluation/truth_score.h"
#include "services/results/evaluation/listed_frames.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

struct EvaluationRequest {
  std::string result;  // folder of a job's results
  // Empty paths are taken from <result>/job.json, the truth from the folder `truth` of the dump.
  // `garment` is a template, or a mesh in mm without a board (services/formats/files/garment_file.h).
  std::string truth, dump, rig, garment;
  bool no_truth = false;  // a truth beside the dump is left alone
  double fps = 0;         // of the take; 0: by the times of the take
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

// Pieces that are missing are empty, with a remark in `remarks`.
struct EvaluationInputs {
  std::string result, truth, dump_path;
  double fps = 0;          // 0: not known
  std::string fps_source;  // "--fps", "the take's times"
  std::optional<Rig> rig;
  std::shared_ptr<const GarmentMesh> garment;  // null: none is known
  // The same where it was sewn from a board: what is measured by cells needs it.
  std::shared_ptr<const Template> printed;
  // Where the result is of one of several garments of the truth: its rows of the joint board.
  std::optional<GarmentRows> rows_of_garment;
  std::unique_ptr<FrameSource> dump;
  // Where the result's template is not the truth's own.
  std::optional<TruthByNode> truth_by_node;
  // Those that the job was asked for. Without job.json all of the truth, or of the result.
  std::vector<ListedFrame> frames;
  // By frame, of those that are the job's by their inputs. Files of others are not used.
  std::map<std::string, v1::FrameReport, NaturalOrder> reports;
  std::vector<EvaluationRemark> remarks;
  v1::Job job;  // empty where the result has no job.json

  // Without a job nothing tells whose the files are, and all are used.
  bool Uses(const std::string& frame) const { return !job.has_spec() || reports.contains(frame); }
};

// Files that the request names must be readable; those that job.json names may be missing. A truth that
// was not requested and does not match is ignored with a remark. FailedPrecondition: rig or template are
// not those of the job, or the truth is of another board, both hashes named. NotFound: a truth or a result
// without frames.
absl::StatusOr<EvaluationInputs> LoadEvaluationInputs(const EvaluationRequest& request);

}  // namespace weft

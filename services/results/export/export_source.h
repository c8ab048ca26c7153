// The meshes of a result, one after another, as an export writes them.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/mesh.h"
#include "services/results/export/export_request.h"
#include "services/results/export/export_transform.h"
#include "services/results/export/reduced_mesh.h"
#include "weft/v1/export.pb.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// A frame in the axes and the unit of the export; vectors are [vertices].
struct ExportMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> velocities;  // unit per second; empty unless asked for
  std::vector<uint8_t> state;               // VertexState
  std::vector<float> sigma;
  std::vector<int> views;
};

// What does not change from frame to frame; vectors are [vertices] or [faces].
struct ExportTopology {
  size_t vertices = 0;
  std::vector<Face> faces;
  MeshTexture texture;      // empty: the result has none
  bool is_measured = true;  // of all meshes: they tell how their vertices are known
  std::vector<float> coverage;
  // Of formats whose attributes do not change in time.
  std::vector<uint8_t> usual_state;  // in most frames; of two as frequent ones that with the smaller number
  std::vector<float> mean_sigma_mm;
  Eigen::AlignedBox3f bounds;  // of all frames
};

// Holds at most three meshes at once. Thread safety: none.
class ExportSource {
 public:
  // Lists the frames. FailedPrecondition: the job has not ended, and unfinished jobs are not allowed, or no
  // frame of it has a mesh. NotFound: no such result, or mesh. InvalidArgument: the request, or its frames.
  static absl::StatusOr<ExportSource> Open(const ExportRequest& request);

  // Reads all meshes once: checks them against their reports and that all have one topology, and sums up
  // coverage and bounds. InvalidArgument, DataLoss name the file. Cancelled: a stop was requested.
  absl::Status Survey(const ExportProgress& progress, const std::stop_token& stop);

  const v1::Job& job() const { return job_; }
  // All frames asked for; those with `missing_because` have no mesh. The first one has, and so has the last.
  const std::vector<v1::ExportedFrame>& frames() const { return frames_; }
  // Positions in frames() of those with a mesh.
  const std::vector<size_t>& meshes() const { return meshes_; }
  const ExportTransform& transform() const { return transform_; }
  double fps() const { return fps_; }  // 0: not known
  const std::string& fps_source() const { return fps_source_; }
  const std::vector<std::string>& notes() const { return notes_; }
  // After Survey.
  const ExportTopology& topology() const { return topology_; }
  // What export.json says of it in every format; files are named by the format.
  v1::Export Manifest() const;
  // Where a coarser mesh is asked for: it, made on the first mesh of the job, whatever frames are exported.
  // So exports of one job fit each other.
  const std::optional<ReducedMesh>& reduced() const { return reduced_; }

  enum class Velocities { kLeftOut, kComputed };
  // `mesh` counts in meshes(). Velocities are differences between the meshes before and after, of one side at
  // the ends; they need fps(). Errors as Survey.
  absl::StatusOr<ExportMesh> Read(size_t mesh, Velocities velocities);

  // After Survey: the same meshes, all their vertices, in the rig's world and mm; the bounds of its
  // topology() stay those of the export.
  ExportSource InWorldMm() const;

 private:
  absl::Status ListFrames(const ExportRequest& request);
  absl::Status ListRange(const ExportRequest& request, const std::vector<v1::FrameReport>& reports);
  void NoteLostFrames(size_t frames);
  void FindRate(const ExportRequest& request);
  absl::StatusOr<std::shared_ptr<const RegisteredMesh>> Load(size_t mesh);
  absl::Status Reduce();

  std::string PathOf(const v1::ExportedFrame& frame) const;

  std::string result_;
  v1::Job job_;
  std::string mesh_;  // its name
  std::vector<v1::ExportedFrame> frames_;
  std::vector<size_t> meshes_;
  std::vector<std::string> notes_;
  ExportTransform transform_;
  double fps_ = 0;
  std::string fps_source_;
  ExportTopology topology_;
  int max_vertices_ = 0;
  v1::ExportedFrame first_of_job_;  // with a mesh
  std::optional<ReducedMesh> reduced_;
  std::shared_ptr<const ExportTopology> whole_;  // where there is a coarser one
  size_t vertices_in_files_ = 0;                 // of the result
  std::map<size_t, std::shared_ptr<const RegisteredMesh>> loaded_;
};

}  // namespace weft

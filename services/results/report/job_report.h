// The report of a job as one self-contained HTML file: <out>/report.html.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/results/report/mesh_colors.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

struct MeshPicture {
  std::string title;  // "Front"
  std::string bytes;  // of the file
  int width_px = 0;
  int height_px = 0;
  std::string type = "image/png";
};

// Pictures of one frame's mesh.
struct FramePictures {
  std::string frame;
  std::string why_shown;  // "first frame"
  std::vector<MeshPicture> by_state;
  std::vector<MeshPicture> by_sigma;
  ScalarRange sigma_range_mm;          // of the colours of by_sigma
  std::vector<MeshPicture> in_images;  // overlays on images of cameras
  bool is_driven = false;              // by an avatar
};

struct JobReportParts;

// The page: what came out in words, meshes in three dimensions, pictures, plots over the frames, tables of
// frames, cameras and stages, warnings, inputs. Frames in the order to be shown, any states, none or
// thousands of them. The same bytes for the same parts.
std::string MakeJobReport(JobReportParts parts);

// Writes <out_folder>/report.html from `job` and <out_folder>/<frame>/report.json, with pictures of the
// first, the worst and the last registered frame (<out_folder>/<frame>/mesh.ply), and up to 300 of all meshes
// in three dimensions. Frame files that are
// missing or broken, or of other inputs than the job's, are noted in the report. Errors are those of
// WriteFileAtomically, and of a folder that cannot be listed.
absl::Status WriteJobReport(const std::string& out_folder, const v1::Job& job);

}  // namespace weft

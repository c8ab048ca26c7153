// What `weft export` is asked.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/results/export/export_format.h"

namespace weft {

// Whose pictures overlays and textures are made from.
struct RecordingChoice {
  std::string dump, rig;             // empty: those of the job
  std::vector<std::string> cameras;  // ids; empty: all of the rig
};

// What is exported, whatever it becomes.
struct ExportScope {
  std::string result;  // folder of a job's results
  std::string out;     // folder of the export
  std::string frames;  // as FindFrameRange (capture/take/frame_range.h) reads it; empty: all
  double fps = 0;      // frames per second of the take; 0: by the times of the take
  RecordingChoice recording;
  bool allow_unfinished = false;  // a job that has not ended: its frames so far
};

struct ExportRequest : ExportScope {
  ExportFormat format = ExportFormat::kPly;
  std::string mesh;                // which of a frame's meshes, as ChooseMesh (frame_meshes.h) reads it
  std::optional<UpAxis> up;        // empty: that of the format
  std::string world_up = "-y";     // the axis of the rig's world that points up: x, -x, y, -y, z, -z
  std::optional<LengthUnit> unit;  // empty: metres
  bool has_attributes_named = false;
  std::vector<ExportAttribute> attributes;  // where named; else all that the format carries
  int max_vertices = 0;                     // not 0: a coarser mesh, as ReduceMesh makes it
  bool meshopt = false;                     // glb alone: compressed for browsers (EXT_meshopt_compression)
  // glb alone: not 0, the garment's texture of this width and height, from pictures of so many of the frames.
  int texture_px = 0;
  int texture_frames = 8;
  int normal_map_px = 0;  // glb of one frame alone: not 0, its normal map of this size

  // InvalidArgument names the option and the remedy.
  absl::Status Validate() const;
};

// What is asked of normal maps, alone and in a glb. InvalidArgument names the option and the remedy.
absl::Status CheckNormalMap(int normal_map_px, int max_vertices);

// First all meshes are read and checked, then a texture is made where one is asked for, then the files are
// written.
enum class ExportStep { kCheck, kTexture, kWrite };
// Steps done, of all. Called by the exporting thread.
using ExportProgress = std::function<void(ExportStep step, size_t done, size_t all)>;

}  // namespace weft

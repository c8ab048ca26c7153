// What writes the files of one format.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/results/export/export_source.h"
#include "services/results/export/export_stream.h"

namespace weft {

// A moment of the exported sequence.
struct ExportSample {
  size_t mesh = 0;    // in ExportSource::meshes()
  int index = 0;      // in the time line
  double time_s = 0;  // 0 where the rate is not known
  std::string frame;  // whose mesh it is
};

// What a glb has of the garment's surface besides its mesh.
struct GlbPictures {
  std::string albedo_png, normal_png;     // empty: none
  std::vector<Eigen::Vector4f> tangents;  // as NormalMap has them, in the axes of the export
};

// What all writers are made from; the source outlives them.
struct ExportPlan {
  ExportSource& source;  // with its Survey done
  const FormatTraits& traits;
  std::vector<ExportAttribute> attributes;  // that are written
  std::vector<ExportSample> samples;        // at least one
  bool meshopt = false;                     // as in ExportRequest
  int texture_px = 0, normal_map_px = 0;    // as in ExportRequest
  GlbPictures pictures;                     // of such sizes; there before Begin or Restore

  bool Has(ExportAttribute attribute) const;
};

// A file per frame. Thread safety: none.
class FrameWriter {
 public:
  virtual ~FrameWriter() = default;
  // The whole file.
  virtual absl::StatusOr<std::string> FileOf(const ExportMesh& mesh) = 0;
  // At most, for each frame.
  virtual uint64_t MaxFileBytes() const = 0;
};

// One file for all frames that only grows, so that an export can go on where it was interrupted. All samples
// are handed over in each of `passes()` passes; formats that keep each attribute together have several.
// Thread safety: none.
class SequenceWriter {
 public:
  virtual ~SequenceWriter() = default;

  virtual int passes() const { return 1; }
  virtual bool NeedsVelocities(int /*pass*/) const { return false; }
  // Before the first sample.
  virtual absl::Status Begin(ExportStream& out) = 0;
  // `sample` counts in plan.samples.
  virtual absl::Status Add(int pass, size_t sample, const ExportMesh& mesh, ExportStream& out) = 0;
  // After the last one.
  virtual absl::Status Finish(ExportStream& out) = 0;
  // What another writer of the same plan needs to go on, besides the file. Restore takes the place of Begin.
  virtual std::vector<double> State() const { return {}; }
  virtual absl::Status Restore(const std::vector<double>& /*state*/) { return absl::OkStatus(); }
  // Of the whole file, at most.
  virtual uint64_t MaxFileBytes() const = 0;
  // Vertices in the file, where they are not the template's.
  virtual size_t VerticesInFile(const ExportPlan& plan) const { return plan.source.topology().vertices; }
};

std::unique_ptr<FrameWriter> MakePlyWriter(const ExportPlan& plan);
std::unique_ptr<FrameWriter> MakeObjWriter(const ExportPlan& plan);
std::unique_ptr<SequenceWriter> MakeGlbWriter(const ExportPlan& plan);
std::unique_ptr<SequenceWriter> MakeMddWriter(const ExportPlan& plan);
std::unique_ptr<SequenceWriter> MakePc2Writer(const ExportPlan& plan);
std::unique_ptr<SequenceWriter> MakeUsdWriter(const ExportPlan& plan);
std::unique_ptr<SequenceWriter> MakeNpzWriter(const ExportPlan& plan);

}  // namespace weft

// A garment in motion, frame by frame: what is filmed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "figure/motion.h"
#include "physics/fabric.h"
#include "simulation/body_motion.h"
#include "simulation/garment.h"

namespace weft {

class PerformanceSource;

// Of the borders that hold a sheet or tube.
struct HandleMotion {
  double period_s = 2;
  double compression = 0.10;  // share by which the handles come closer; this is what makes folds
  double twist_deg = 30;      // each way: of the tube's lower end against the upper one, else of all
  double sway_mm = 8;         // sideways motion, each way

  absl::Status Validate() const;
};

struct PerformanceOptions {
  GarmentKind garment = GarmentKind::kTube;
  PerformanceMotion motion = PerformanceMotion::kBreathing;  // of the person in T-shirt or skirt
  // Instead of `motion`: what the person does from the first frame on, taken up within 0.8 s.
  std::shared_ptr<const Motion> clip;
  BodyShape body;      // of the person; a skirt's waist fits the average one only
  double cell_mm = 3;  // T-shirt and skirt keep their size: the number of cells follows
  int rows = 90;       // cells from top to bottom of what is not worn: sheet, tube, pleats, gathers, curls
  int cols = 144;      // and from left to right, or around
  int frames = 5;
  double fps = 30;
  double settle_s = 0.7;  // from rest to the first frame
  double step_s = 0;      // of the integration; 0 for one that suits the cell
  HandleMotion handles;   // of what is not worn
  JerseyOptions jersey;
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// World axes as in the rigs: x right, y down, z away from a viewer in front of the garment; a person looks
// towards -z.
struct PerformanceFrame {
  int64_t time_ns = 0;                                // 0 at the first frame
  std::vector<Eigen::Vector3d> vertices_mm;           // of the garment, [vertices]
  std::vector<Eigen::Vector3d> velocities_mm_s;       // [vertices], for motion blur
  std::vector<Eigen::Vector3d> body_vertices_mm;      // of body and hand; empty without
  std::vector<Eigen::Vector3d> body_velocities_mm_s;  // as many
  std::optional<FigurePose> pose;                     // of a person who follows a clip
};

// Deterministic: the same options and seed give the same bytes at any number of threads; parallel parts run
// in the calling thread's TBB arena. Not for use by two threads at once.
class Performance {
 public:
  // Builds the garment, dresses the body and lets it settle; `on_progress` (may be empty) is called with the
  // share done, 0 to 1. Errors of the options; Internal when the simulation fails.
  static absl::StatusOr<Performance> Start(const PerformanceOptions& options,
                                           const std::function<void(double)>& on_progress = {});
  // Goes on where SaveState was called in a performance of the same options; its frames are the same bytes as
  // if it had never stopped. DataLoss when the state is of another build or other options.
  static absl::StatusOr<Performance> Resume(const PerformanceOptions& options, std::string_view state);
  Performance(Performance&&) noexcept;
  Performance& operator=(Performance&&) noexcept;
  ~Performance();

  const PerformanceOptions& options() const;
  const Garment& garment() const;
  // Counter-clockwise seen from outside, the same in every frame; parts may overlap. Empty without a body.
  const std::vector<Face>& body_faces() const;

  // The next frame; OutOfRange after the last. Internal when the simulation fails, with the remedy.
  absl::StatusOr<PerformanceFrame> Next();
  int next() const { return next_; }
  // Some megabytes. Unimplemented for cloth that nobody wears.
  absl::StatusOr<std::string> SaveState();

 private:
  Performance(const PerformanceOptions& options, std::unique_ptr<PerformanceSource> source);

  PerformanceOptions options_;
  std::unique_ptr<PerformanceSource> source_;
  int next_ = 0;
};

}  // namespace weft

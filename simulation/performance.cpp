#include "simulation/performance.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "simulation/cloth.h"

namespace weft {

class Performance::Source {
 public:
  PerformanceOptions options;
  Garment garment;
  std::vector<Face> body_faces;
  std::vector<std::vector<Eigen::Vector3d>> frames_mm;
  int next = 0;

  PerformanceFrame FrameAt(int frame) const {
    PerformanceFrame out;
    out.time_ns = std::llround(frame * 1e9 / options.fps);
    out.vertices_mm = frames_mm[frame];
    // Central differences, one-sided at the ends.
    const int before = std::max(0, frame - 1), after = std::min<int>(frames_mm.size() - 1, frame + 1);
    const double per_s = after > before ? options.fps / (after - before) : 0;
    for (size_t v = 0; v < out.vertices_mm.size(); ++v)
      out.velocities_mm_s.push_back((frames_mm[after][v] - frames_mm[before][v]) * per_s);
    return out;
  }
};

namespace {

ClothOptions ClothOptionsOf(const PerformanceOptions& o) {
  ClothOptions out;
  out.shape = o.garment == GarmentKind::kSheet ? ClothShape::kSheet : ClothShape::kTube;
  out.rows = o.rows, out.cols = o.cols, out.cell_mm = o.cell_mm;
  return out;
}

MotionOptions MotionOptionsOf(const PerformanceOptions& o) {
  MotionOptions out;
  out.frames = o.frames, out.fps = o.fps, out.settle_s = o.settle_s, out.seed = o.seed;
  out.period_s = o.handles.period_s, out.compression = o.handles.compression;
  out.twist_deg = o.handles.twist_deg, out.sway_mm = o.handles.sway_mm;
  if (o.step_s > 0) out.step_s = o.step_s;
  out.fabric = o.fabric;
  return out;
}

}  // namespace

std::string_view NameOf(GarmentKind kind) {
  switch (kind) {
    case GarmentKind::kSheet:
      return "sheet";
    case GarmentKind::kTube:
      return "tube";
    case GarmentKind::kSkirt:
      return "skirt";
    case GarmentKind::kTShirt:
      return "tshirt";
  }
  return "";
}

std::string_view NameOf(PerformanceMotion motion) {
  switch (motion) {
    case PerformanceMotion::kBreathing:
      return "breathing";
    case PerformanceMotion::kTwist:
      return "twist";
    case PerformanceMotion::kJogging:
      return "jogging";
    case PerformanceMotion::kPinch:
      return "pinch";
  }
  return "";
}

absl::Status PerformanceOptions::Validate() const {
  if (!(step_s >= 0))
    return absl::InvalidArgumentError(
        absl::StrCat("performance: step_s is ", step_s, ", expected 0 (automatic) or more"));
  if (garment != GarmentKind::kSheet && garment != GarmentKind::kTube)
    return absl::UnimplementedError(
        absl::StrCat("performance: no garment \"", std::string(NameOf(garment)), "\" yet"));
  absl::Status status = ClothOptionsOf(*this).Validate();
  status.Update(MotionOptionsOf(*this).Validate());
  return status;
}

Performance::Performance(std::unique_ptr<Source> source) : source_(std::move(source)) {}
Performance::Performance(Performance&&) noexcept = default;
Performance& Performance::operator=(Performance&&) noexcept = default;
Performance::~Performance() = default;

const PerformanceOptions& Performance::options() const { return source_->options; }
const Garment& Performance::garment() const { return source_->garment; }
const std::vector<Face>& Performance::body_faces() const { return source_->body_faces; }

absl::StatusOr<Performance> Performance::Start(const PerformanceOptions& options,
                                               const std::function<void(double)>& on_progress) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  absl::StatusOr<Cloth> cloth = BuildCloth(ClothOptionsOf(options));
  if (!cloth.ok()) return cloth.status();
  auto frames = SimulateMotion(*cloth, MotionOptionsOf(options), [&](int done) {
    if (on_progress) on_progress(static_cast<double>(done) / options.frames);
  });
  if (!frames.ok()) return frames.status();
  auto source = std::make_unique<Source>();
  source->options = options;
  source->garment = {options.rows, options.cols,          options.cell_mm,
                     cloth->rest,  cloth->cell_of_vertex, cloth->print};
  source->frames_mm = *std::move(frames);
  return Performance(std::move(source));
}

absl::StatusOr<PerformanceFrame> Performance::Next() {
  if (source_->next >= static_cast<int>(source_->frames_mm.size()))
    return absl::OutOfRangeError(
        absl::StrCat("performance: all ", source_->frames_mm.size(), " frames are taken"));
  return source_->FrameAt(source_->next++);
}

}  // namespace weft

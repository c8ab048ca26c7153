#include "simulation/performance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "simulation/cloth.h"
#include "simulation/performance_source.h"
#include "simulation/worn_garment.h"

namespace weft {

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

// Sheet or tube between handles, simulated at once.
class HandledCloth : public PerformanceSource {
 public:
  HandledCloth(Garment garment, double fps, std::vector<std::vector<Eigen::Vector3d>> frames_mm)
      : garment_(std::move(garment)), fps_(fps), frames_mm_(std::move(frames_mm)) {}

  const Garment& garment() const override { return garment_; }
  const std::vector<Face>& body_faces() const override { return no_faces_; }
  absl::StatusOr<PerformanceFrame> FrameAt(int frame) override {
    PerformanceFrame out;
    out.time_ns = std::llround(frame * 1e9 / fps_);
    out.vertices_mm = frames_mm_[frame];
    // Central differences, one-sided at the ends.
    const int last = static_cast<int>(frames_mm_.size()) - 1;
    const int before = std::max(0, frame - 1), after = std::min(last, frame + 1);
    const double per_s = after > before ? fps_ / (after - before) : 0;
    for (size_t v = 0; v < out.vertices_mm.size(); ++v)
      out.velocities_mm_s.push_back((frames_mm_[after][v] - frames_mm_[before][v]) * per_s);
    return out;
  }

 private:
  Garment garment_;
  double fps_;
  std::vector<std::vector<Eigen::Vector3d>> frames_mm_;
  std::vector<Face> no_faces_;
};

absl::StatusOr<std::unique_ptr<PerformanceSource>> HangCloth(const PerformanceOptions& o,
                                                             const std::function<void(double)>& on_progress) {
  absl::StatusOr<Cloth> cloth = BuildCloth(ClothOptionsOf(o));
  if (!cloth.ok()) return cloth.status();
  auto frames = SimulateMotion(*cloth, MotionOptionsOf(o), [&](int done) {
    if (on_progress) on_progress(static_cast<double>(done) / o.frames);
  });
  if (!frames.ok()) return frames.status();
  Garment garment = {o.rows, o.cols, o.cell_mm, cloth->rest, cloth->cell_of_vertex, cloth->print};
  return std::make_unique<HandledCloth>(std::move(garment), o.fps, *std::move(frames));
}

bool IsWorn(GarmentKind kind) { return kind == GarmentKind::kTShirt || kind == GarmentKind::kSkirt; }

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

absl::Status PerformanceOptions::Validate() const {
  if (!(step_s >= 0))
    return absl::InvalidArgumentError(
        absl::StrCat("performance: step_s is ", step_s, ", expected 0 (automatic) or more"));
  // The handles' options hold frames, rate and time to settle, for all garments.
  absl::Status status = MotionOptionsOf(*this).Validate();
  if (!IsWorn(garment)) {
    status.Update(ClothOptionsOf(*this).Validate());
    return status;
  }
  if (!(cell_mm >= 1 && cell_mm <= 20))
    return absl::InvalidArgumentError(
        absl::StrCat("performance: cell_mm is ", cell_mm, ", expected 1 to 20 for a garment that is worn"));
  status.Update(jersey.Validate());
  return status;
}

Performance::Performance(const PerformanceOptions& options, std::unique_ptr<PerformanceSource> source)
    : options_(options), source_(std::move(source)) {}
Performance::Performance(Performance&&) noexcept = default;
Performance& Performance::operator=(Performance&&) noexcept = default;
Performance::~Performance() = default;

const PerformanceOptions& Performance::options() const { return options_; }
const Garment& Performance::garment() const { return source_->garment(); }
const std::vector<Face>& Performance::body_faces() const { return source_->body_faces(); }

absl::StatusOr<Performance> Performance::Start(const PerformanceOptions& options,
                                               const std::function<void(double)>& on_progress) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<PerformanceSource>> source =
      IsWorn(options.garment) ? WearGarment(options, on_progress) : HangCloth(options, on_progress);
  if (!source.ok()) return source.status();
  return Performance(options, *std::move(source));
}

absl::StatusOr<PerformanceFrame> Performance::Next() {
  if (next_ >= options_.frames)
    return absl::OutOfRangeError(absl::StrCat("performance: all ", options_.frames, " frames are taken"));
  return source_->FrameAt(next_++);
}

}  // namespace weft

#include "simulation/performance.h"

#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "simulation/folded_motion.h"
#include "simulation/hung_cloth.h"
#include "simulation/performance_source.h"
#include "simulation/worn_garment.h"

namespace weft {

namespace {

bool HasWaist(GarmentKind kind) { return kind == GarmentKind::kSkirt || kind == GarmentKind::kShirtAndSkirt; }

bool IsWorn(GarmentKind kind) { return kind == GarmentKind::kTShirt || HasWaist(kind); }

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
    case GarmentKind::kPleatedSkirt:
      return "pleated-skirt";
    case GarmentKind::kGatheredSkirt:
      return "gathered-skirt";
    case GarmentKind::kCurlingSheet:
      return "curling-sheet";
    case GarmentKind::kShirtAndSkirt:
      return "shirt-and-skirt";
  }
  return "";
}

absl::Status HandleMotion::Validate() const {
  const auto check = [](const char* field, double value, double low, double high) -> absl::Status {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("handles: ", field, " is ", value, ", expected ", low, " to ", high));
  };
  absl::Status status = check("period_s", period_s, 0.05, 1e6);
  status.Update(check("compression", compression, 0, 0.65));
  status.Update(check("twist_deg", twist_deg, -90, 90));
  status.Update(check("sway_mm", sway_mm, -1000, 1000));
  return status;
}

absl::Status PerformanceOptions::Validate() const {
  const auto check = [](const char* field, double value, double low, double high) -> absl::Status {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("performance: ", field, " is ", value, ", expected ", low, " to ", high));
  };
  absl::Status status = check("frames", frames, 1, 100000);
  status.Update(check("fps", fps, 1e-3, 1000));
  status.Update(check("settle_s", settle_s, 0.1, 1000));
  status.Update(check("step_s", step_s, 0, 0.01));  // 0: automatic
  status.Update(jersey.Validate());
  if (IsWorn(garment)) {
    status.Update(check("cell_mm", cell_mm, 1, 20));
    status.Update(body.Validate());
    if (clip) status.Update(clip->Validate());
    if (HasWaist(garment) && body != BodyShape())
      status.Update(absl::InvalidArgumentError(
          "performance: body is not the average one, whose waist the skirt fits; choose the garment tshirt"));
  } else {
    if (clip)
      status.Update(absl::InvalidArgumentError(
          absl::StrCat("performance: clip moves a person, and nobody wears a ", std::string(NameOf(garment)),
                       "; choose the garment tshirt or skirt")));
    status.Update(handles.Validate());
    status.Update(ClothOptionsOf(*this).Validate());
  }
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
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<PerformanceSource> source,
                        IsWorn(options.garment)     ? WearGarment(options, on_progress)
                        : IsFolded(options.garment) ? MoveFoldedCloth(options, on_progress)
                                                    : HangCloth(options, on_progress));
  return Performance(options, std::move(source));
}

absl::StatusOr<Performance> Performance::Resume(const PerformanceOptions& options, std::string_view state) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (!IsWorn(options.garment))
    return absl::UnimplementedError("performance: only a worn garment's motion is resumed from its state");
  int next = 0;
  if (state.size() < sizeof next) return absl::DataLossError("performance: the saved state is cut off");
  std::memcpy(&next, state.data(), sizeof next);
  WEFT_ASSIGN_OR_RETURN(auto source, ResumeGarment(options, state.substr(sizeof next)));
  Performance out(options, std::move(source));
  out.next_ = next;
  return out;
}

absl::StatusOr<std::string> Performance::SaveState() {
  const std::string of_source = source_->SaveState();
  if (of_source.empty())
    return absl::UnimplementedError("performance: only a worn garment's motion has a state that is saved");
  std::string out(reinterpret_cast<const char*>(&next_), sizeof next_);
  return out + of_source;
}

absl::StatusOr<PerformanceFrame> Performance::Next() {
  if (next_ >= options_.frames)
    return absl::OutOfRangeError(absl::StrCat("performance: all ", options_.frames, " frames are taken"));
  return source_->FrameAt(next_++);
}

}  // namespace weft

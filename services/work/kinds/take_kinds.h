// The kinds of work whose units are the frames of a take.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/work/kinds/work_kind.h"

namespace weft {

// Registers each frame (services/work/pipeline).
class RegisterKind : public WorkKind {
 public:
  const v1::WorkKindInfo& info() const override { return *FindKindInfo(kRegisterKind); }
  Order order() const override { return Order::kApart; }
  bool is_refined_later() const override { return true; }
  bool has_coverage() const override { return true; }
  std::optional<SpecFault> FaultOf(const v1::RegistrationSpec&) const override { return std::nullopt; }
  absl::StatusOr<v1::RegistrationOptions> Effective(const v1::RegistrationOptions& asked) const override;
  absl::StatusOr<std::unique_ptr<Work>> Load(const v1::RegistrationSpec& spec,
                                             LoadFor purpose) const override;
  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const override;
};

// Drives the take by an avatar (services/work/animation).
class DriveKind : public WorkKind {
 public:
  const v1::WorkKindInfo& info() const override { return *FindKindInfo(kDriveKind); }
  Order order() const override { return Order::kInSequence; }
  bool is_refined_later() const override { return false; }
  bool has_coverage() const override { return false; }
  std::optional<SpecFault> FaultOf(const v1::RegistrationSpec& spec) const override;
  absl::StatusOr<v1::RegistrationOptions> Effective(const v1::RegistrationOptions& asked) const override;
  absl::StatusOr<std::unique_ptr<Work>> Load(const v1::RegistrationSpec& spec,
                                             LoadFor purpose) const override;
  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const override;
};

}  // namespace weft

// Kinds whose units are computed one by one: their keys, resuming, checking and reporting are done here.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/frame_folder.h"

namespace weft {

// A part of an algorithm that results depend on. Whoever changes what it computes raises the version.
struct WorkStage {
  std::string name;
  int version = 0;
};

// Those of the pipeline that it uses, and its own.
template <Stage... kUsed>
std::vector<WorkStage> StagesOf(StageList<kUsed...>, std::vector<WorkStage> own) {
  std::vector<WorkStage> stages = {{StageName(kUsed), AlgorithmVersion(kUsed)}...};
  stages.insert(stages.end(), own.begin(), own.end());
  return stages;
}

// Inputs and options of a job by name, checked against its kind (FaultOfWork).
class WorkArguments {
 public:
  WorkArguments(const v1::WorkKindInfo& info, const v1::WorkSpec& work) : info_(info), work_(work) {}

  // The path of an input; empty: it is not given.
  std::string Input(std::string_view name) const;
  // The value that was given, or the preset.
  std::string Text(std::string_view name) const;
  double Number(std::string_view name) const;  // 0: neither
  bool Has(std::string_view name) const;
  // All options as text that differs where their values do.
  std::string OptionsText() const;

 private:
  const v1::WorkKindInfo& info_;
  const v1::WorkSpec work_;
};

// A unit while it is computed.
struct UnitPlace {
  const FrameFolder& folder;  // for its files, by FrameFolder::Put
  v1::FrameReport& report;    // with name, keys and hashes
  // Of kinds in sequence: what the unit before knew, empty before the first one; then what this one knows.
  std::string& state;
  std::function<void(double share)> advance;
  std::stop_token stop;
};

// The inputs of a job, read.
class Units {
 public:
  virtual ~Units() = default;

  // Of all that there are, in order; plain names of folders.
  virtual std::vector<std::string> Names() const = 0;
  // Of what every unit depends on: hashes of inputs by their names.
  virtual std::vector<v1::NamedValue> Hashes() const = 0;
  virtual std::vector<std::string> Warnings() const { return {}; }
  // Changes with what this unit alone reads. NotFound, DataLoss.
  virtual absl::StatusOr<std::string> Fingerprint(size_t unit) const = 0;
  // Writes the unit's files. One that cannot be computed is no error: its report says FRAME_STATE_FAILED and
  // why. Cancelled: a stop was asked for. Other errors mean that results cannot be written.
  virtual absl::Status Compute(size_t unit, const UnitPlace& place) = 0;
};

// Thread safety: const access.
class UnitKind : public WorkKind {
 public:
  // `stages`: all that its results depend on. Their versions are part of each unit's key, so there is no kind
  // without: it ends the program.
  UnitKind(v1::WorkKindInfo info, Order order, std::vector<WorkStage> stages);

  const v1::WorkKindInfo& info() const final { return info_; }
  Order order() const final { return order_; }
  bool is_refined_later() const final { return false; }
  bool has_coverage() const override { return false; }
  std::optional<SpecFault> FaultOf(const v1::RegistrationSpec& spec) const override;
  absl::StatusOr<v1::RegistrationOptions> Effective(const v1::RegistrationOptions& asked) const final;
  absl::StatusOr<std::unique_ptr<Work>> Load(const v1::RegistrationSpec& spec, LoadFor purpose) const final;
  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const final;

  const std::vector<WorkStage>& stages() const { return stages_; }

 protected:
  // Reads and checks the inputs. Errors keep the category of the file that causes them and name it.
  virtual absl::StatusOr<std::unique_ptr<Units>> Open(const WorkArguments& arguments) const = 0;

 private:
  const v1::WorkKindInfo info_;
  const Order order_;
  const std::vector<WorkStage> stages_;
};

}  // namespace weft

// What sets kinds of jobs apart: registering a take, driving it, and those to come.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/work/pipeline/registration.h"
#include "services/work/pipeline/results_check.h"
#include "services/work/spec/kind_info.h"
#include "weft/v1/job.pb.h"

namespace weft {

// What the inputs of a job hold.
struct LoadedInputs {
  std::vector<std::string> frames;  // the names of those that are asked for
  v1::InputHashes hashes;
  std::vector<std::string> warnings;
  std::optional<v1::DrivenJob> driven;  // of jobs with an avatar
};

// Where frames are computed, and what that may take.
struct WorkPlace {
  std::string out;  // an absolute path without links (output_folder.h), with one writer
  RegistrationLimits limits;
  std::string scratch_folder;  // for copies of images; empty: none are made
  uint64_t scratch_bytes = 0;
};

// A job whose inputs are loaded and checked against each other. Thread safety: none.
class Work {
 public:
  virtual ~Work() = default;

  virtual const LoadedInputs& inputs() const = 0;
  // Computes these of inputs().frames, by position and in order; complete ones of an earlier run are kept.
  // Cancelled when `stop` was requested: frames finished by then are complete. Other errors mean that results
  // cannot be written; a frame that cannot be computed is no error.
  virtual absl::Status Run(const std::vector<size_t>& frames, const WorkPlace& place,
                           const RegistrationEvents& events, const std::stop_token& stop) = 0;
  // As WorkKind::FindIncomplete.
  virtual absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const = 0;
};

class WorkKind {
 public:
  enum class Order {
    kApart,       // any worker may have any frame
    kInSequence,  // each frame needs the state of the one before it: one worker at a time has all, in order
  };
  enum class LoadFor {
    kListing,   // to list frames and check inputs; what only computing needs may be left out
    kWholeJob,  // to compute all frames, with all warnings
    kTask,      // to compute some of them
  };

  virtual ~WorkKind() = default;

  virtual const v1::WorkKindInfo& info() const = 0;
  const std::string& name() const { return info().name(); }            // of its command: "register"
  const std::string& done_word() const { return info().done_word(); }  // "registered"
  virtual Order order() const = 0;
  // Whether frames are computed once more, with their neighbours, when a take that grew has ended.
  virtual bool is_refined_later() const = 0;
  // Whether FrameInfo.coverage says how good a frame is.
  virtual bool has_coverage() const = 0;

  // Of the fields that this kind alone has. Reads no files.
  virtual std::optional<SpecFault> FaultOf(const v1::RegistrationSpec& spec) const = 0;
  // Options with preset and defaults spelled out, and none that this kind ignores. InvalidArgument.
  virtual absl::StatusOr<v1::RegistrationOptions> Effective(const v1::RegistrationOptions& asked) const = 0;
  // Errors keep the category of the file that causes them and name it. InvalidArgument: an empty field, an
  // option beyond its range, a range without a frame. FailedPrecondition: inputs that do not belong together,
  // or have other hashes than spec.expected.
  virtual absl::StatusOr<std::unique_ptr<Work>> Load(const v1::RegistrationSpec& spec,
                                                     LoadFor purpose) const = 0;
  // Frames that are dealt with and whose results are not there, or were computed from other inputs
  // (results_check.h).
  virtual absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const = 0;
};

// That of the job, which lives as long as the program. A kind that nobody knows does nothing, and says so.
const WorkKind& KindOf(const v1::RegistrationSpec& spec);
// Adds a kind that jobs name in spec.work. Its name is new; call it before other threads start.
void AddKind(std::unique_ptr<WorkKind> kind);

// Reads the inputs of a job and checks them against each other.
using InputsLoader = std::function<absl::StatusOr<LoadedInputs>(const v1::RegistrationSpec& spec)>;
// The InputsLoader that asks the job's kind. Errors of WorkKind::Load.
absl::StatusOr<LoadedInputs> ListInputs(const v1::RegistrationSpec& spec);

}  // namespace weft

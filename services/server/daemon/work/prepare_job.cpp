#include "services/server/daemon/work/prepare_job.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "capture/file/content_hash.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_progress.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/options/presets.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/work/take_input.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_process.h"
#include "services/work/items/item_words.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/pipeline/result_lock.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

bool RecorderLives(const std::string& take) {
  const absl::StatusOr<RecorderView> recorder = InspectRecorder(std::filesystem::path(take).parent_path());
  return recorder.ok() && recorder->lives;
}

// "take:<id>" in place of a path needs no permission: the folder is the daemon's own.
absl::StatusOr<std::string> CanonicalDump(const PathPolicy& policy, const std::string& takes_folder,
                                          const v1::RegistrationSpec& spec) {
  const std::string& dump = spec.dump();
  absl::StatusOr<std::string> take = TakeOfName(takes_folder, dump);
  if (!take.ok()) return take;
  if (*take == dump) return policy.CheckInputPath("spec.dump", dump);
  std::error_code error;
  if (std::filesystem::is_directory(*take, error)) return take;
  if (!RecorderLives(*take)) {
    return FieldError(absl::StatusCode::kNotFound, {"spec.dump", absl::StrCat(dump, ": no such take"),
                                                    "`weft take list` shows the takes"});
  }
  if (spec.live_every() > 0) return take;
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"spec.dump", absl::StrCat(dump, ": its cameras are being opened"),
                     "wait until it is recorded, or register it live"});
}

// Of a take that was started in a session: what the request leaves out.
void TakeInputsFromSession(const std::string& takes_folder, v1::RegistrationSpec& spec) {
  const absl::StatusOr<std::string> take = TakeOfName(takes_folder, spec.dump());
  if (!take.ok() || *take == spec.dump()) return;
  const absl::StatusOr<RecorderView> recorder = InspectRecorder(std::filesystem::path(*take).parent_path());
  if (!recorder.ok()) return;  // whoever opens the take says why
  if (spec.rig().empty()) spec.set_rig(recorder->request.rig());
  if (spec.board().empty()) spec.set_board(recorder->request.board());
  if (spec.garment().empty()) spec.set_garment(recorder->request.garment());
}

// The item of such an input; null: no library keeps it.
std::string* ItemOf(const JobInput& input, v1::JobItems* items) {
  if (input.of_work >= 0) return nullptr;
  switch (input.kind) {
    case v1::ITEM_KIND_DUMP:
      return items->mutable_dump();
    case v1::ITEM_KIND_RIG:
      return items->mutable_rig();
    case v1::ITEM_KIND_BOARD:
      return items->mutable_board();
    case v1::ITEM_KIND_TEMPLATE:
      return items->mutable_garment();
    case v1::ITEM_KIND_AVATAR:
      return items->mutable_avatar();
    default:
      return nullptr;
  }
}

// Replaces "library:..." by the item's path. The item's id; empty: the input is none of the library's.
absl::StatusOr<std::string> ResolveItem(Library& library, const JobInput& input, PreparedJob* prepared) {
  if (!absl::StartsWith(input.path, kLibraryPrefix)) return std::string();
  WEFT_ASSIGN_OR_RETURN(
      HeldItem held,
      Naming(input.field, library.Hold(input.kind, input.path.substr(sizeof(kLibraryPrefix) - 1))));
  SetInput(input, held.path, prepared->job.mutable_spec());
  prepared->holds.push_back(std::move(held.hold));
  return held.item.id();
}

// Items of the library, and inputs without a field of their own, become paths that may be read.
absl::Status ResolveItems(const JobPlaces& places, PreparedJob* prepared) {
  v1::JobItems& items = *prepared->job.mutable_items();
  for (const JobInput& input : InputsOf(prepared->job.spec())) {
    std::string* item = ItemOf(input, &items);
    if (item == nullptr && input.of_work < 0) continue;
    WEFT_ASSIGN_OR_RETURN(std::string id, ResolveItem(places.library, input, prepared));
    if (item != nullptr) {
      *item = std::move(id);
    } else if (!id.empty()) {
      items.add_work(std::move(id));
    } else {
      WEFT_ASSIGN_OR_RETURN(const std::string path, places.resolve(input.field, input.kind, input.path));
      SetInput(input, path, prepared->job.mutable_spec());
    }
  }
  return absl::OkStatus();
}

bool ReadsDump(const v1::RegistrationSpec& spec) {
  const std::vector<JobInput> inputs = InputsOf(spec);
  return std::any_of(inputs.begin(), inputs.end(),
                     [](const JobInput& input) { return input.field == "spec.dump"; });
}

// Paths that a client named beside the take; the library's items are the daemon's own.
std::vector<JobInput> NamedInputs(v1::Job& job) {
  std::vector<JobInput> inputs = InputsOf(job.spec());
  std::erase_if(inputs, [&job](const JobInput& input) {
    const std::string* item = ItemOf(input, job.mutable_items());
    return input.kind == v1::ITEM_KIND_DUMP || input.of_work >= 0 || input.path.empty() ||
           (item != nullptr && !item->empty());
  });
  return inputs;
}

absl::Status CanonicalizeInputs(const PathPolicy& policy, const std::string& takes_folder, v1::Job& job) {
  v1::RegistrationSpec& spec = *job.mutable_spec();
  if (job.items().dump().empty() && ReadsDump(spec)) {
    WEFT_ASSIGN_OR_RETURN(std::string dump, CanonicalDump(policy, takes_folder, spec));
    spec.set_dump(std::move(dump));
  }
  for (const JobInput& input : NamedInputs(job)) {
    WEFT_ASSIGN_OR_RETURN(const std::string canonical, policy.CheckInputPath(input.field, input.path));
    SetInput(input, canonical, &spec);
  }
  return absl::OkStatus();
}

// Of inputs whose paths are canonical.
absl::Status CheckLinks(const PathPolicy& policy, const std::string& takes_folder, v1::Job& job) {
  const std::string& dump = job.spec().dump();
  absl::Status status;
  if (job.items().dump().empty() && ReadsDump(job.spec()) && !LiesBelow(dump, takes_folder))
    status = policy.CheckLinks("spec.dump", dump);
  for (const JobInput& input : NamedInputs(job)) {
    if (status.ok()) status = policy.CheckLinks(input.field, input.path);
  }
  return status;
}

// Names of the frame sets that a take has so far; waits for the first one.
absl::StatusOr<std::vector<std::string>> FramesSoFar(const std::string& take) {
  constexpr int kLooks = 300;  // cameras are opened, and follow a clock, before the first one comes
  constexpr std::chrono::milliseconds kPause{100};
  for (int look = 0; look < kLooks; ++look) {
    if (look > 0) std::this_thread::sleep_for(kPause);
    const absl::StatusOr<TakeProgress> progress = ReadTakeProgress(take);
    if (absl::IsNotFound(progress.status()) && RecorderLives(take)) continue;
    if (!progress.ok()) {
      return FieldError(progress.status().code(),
                        {"spec.live_every", std::string(progress.status().message()),
                         "name a take that is being recorded, or leave live_every out"});
    }
    std::vector<std::string> names;
    for (const RecordedSet& set : progress->sets) names.push_back(FrameNameOf(set.number));
    if (!names.empty()) return names;
    if (progress->closed) break;
  }
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"spec.dump", absl::StrCat(take, " has no frame set yet"), "start its cameras first"});
}

// The folder of results, which exists then.
absl::StatusOr<std::string> ChooseOut(const v1::SubmitJobRequest& request, const v1::RegistrationSpec& spec,
                                      const JobPlaces& places, const std::string& job_id) {
  const PathPolicy& policy = places.policy;
  const std::string& results_folder = places.results_folder;
  std::string out = absl::StrCat(results_folder, "/", job_id);
  if (!request.spec().out().empty()) {
    WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
    const std::string state_folder = std::filesystem::path(results_folder).parent_path().string();
    // Also where a probe shows that the client cannot see it.
    std::error_code unknown;
    const std::filesystem::path wanted = std::filesystem::weakly_canonical(request.spec().out(), unknown);
    if (!unknown && LiesBelow(wanted, state_folder)) {
      return FieldError(
          absl::StatusCode::kPermissionDenied,
          {"spec.out", absl::StrCat(wanted.string(), " is in the daemon's own folder, ", state_folder),
           "choose another one"});
    }
    const absl::StatusOr<std::string> asked = policy.CheckOutput("spec.out", request.spec().out());
    const std::string& probe = request.out_probe();
    std::error_code error;
    if (probe.empty() && !asked.ok()) return asked.status();
    if (asked.ok() && (probe.empty() || std::filesystem::exists(absl::StrCat(*asked, "/", probe), error))) {
      out = *asked;
    }
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(out));
  if (access(out.c_str(), W_OK | X_OK) != 0) {
    return FieldError(
        absl::StatusCode::kPermissionDenied,
        {"spec.out", absl::StrCat(out, " cannot be written by the daemon"), "change its permissions"});
  }
  return out;
}

}  // namespace

std::string HashOfRequest(const v1::SubmitJobRequest& request) {
  return ContentHash()
      .Add(request.spec().SerializeAsString())
      .AddInteger(static_cast<uint64_t>(request.priority()))
      .Hex();
}

absl::StatusOr<PreparedJob> PrepareJob(const v1::SubmitJobRequest& asked, const JobPlaces& places,
                                       const std::string& caller_name, const InputsLoader& load) {
  const std::string takes_folder = std::filesystem::path(places.results_folder).parent_path() / "takes";
  v1::SubmitJobRequest request = asked;
  if (request.has_spec()) TakeInputsFromSession(takes_folder, *request.mutable_spec());
  WEFT_RETURN_IF_ERROR(CheckSubmitRequest(request));
  PreparedJob prepared;
  v1::Job& job = prepared.job;
  job.set_id(request.idempotency_key().empty() ? NewTimedId() : request.idempotency_key());
  if (!request.idempotency_key().empty()) job.set_request_hash(HashOfRequest(asked));
  job.set_priority(request.priority());
  job.set_weft_version(WEFT_VERSION);
  *job.mutable_spec() = request.spec();
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationOptions options,
                        KindOf(request.spec()).Effective(request.spec().options()));
  *job.mutable_spec()->mutable_options() = std::move(options);
  WEFT_RETURN_IF_ERROR(ResolveItems(places, &prepared));
  WEFT_RETURN_IF_ERROR(CanonicalizeInputs(places.policy, takes_folder, job));
  // LoadInputs wants every field.
  if (job.spec().out().empty())
    job.mutable_spec()->set_out(absl::StrCat(places.results_folder, "/", job.id()));
  std::vector<std::string> so_far;
  if (job.spec().live_every() > 0) {
    WEFT_ASSIGN_OR_RETURN(std::vector<std::string> names, FramesSoFar(job.spec().dump()));
    so_far = std::move(names);
  }
  WEFT_ASSIGN_OR_RETURN(
      LoadedInputs inputs,
      places.known.Get(job.spec(), caller_name,
                       [&](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
                         // Folders without a change have no new links either.
                         const absl::Status status = CheckLinks(places.policy, takes_folder, job);
                         return status.ok() ? load(spec) : status;
                       }));
  if (!so_far.empty()) inputs.frames = std::move(so_far);
  WEFT_ASSIGN_OR_RETURN(std::string out, ChooseOut(request, job.spec(), places, job.id()));
  // Whoever writes there now is named now, not when the job's turn comes. The job takes the lock when it
  // starts.
  const absl::StatusOr<ResultLock> nobody = ResultLock::Acquire(out, "weftd", std::chrono::milliseconds(0));
  if (!nobody.ok()) return nobody.status();
  job.mutable_spec()->set_out(std::move(out));
  *job.mutable_inputs() = inputs.hashes;
  if (inputs.driven) *job.mutable_driven() = *inputs.driven;
  job.mutable_warnings()->Assign(inputs.warnings.begin(), inputs.warnings.end());
  prepared.frames = std::move(inputs.frames);
  job.set_first_frame(prepared.frames.front());
  job.set_last_frame(prepared.frames.back());
  return prepared;
}

}  // namespace weft

#include "services/tools/cli/remote_registration.h"

#include <unistd.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "services/formats/files/atomic_file.h"
#include "services/tools/cli/absolute_paths.h"
#include "services/tools/client/fetch_results.h"
#include "services/tools/client/registration_client.h"
#include "services/work/pipeline/output_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A file in the output folder by which the daemon recognises that it sees the same folder.
class Probe {
 public:
  static absl::StatusOr<Probe> Create(const std::string& folder) {
    WEFT_RETURN_IF_ERROR(CreateFolders(folder));
    Probe probe(fs::path(folder) / absl::StrCat(".weft-probe-", getpid(), "-", HostTime_ns()));
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(probe.path_.string(), "weft\n"));
    return probe;
  }
  Probe(Probe&& other) noexcept : path_(std::move(other.path_)) { other.path_.clear(); }
  Probe& operator=(Probe&&) = delete;
  ~Probe() {
    if (!path_.empty()) RemoveFile(path_);
  }

  std::string name() const { return path_.filename().string(); }

 private:
  explicit Probe(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
};

absl::StatusOr<v1::Job> Submit(RegistrationClient& client, const v1::RegistrationSpec& spec, int priority) {
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(const Probe probe, Probe::Create(spec.out()));
  v1::SubmitJobRequest request;
  *request.mutable_spec() = spec;
  request.set_out_probe(probe.name());
  request.set_idempotency_key(NewTimedId());
  request.set_priority(priority);
  return client.Submit(request);
}

}  // namespace

absl::StatusOr<v1::Job> SubmitRemotely(const std::string& server, const v1::RegistrationSpec& spec,
                                       int priority) {
  WEFT_ASSIGN_OR_RETURN(const auto client, RegistrationClient::Connect(server));
  return Submit(*client, WithAbsolutePaths(spec), priority);
}

absl::StatusOr<v1::Job> RegisterRemotely(const std::string& server, const v1::RegistrationSpec& spec,
                                         int priority,
                                         const std::function<void(const v1::JobUpdate&)>& update,
                                         const std::function<void(size_t done, size_t total)>& fetched,
                                         std::stop_token stop) {
  WEFT_ASSIGN_OR_RETURN(const auto client, RegistrationClient::Connect(server));
  const v1::RegistrationSpec absolute = WithAbsolutePaths(spec);
  absl::StatusOr<v1::Job> job = Submit(*client, absolute, priority);
  if (!job.ok()) return job.status();
  const std::string id = job->id();

  job = client->Watch(id, update, stop);
  if (stop.stop_requested()) {
    if (absl::StatusOr<v1::Job> cancelled = client->Cancel(id); !cancelled.ok()) return cancelled.status();
    job = client->Watch(id, update);
  }
  if (!job.ok()) {
    return absl::Status(job.status().code(),
                        absl::StrCat(job.status().message(), "; the job is ", id,
                                     ", see it with `weft job watch ", id, " --server ", server, "`"));
  }
  if (AbsolutePath(job->spec().out()) != absolute.out()) {
    WEFT_RETURN_IF_ERROR(FetchResults(*client, *job, absolute.out(), fetched, std::move(stop)));
  }
  return job;
}

}  // namespace weft

#include "services/work/slurm/slurm_options.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

// Options of sbatch that the executor sets itself, or that would keep it from hearing of its tasks.
constexpr const char* kOwnOptions[] = {"--array",      "--output",     "--error",  "--job-name",
                                       "--comment",    "--wrap",       "--wait",   "--parsable",
                                       "--requeue",    "--no-requeue", "--chdir",  "--hold",
                                       "--dependency", "--nodes",      "--ntasks", "--clusters"};

absl::Status CheckCount(const char* option, int64_t value, int64_t least, int64_t most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", value, ", must be ", least, " to ", most));
}

absl::Status CheckExtra(const std::string& option) {
  if (!absl::StartsWith(option, "--") || option.find('\n') != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("--slurm-option: \"", option, "\", must be an option of sbatch, like --constraint=ssd"));
  }
  const std::string name = option.substr(0, option.find('='));
  for (const char* own : kOwnOptions) {
    if (name == own)
      return absl::InvalidArgumentError(absl::StrCat("--slurm-option: ", name, " is set by weftd itself"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status SlurmOptions::Validate() const {
  if (folder.empty()) return absl::InvalidArgumentError("--slurm-folder: must not be empty");
  if (folder.front() != '/') {
    return absl::InvalidArgumentError(
        absl::StrCat("--slurm-folder: ", folder, ", must be an absolute path that the nodes see, too"));
  }
  absl::Status status = CheckCount("--slurm-tasks", tasks, 0, 100'000);
  status.Update(CheckCount("--slurm-frames-per-task", frames_per_task, 1, 100'000));
  status.Update(CheckCount("--slurm-cpus-per-task", cpus_per_task, 1, 1024));
  status.Update(CheckCount("--slurm-memory-mib", memory_mib, 0, int64_t{1} << 30));
  status.Update(CheckCount("--slurm-time-limit-min", time_limit_min, 0, 365 * 24 * 60));
  status.Update(CheckCount("--slurm-scratch-mib", scratch_mib, 1, int64_t{1} << 30));
  if (!scratch_folder.empty() && scratch_folder.front() != '/') {
    status.Update(absl::InvalidArgumentError(
        absl::StrCat("--slurm-scratch: ", scratch_folder, ", must be an absolute path on the nodes")));
  }
  if (!(lag_s >= 0) || lag_s > 3600)
    status.Update(absl::InvalidArgumentError(absl::StrCat("--slurm-lag-s: ", lag_s, ", must be 0 to 3600")));
  if (!(query_s >= 0.1) || query_s > 3600)
    status.Update(
        absl::InvalidArgumentError(absl::StrCat("--slurm-query-s: ", query_s, ", must be 0.1 to 3600")));
  if (worker_program.empty()) status.Update(absl::InvalidArgumentError("--slurm-worker: must not be empty"));
  for (const std::string& option : extra) status.Update(CheckExtra(option));
  status.Update(PathMap::Create(mapped_paths).status());
  return status;
}

absl::StatusOr<PathMap> PathMap::Create(const std::vector<std::string>& mapped_paths) {
  PathMap map;
  for (const std::string& text : mapped_paths) {
    std::pair<std::string, std::string> pair = absl::StrSplit(text, absl::MaxSplits('=', 1));
    for (std::string* path : {&pair.first, &pair.second}) {
      while (path->size() > 1 && path->back() == '/') path->pop_back();
    }
    if (!absl::StartsWith(pair.first, "/") || !absl::StartsWith(pair.second, "/")) {
      return absl::InvalidArgumentError(
          absl::StrCat("--slurm-map-path: \"", text, "\", must be HERE=THERE with two absolute paths"));
    }
    map.pairs_.push_back(std::move(pair));
  }
  return map;
}

std::string PathMap::OnNodes(const std::string& path) const {
  const std::pair<std::string, std::string>* longest = nullptr;
  for (const auto& pair : pairs_) {
    const bool lies_in = path == pair.first || absl::StartsWith(path, absl::StrCat(pair.first, "/"));
    if (lies_in && (longest == nullptr || longest->first.size() < pair.first.size())) longest = &pair;
  }
  return longest == nullptr ? path : longest->second + path.substr(longest->first.size());
}

absl::Status PathMap::Apply(v1::Task& task) const {
  v1::RegistrationSpec& spec = *task.mutable_spec();
  for (const std::string* path : {&spec.options().scans(), &spec.options().starts()}) {
    if (OnNodes(*path) == *path) continue;
    return absl::FailedPreconditionError(
        absl::StrCat(*path, ": nodes see it as ", OnNodes(*path),
                     ", and results remember the paths of scans and start meshes; give a folder that has one "
                     "path everywhere"));
  }
  for (const JobInput& input : InputsOf(spec)) {
    if (!input.path.empty()) SetInput(input, OnNodes(input.path), &spec);
  }
  for (std::string* path : {spec.mutable_out(), task.mutable_state_folder()}) *path = OnNodes(*path);
  for (std::string& path : *task.mutable_allowed_paths()) path = OnNodes(path);
  return absl::OkStatus();
}

}  // namespace weft

#include "services/work/slurm/task_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/work/worker/worker_event.h"

namespace weft {
namespace {

constexpr uint64_t kMaxSetupBytes = uint64_t{1} << 20;

}  // namespace

std::string ShellWord(std::string_view word) {
  return absl::StrCat("'", absl::StrReplaceAll(absl::string_view(word.data(), word.size()), {{"'", "'\\''"}}),
                      "'");
}

std::string ScriptText(const std::string& folder_on_nodes, const SlurmOptions& options,
                       const std::string& setup) {
  const std::string folder = ShellWord(folder_on_nodes);
  std::string text = "#!/bin/sh\n# Written by weftd. Runs one task of a job.\n";
  if (!setup.empty()) absl::StrAppend(&text, setup, setup.back() == '\n' ? "" : "\n");
  absl::StrAppend(&text, "exec ", ShellWord(options.worker_program), " ", folder,
                  "/task-\"$SLURM_ARRAY_TASK_ID\".json --events ", folder,
                  "/events-\"$SLURM_ARRAY_TASK_ID\" --patience-s ", static_cast<int>(options.lag_s) + 1);
  if (options.memory_mib > 0) absl::StrAppend(&text, " --memory-mib ", options.memory_mib);
  return text + "\n";
}

std::string TaskFolder::TaskFile(int index) const { return absl::StrCat(folder_, "/task-", index, ".json"); }
std::string TaskFolder::EventFile(int index) const { return absl::StrCat(folder_, "/events-", index); }
std::string TaskFolder::LogFile(int index) const { return absl::StrCat(folder_, "/log-", index); }
std::string TaskFolder::Script() const { return absl::StrCat(folder_, "/run.sh"); }
std::string TaskFolder::ArrayFile() const { return absl::StrCat(folder_, "/array.json"); }

absl::Status TaskFolder::Write(const std::vector<const v1::Task*>& tasks, const SlurmOptions& options,
                               const PathMap& map) const {
  std::string setup;
  if (!options.setup_file.empty()) {
    WEFT_ASSIGN_OR_RETURN(setup, ReadWholeFile(options.setup_file, kMaxSetupBytes));
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(folder_));
  for (size_t i = 0; i < tasks.size(); ++i) {
    v1::Task task = *tasks[i];
    task.mutable_allowed_paths()->Assign(options.allowed_paths.begin(), options.allowed_paths.end());
    task.set_state_folder(options.state_folder);
    task.set_scratch_folder(options.scratch_folder);
    task.set_scratch_mib(options.scratch_folder.empty() ? 0 : options.scratch_mib);
    WEFT_RETURN_IF_ERROR(map.Apply(task));
    WEFT_RETURN_IF_ERROR(WriteJsonFile(TaskFile(static_cast<int>(i)), task));
  }
  return WriteFileAtomically(Script(), ScriptText(map.OnNodes(folder_), options, setup));
}

absl::Status TaskFolder::CheckRoom() const {
  constexpr size_t kBytes = 16384;
  const std::string probe = absl::StrCat(folder_, "/room");
  const absl::Status status = WriteFileAtomically(probe, std::string(kBytes, 'w'));
  RemoveFile(probe);
  return absl::IsResourceExhausted(status) ? status : absl::OkStatus();
}

std::string TaskFolder::LastWords(int index) const {
  constexpr size_t kShown = 600;
  constexpr uint64_t kMost = uint64_t{64} << 20;
  const absl::StatusOr<std::string> text = ReadWholeFile(LogFile(index), kMost);
  if (!text.ok()) return "";
  const std::string end = text->substr(text->size() - std::min(text->size(), kShown));
  return absl::StrJoin(absl::StrSplit(end, '\n', absl::SkipWhitespace()), " | ");
}

void TaskFolder::Remove(int index) const {
  RemoveFile(TaskFile(index));
  RemoveFile(EventFile(index));
  if (FileBytes(LogFile(index)) == 0) RemoveFile(LogFile(index));
}

std::vector<std::pair<int, v1::Task>> TaskFolder::TasksLeft(int tasks) const {
  std::vector<std::pair<int, v1::Task>> left;
  for (int i = 0; i < tasks; ++i) {
    v1::Task task;
    if (ReadJsonFile(TaskFile(i), task).ok()) left.emplace_back(i, std::move(task));
  }
  return left;
}

void TaskFolder::RemoveIfEmpty() const {
  RemoveFile(Script());
  RemoveFile(ArrayFile());
  RemoveFile(folder_);  // fails where logs are left
}

std::vector<v1::WorkerEvent> EventReader::Read() {
  // Opened anew: a network file system then asks its server for the size.
  const UniqueFd fd(open(file_.c_str(), O_RDONLY | O_CLOEXEC));
  std::vector<v1::WorkerEvent> events;
  if (!fd.open()) return events;
  exists_ = true;
  char bytes[65536];
  for (;;) {
    const ssize_t count = pread(fd.get(), bytes, sizeof(bytes), offset_);
    if (count <= 0) break;
    offset_ += count;
    rest_.append(bytes, static_cast<size_t>(count));
  }
  size_t begin = 0;
  for (size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n', begin)) {
    // Other lines are no events, such as what a crashed node left.
    if (absl::StatusOr<v1::WorkerEvent> event =
            ParseWorkerEvent(std::string_view(rest_).substr(begin, end - begin));
        event.ok()) {
      events.push_back(*std::move(event));
    }
    begin = end + 1;
  }
  rest_.erase(0, begin);
  return events;
}

}  // namespace weft

// The files of one job array: tasks, script, events and logs, in a folder that the nodes see.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "services/work/slurm/slurm_options.h"
#include "weft/v1/task.pb.h"

namespace weft {

// <folder>/task-<i>.json, events-<i>, log-<i>, run.sh and array.json.
class TaskFolder {
 public:
  explicit TaskFolder(std::string folder) : folder_(std::move(folder)) {}

  const std::string& path() const { return folder_; }
  std::string TaskFile(int index) const;
  std::string EventFile(int index) const;
  std::string LogFile(int index) const;
  std::string Script() const;
  std::string ArrayFile() const;

  // Makes the folder with the files of these tasks and the script. ResourceExhausted: the disk is full;
  // otherwise errors of WriteFileAtomically, and those of PathMap::Apply.
  absl::Status Write(const std::vector<const v1::Task*>& tasks, const SlurmOptions& options,
                     const PathMap& map) const;
  // ResourceExhausted: it has no room for a file of a few kB, which it keeps no longer.
  absl::Status CheckRoom() const;
  // The last lines of a log, as one line; empty: nothing was printed.
  std::string LastWords(int index) const;
  // Removes what a task that has ended needs no more; a log in which something stands is kept.
  void Remove(int index) const;
  // Those of Write that were not removed, with their indexes.
  std::vector<std::pair<int, v1::Task>> TasksLeft(int tasks) const;
  // Removes the script and array.json, and the folder where no log is left.
  void RemoveIfEmpty() const;

 private:
  std::string folder_;
};

// The script of an array; `setup` are lines of shell that run before the worker.
std::string ScriptText(const std::string& folder_on_nodes, const SlurmOptions& options,
                       const std::string& setup);

// Quoted for a shell.
std::string ShellWord(std::string_view word);

// Reads the events that a worker appends to a file, as far as they are there.
class EventReader {
 public:
  explicit EventReader(std::string file) : file_(std::move(file)) {}

  // Those that were written since the last call; a line without its end waits.
  std::vector<v1::WorkerEvent> Read();
  bool exists() const { return exists_; }

 private:
  std::string file_;
  std::string rest_;
  int64_t offset_ = 0;
  bool exists_ = false;
};

}  // namespace weft

// The operations of a daemon: commands of `weft` that it runs for clients.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/confinement/input_links.h"
#include "services/daemon/file_stream.h"
#include "services/daemon/operation_command.h"
#include "services/retention/retention_plan.h"
#include "weft/v1/operations.pb.h"

namespace weft {

struct OperationQueueOptions {
  std::string folder;   // a folder per operation
  std::string program;  // weft
  ResolveInput resolve;
  LinkRules links;  // of inputs
  // Besides its inputs, what a command reads that takes paths from files (`weft evaluate`).
  std::function<std::vector<std::string>()> readable_besides;
  std::string process_folder;  // of records of the commands that run (process_record.h)
  // Takes in a take that an operation made, under the operation's id, and moves its folder away. Once it is
  // there, a second call changes nothing.
  std::function<absl::Status(const std::string& take_folder, const std::string& id)> adopt_take;
  // Asked before new work is taken; its errors refuse it.
  std::function<absl::Status()> admit = [] { return absl::OkStatus(); };
};

// Neither queued nor running.
bool HasEnded(const v1::Operation& operation);

// One at a time, by age. A folder per operation has its state and what it writes; each state that was
// answered is on the disk. One that a daemon left unfinished begins anew. A process that crashes is started
// twice. Thread safety: any thread may call any function.
class OperationQueue {
 public:
  // NotFound: the program. Errors of CreateFolders.
  static absl::StatusOr<std::unique_ptr<OperationQueue>> Create(OperationQueueOptions options);
  ~OperationQueue();

  // Errors of CheckOperationSpec and of `resolve`. AlreadyExists: the key stands for another request.
  // ResourceExhausted: too many wait.
  absl::StatusOr<v1::Operation> Start(const v1::StartOperationRequest& request);
  // NotFound.
  absl::StatusOr<v1::Operation> Get(const std::string& id);
  v1::ListOperationsResponse List(size_t limit);
  // Returns at once; its process is stopped.
  absl::StatusOr<v1::Operation> Cancel(const std::string& id);
  // What it wrote, by path. FailedPrecondition: it is not done.
  absl::StatusOr<v1::ListOperationFilesResponse> Files(const std::string& id);
  // Opens one of them. NotFound. FailedPrecondition: it is not done. Otherwise errors of FilePieces::Open.
  absl::StatusOr<FilePieces> OpenFile(const std::string& id, const std::string& path,
                                      const StreamStart& start);
  // Whether an unfinished one has this input, or one below it.
  bool Reads(const std::string& path);

  // The ended ones.
  std::vector<Holding> EndedHoldings();
  // Forgets one that ended at this time, with its files. FailedPrecondition: there is no such one.
  absl::Status ForgetEnded(const std::string& id, int64_t finished_unix_ns);

  // Stops the process of the one that runs; it begins anew with the next daemon.
  void Stop();

 private:
  struct Entry {
    v1::Operation operation;
    std::vector<std::string> inputs;  // resolved
    bool cancelled = false;
  };
  struct Outcome;
  absl::StatusOr<v1::Operation> GetDone(const std::string& id);
  using Lock = std::unique_lock<std::mutex>;

  explicit OperationQueue(OperationQueueOptions options) : options_(std::move(options)) {}
  void Load();
  std::string FolderOf(const std::string& id) const { return options_.folder + "/" + id; }
  std::string OutOf(const std::string& id) const { return FolderOf(id) + "/out"; }
  absl::Status Write(const v1::Operation& operation) const;
  void Work(const std::stop_token& stop);
  // Without the lock: the process, until it has ended.
  Outcome Run(const v1::Operation& operation, const std::stop_token& stop);
  // What its process may read.
  std::vector<std::string> ReadableOf(const v1::OperationSpec& spec,
                                      const std::vector<std::string>& inputs) const;
  void NoteProgress(const std::string& id, const std::string& step, double share);

  // The functions below need the lock.
  Entry* Next();
  void Conclude(Entry& entry, const Outcome& outcome);
  void WriteUntilItSucceeds(Lock& lock, const std::string& id, const std::stop_token& stop);
  bool IsCancelled(const std::string& id);

  const OperationQueueOptions options_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Entry> entries_;  // by id; ids begin with their time
  std::vector<std::string> warnings_;
  std::jthread worker_;
};

}  // namespace weft

// The operations of a daemon: commands of `weft` that it runs for clients.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/ground/confinement/input_links.h"
#include "services/server/callers/caller.h"
#include "services/server/callers/turns.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/work/operation_command.h"
#include "services/server/retention/retention_plan.h"
#include "weft/v1/operations.pb.h"

namespace weft {

class ChildProcess;

struct OperationQueueOptions {
  std::string folder;      // a folder per operation
  std::string program;     // weft
  int64_t memory_mib = 0;  // that a command may take; 0: any
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
  // Whether a take has this id, which no further one may get.
  std::function<bool(const std::string& id)> take_exists = [](const std::string&) { return false; };
};

// Neither queued nor running.
bool HasEnded(const v1::Operation& operation);

// One at a time: callers take turns (turns.h) with their oldest. A folder per operation has its state and
// what it writes; each state that was answered is on the disk. One that a daemon left unfinished begins anew.
// A process that crashes is started twice. Thread safety: any thread may call any function.
class OperationQueue {
 public:
  // NotFound: the program. Errors of CreateFolders.
  static absl::StatusOr<std::unique_ptr<OperationQueue>> Create(OperationQueueOptions options);
  ~OperationQueue();

  // Errors of CheckOperationSpec and of `resolve`. AlreadyExists: the key stands for another request, or for
  // one of somebody else. ResourceExhausted: too many wait.
  absl::StatusOr<v1::Operation> Start(const v1::StartOperationRequest& request, const Caller& caller);
  // NotFound.
  absl::StatusOr<v1::Operation> Get(const std::string& id);
  // Newest first, without inputs, options and output. InvalidArgument: the page token.
  absl::StatusOr<v1::ListOperationsResponse> List(size_t limit, const std::string& page_token = "");
  // Returns at once; its process is stopped. PermissionDenied: it is somebody else's.
  absl::StatusOr<v1::Operation> Cancel(const std::string& id, const Caller& caller);
  // Removes it with its files. PermissionDenied; FailedPrecondition: it has not ended.
  absl::StatusOr<v1::Operation> Delete(const std::string& id, const Caller& caller);
  // What it wrote, by path. FailedPrecondition: it is not done.
  absl::StatusOr<v1::ListOperationFilesResponse> Files(const v1::ListOperationFilesRequest& request);
  // Opens one of them; the others are not looked at. NotFound. FailedPrecondition: it is not done. Otherwise
  // errors of FilePieces::Open.
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
    v1::Operation operation;          // of one that has ended, without what only its file has
    std::vector<std::string> inputs;  // resolved
    bool cancelled = false;
  };
  struct Outcome;
  using Lock = MutexLock<Mutex>;

  explicit OperationQueue(OperationQueueOptions options) : options_(std::move(options)) {}
  void Load();
  std::string FolderOf(const std::string& id) const { return options_.folder + "/" + id; }
  std::string FileOf(const std::string& id) const { return FolderOf(id) + "/operation.json"; }
  std::string OutOf(const std::string& id) const { return FolderOf(id) + "/out"; }
  absl::Status Write(const v1::Operation& operation) const;
  absl::StatusOr<v1::Operation> Read(const std::string& id) const;
  // Removes the files of one that was forgotten.
  absl::Status RemoveFiles(const std::string& id) const;
  absl::Status CheckDone(const std::string& id);
  void Work(const std::stop_token& stop);
  // Without the lock: the process, until it has ended.
  Outcome Run(const v1::Operation& operation, const std::stop_token& stop);
  // Where there is none, the outcome says why.
  absl::StatusOr<ChildProcess> StartProcess(const v1::Operation& operation, Outcome& outcome);
  // Takes down what it prints until it has ended. Returns its status, as of waitpid.
  int AwaitProcess(const std::string& id, ChildProcess& child, const std::stop_token& stop, Outcome& outcome);
  void NoteProgress(const std::string& id, const std::string& step, double share);

  bool IsCancelled(const std::string& id);

  // NotFound.
  absl::StatusOr<Entry*> Find(const std::string& id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // PermissionDenied: it is somebody else's.
  absl::StatusOr<Entry*> FindOwn(const std::string& id, const Caller& caller)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // From now on nobody knows it; its folder is nobody's, and the next daemon removes what is left of it.
  absl::Status Forget(const std::string& id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckRoom(const v1::OperationSpec& spec, const Caller& caller) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static void Shorten(Entry& entry);  // of one that has ended, and is on the disk
  Entry* Next() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Conclude(Entry& entry, const Outcome& outcome) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void WriteUntilItSucceeds(Lock& lock, const std::string& id, const std::stop_token& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const OperationQueueOptions options_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);  // by id
  Turns turns_ ABSL_GUARDED_BY(mutex_);                           // of those that wait
  std::vector<std::string> warnings_ ABSL_GUARDED_BY(mutex_);
  std::jthread worker_;
};

}  // namespace weft

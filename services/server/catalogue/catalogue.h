// What the daemon remembers: jobs and the state of each of their frames, in one SQLite file, and a record of
// each job beside it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/formats/files/holder_record.h"
#include "services/server/catalogue/folder_sync.h"
#include "services/server/catalogue/job_records.h"
#include "services/server/catalogue/restore.h"
#include "services/server/catalogue/sqlite.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Every call is one transaction that is on the disk when it returns, so the content survives a killed process
// and a power cut. A call that returns an error has changed nothing, and may be made again. Errors name the
// file. Thread safety: any thread may call any function.
class Catalogue {
 public:
  // Makes the file where it is missing, and restores it where it is damaged (restore.h). FailedPrecondition:
  // written by a newer Weft, or in use by another weftd. Otherwise errors of the disk. `on_lost` is called in
  // a thread where this process stood still so long that another one took the catalogue (HolderRecord):
  // whatever is written then is written beside that one.
  static absl::StatusOr<std::unique_ptr<Catalogue>> Open(const std::string& path,
                                                         std::function<void()> on_lost = {});
  // What a user must know of its restoration. Empty: it was sound.
  const std::vector<std::string>& warnings() const { return restored_.warnings; }

  // With its record. AlreadyExists: a job of this id.
  absl::Status AddJob(const v1::Job& job, const std::vector<v1::FrameInfo>& frames);
  // The job and some of its frames, by their position; further ones are added. NotFound: no such job.
  absl::Status Update(const v1::Job& job, const std::map<size_t, v1::FrameInfo>& frames);
  // The job and all its frames at once, and its record: where it ended, and where it runs again. It is added
  // where it is missing.
  absl::Status UpdateAll(const v1::Job& job, const std::vector<v1::FrameInfo>& frames);

  // In its record, for one that has not ended; the row follows by Update. Nothing to do where it has no
  // record.
  absl::Status KeepPriority(const std::string& id, int priority);

  // A row that was damaged while the catalogue was in use is read as an entry that says so, and hides no
  // other. NotFound: no such job.
  absl::StatusOr<v1::Job> ReadJob(const std::string& id);
  // In the order of AddJob.
  absl::StatusOr<std::vector<v1::FrameInfo>> ReadFrames(const std::string& job_id);
  // Newest first; those before the job `older_than`, if it is not empty. NotFound: it is not there any more.
  absl::StatusOr<std::vector<v1::Job>> ListJobs(int limit, const std::string& older_than = "");
  // Those that are neither queued nor running, oldest first, without the first `skip`.
  absl::StatusOr<std::vector<v1::Job>> EndedJobs(int64_t skip, int limit);
  // With its frames and its record. NotFound: no such job.
  absl::Status RemoveJob(const std::string& id);
  // Queued and running ones, oldest first.
  absl::StatusOr<std::vector<v1::Job>> UnfinishedJobs();

 private:
  Catalogue(FileLock lock, std::optional<HolderRecord> holder, JobRecords records, RestoredCatalogue restored)
      : lock_(std::move(lock)),
        holder_(std::move(holder)),
        records_(std::move(records)),
        restored_(std::move(restored)),
        database_(restored_.database.get()) {}
  // Those for which an expression of SQL holds, whose ?1 is the parameter.
  absl::StatusOr<std::vector<v1::Job>> Select(const std::string& which, const std::string& parameter = "");

  FileLock lock_;
  std::optional<HolderRecord> holder_;  // none: a full disk has no room for it
  const JobRecords records_;
  RestoredCatalogue restored_;
  RecursiveMutex mutex_;
  Database* const database_ ABSL_PT_GUARDED_BY(mutex_);
};

}  // namespace weft

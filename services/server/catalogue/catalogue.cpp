#include "services/server/catalogue/catalogue.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "services/server/catalogue/restore.h"

namespace weft {
namespace {

constexpr char kRemedy[] =
    "; start weftd again: it restores the entry from its record. The results are untouched";

v1::Job JobOf(const JobRow& row) {
  absl::StatusOr<v1::Job> job = ReadRow(row);
  if (job.ok()) return *std::move(job);
  v1::Job damaged;
  damaged.set_id(EscapedText(row.id));
  v1::JobState state = v1::JOB_STATE_UNSPECIFIED;
  v1::JobState_Parse(row.state, &state);
  damaged.set_state(state);
  damaged.set_message(absl::StrCat(absl::string_view(job.status().message()), kRemedy));
  return damaged;
}

v1::FrameInfo FrameOf(const FrameRow& row) {
  absl::StatusOr<v1::FrameInfo> info = ReadRow(row);
  if (info.ok()) return *std::move(info);
  v1::FrameInfo damaged;
  damaged.set_frame(EscapedText(row.name));
  v1::FrameState state = v1::FRAME_STATE_UNSPECIFIED;
  v1::FrameState_Parse(row.state, &state);
  damaged.set_state(state);
  damaged.set_reason(absl::StrCat(absl::string_view(info.status().message()), kRemedy));
  return damaged;
}

constexpr char kUnfinished[] = "state IN ('JOB_STATE_QUEUED', 'JOB_STATE_RUNNING')";

absl::Status NoSuchJob(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("no job \"", id, "\"; `weft job list` shows the jobs"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Catalogue>> Catalogue::Open(const std::string& path,
                                                           std::function<void()> on_lost) {
  WEFT_ASSIGN_OR_RETURN(FileLock lock, FileLock::Take(path));
  absl::StatusOr<HolderRecord> record = HolderRecord::Take(path + ".holder", "weftd", std::move(on_lost));
  if (absl::IsFailedPrecondition(record.status())) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": in use by another weftd; ",
                                                      std::string(record.status().message()),
                                                      ", or give another --state folder"));
  }
  // One of the two must keep others out.
  if (!record.ok() && !lock.is_effective()) return record.status();
  std::optional<HolderRecord> holder;
  if (record.ok()) holder.emplace(*std::move(record));
  JobRecords records(path);
  WEFT_ASSIGN_OR_RETURN(RestoredCatalogue restored, OpenRestored(path, records));
  // A log whose flush once failed may be in memory alone; so all of it goes into the file, and the log begins
  // anew. A full disk stops no start: the log stays then.
  const absl::Status emptied = restored.database->Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  if (!emptied.ok() && !absl::IsResourceExhausted(emptied)) return emptied;
  return std::unique_ptr<Catalogue>(
      new Catalogue(std::move(lock), std::move(holder), std::move(records), std::move(restored)));
}

absl::Status Catalogue::AddJob(const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
  const MutexLock lock(mutex_);
  const absl::StatusOr<v1::Job> existing = ReadJob(job.id());
  if (existing.ok()) return absl::AlreadyExistsError(absl::StrCat("a job \"", job.id(), "\" exists already"));
  if (!absl::IsNotFound(existing.status())) return existing.status();
  return UpdateAll(job, frames);
}

// Record first: what has one is never lost, and one that says more than its row is no damage. The flush of
// the row is enough, but where a job runs again: after a power cut its old record would tell of a later
// state.
absl::Status Catalogue::UpdateAll(const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
  const MutexLock lock(mutex_);
  const v1::JobUpdate whole = RecordOf(job, frames);
  const absl::StatusOr<v1::JobUpdate> before = records_.Read(job.id());
  const bool runs_again = before.ok() && EndOf(job) == 0;
  WEFT_RETURN_IF_ERROR(records_.Write(whole, runs_again ? Flush::kToDisk : Flush::kLater));
  const absl::Status written = [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) -> absl::Status {
    Transaction transaction(*database_);
    WEFT_RETURN_IF_ERROR(transaction.Begin());
    WEFT_RETURN_IF_ERROR(PutRows(*database_, whole));
    return transaction.Commit();
  }();
  if (!written.ok()) (before.ok() ? records_.Write(*before) : records_.Remove(job.id())).IgnoreError();
  return written;
}

absl::Status Catalogue::Update(const v1::Job& job, const std::map<size_t, v1::FrameInfo>& frames) {
  const MutexLock lock(mutex_);
  Transaction transaction(*database_);
  WEFT_RETURN_IF_ERROR(transaction.Begin());
  WEFT_ASSIGN_OR_RETURN(
      Statement update,
      database_->Prepare("UPDATE jobs SET state = ?2, message = ?3, job = ?4, checksum = ?5 WHERE id = ?1"));
  const JobRow row = MakeRow(job);
  update.BindText(1, row.id).BindText(2, row.state).BindText(3, row.message).BindBytes(4, row.job);
  WEFT_RETURN_IF_ERROR(update.Bind(5, row.checksum).Run());
  if (database_->ChangedRows() == 0) return NoSuchJob(job.id());
  WEFT_ASSIGN_OR_RETURN(Statement replace, database_->Prepare(kReplaceFrame));
  for (const auto& [position, info] : frames) {
    WEFT_RETURN_IF_ERROR(ReplaceRow(replace, MakeRow(job.id(), static_cast<int64_t>(position), info)));
  }
  return transaction.Commit();
}

absl::Status Catalogue::KeepPriority(const std::string& id, int priority) {
  const MutexLock lock(mutex_);
  absl::StatusOr<v1::JobUpdate> record = records_.Read(id);
  if (absl::IsNotFound(record.status())) return absl::OkStatus();
  WEFT_RETURN_IF_ERROR(record.status());
  record->mutable_job()->set_priority(priority);
  return records_.Write(*std::move(record));
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::Select(const std::string& which,
                                                       const std::string& parameter) {
  const MutexLock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(Statement select, database_->Prepare(absl::StrCat("SELECT ", JobColumns(),
                                                                          " FROM jobs WHERE ", which)));
  if (!parameter.empty()) select.BindText(1, parameter);
  std::vector<v1::Job> jobs;
  for (;;) {
    WEFT_ASSIGN_OR_RETURN(const bool row, select.Step());
    if (!row) return jobs;
    jobs.push_back(JobOf(JobRowOf(select)));
  }
}

absl::StatusOr<v1::Job> Catalogue::ReadJob(const std::string& id) {
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::Job> jobs, Select("id = ?1", id));
  if (jobs.empty()) return NoSuchJob(id);
  return std::move(jobs.front());
}

absl::StatusOr<std::vector<v1::FrameInfo>> Catalogue::ReadFrames(const std::string& job_id) {
  const MutexLock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(Statement select,
                        database_->Prepare(absl::StrCat("SELECT ", FrameColumns(),
                                                        " FROM frames WHERE job_id = ? ORDER BY position")));
  select.BindText(1, job_id);
  std::vector<v1::FrameInfo> frames;
  for (;;) {
    WEFT_ASSIGN_OR_RETURN(const bool row, select.Step());
    if (!row) return frames;
    frames.push_back(FrameOf(FrameRowOf(select)));
  }
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::ListJobs(int limit, const std::string& older_than) {
  const MutexLock lock(mutex_);
  if (older_than.empty()) return Select(absl::StrCat("true ORDER BY sequence DESC LIMIT ", limit));
  WEFT_RETURN_IF_ERROR(ReadJob(older_than).status());
  return Select(
      absl::StrCat("sequence < (SELECT sequence FROM jobs WHERE id = ?1) ORDER BY sequence DESC LIMIT ",
                   limit),
      older_than);
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::EndedJobs(int64_t skip, int limit) {
  return Select(absl::StrCat("NOT ", kUnfinished, " ORDER BY sequence LIMIT ", limit, " OFFSET ", skip));
}

absl::Status Catalogue::RemoveJob(const std::string& id) {
  const MutexLock lock(mutex_);
  WEFT_RETURN_IF_ERROR(records_.Remove(id));
  Transaction transaction(*database_);
  WEFT_RETURN_IF_ERROR(transaction.Begin());
  for (const char* sql : {"DELETE FROM frames WHERE job_id = ?", "DELETE FROM jobs WHERE id = ?"}) {
    WEFT_ASSIGN_OR_RETURN(Statement remove, database_->Prepare(sql));
    WEFT_RETURN_IF_ERROR(remove.BindText(1, id).Run());
  }
  if (database_->ChangedRows() == 0) return NoSuchJob(id);
  return transaction.Commit();
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::UnfinishedJobs() {
  return Select(absl::StrCat(kUnfinished, " ORDER BY sequence"));
}

}  // namespace weft

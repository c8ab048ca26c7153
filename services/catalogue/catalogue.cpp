#include "services/catalogue/catalogue.h"

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr int64_t kSchemaVersion = 1;

// States also stand in columns of their own, as the names of the proto, for people who look with sqlite3.
constexpr char kSchema[] = R"sql(
CREATE TABLE jobs (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  state TEXT NOT NULL,
  message TEXT NOT NULL,
  job BLOB NOT NULL
);
CREATE INDEX jobs_by_state ON jobs (state);
CREATE TABLE frames (
  job_id TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  state TEXT NOT NULL,
  attempts INTEGER NOT NULL,
  info BLOB NOT NULL,
  PRIMARY KEY (job_id, position)
) WITHOUT ROWID;
)sql";

template <typename Message>
absl::StatusOr<Message> Parse(const Database& database, const std::string& bytes) {
  Message message;
  if (!message.ParseFromString(bytes)) {
    return absl::DataLossError(
        absl::StrCat(database.path(), ": a ", message.GetDescriptor()->name(),
                     " in it is damaged; move the file away to begin with an empty one"));
  }
  return message;
}

template <typename Message>
absl::StatusOr<std::vector<Message>> ReadAll(const Database& database, Statement& statement) {
  std::vector<Message> messages;
  for (;;) {
    const absl::StatusOr<bool> row = statement.Step();
    if (!row.ok()) return row.status();
    if (!*row) return messages;
    absl::StatusOr<Message> message = Parse<Message>(database, statement.Bytes(0));
    if (!message.ok()) return message.status();
    messages.push_back(*std::move(message));
  }
}

absl::Status NoSuchJob(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("no job \"", id, "\"; `weft job list` shows the jobs"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Catalogue>> Catalogue::Open(const std::string& path) {
  absl::StatusOr<std::unique_ptr<Database>> database = Database::Open(path);
  if (!database.ok()) return database.status();
  std::unique_ptr<Catalogue> catalogue(new Catalogue(*std::move(database)));
  if (absl::Status status = catalogue->MakeSchema(); !status.ok()) return status;
  return catalogue;
}

absl::Status Catalogue::MakeSchema() {
  const absl::StatusOr<int64_t> version = database_->ReadPragma("user_version");
  if (!version.ok()) return version.status();
  if (*version == kSchemaVersion) return absl::OkStatus();
  if (*version > kSchemaVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat(database_->path(), ": written by a newer Weft (schema ", *version, ", this one knows ",
                     kSchemaVersion, "); install that version, or give another --state folder"));
  }
  Transaction transaction(*database_);
  if (absl::Status status = transaction.Begin(); !status.ok()) return status;
  if (absl::Status status = database_->Execute(kSchema); !status.ok()) return status;
  if (absl::Status status = database_->Execute(absl::StrCat("PRAGMA user_version = ", kSchemaVersion));
      !status.ok()) {
    return status;
  }
  return transaction.Commit();
}

absl::Status Catalogue::AddJob(const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
  const absl::StatusOr<v1::Job> existing = ReadJob(job.id());
  if (existing.ok()) return absl::AlreadyExistsError(absl::StrCat("a job \"", job.id(), "\" exists already"));
  if (!absl::IsNotFound(existing.status())) return existing.status();
  Transaction transaction(*database_);
  if (absl::Status status = transaction.Begin(); !status.ok()) return status;
  absl::StatusOr<Statement> insert =
      database_->Prepare("INSERT INTO jobs (id, state, message, job) VALUES (?, ?, ?, ?)");
  if (!insert.ok()) return insert.status();
  insert->BindText(1, job.id()).BindText(2, v1::JobState_Name(job.state())).BindText(3, job.message());
  if (absl::Status status = insert->BindBytes(4, job.SerializeAsString()).Run(); !status.ok()) return status;
  if (absl::Status status = WriteFrames(job.id(), frames); !status.ok()) return status;
  return transaction.Commit();
}

absl::Status Catalogue::WriteFrames(const std::string& job_id, const std::vector<v1::FrameInfo>& frames) {
  absl::StatusOr<Statement> insert = database_->Prepare(
      "INSERT OR REPLACE INTO frames (job_id, position, name, state, attempts, info) "
      "VALUES (?, ?, ?, ?, ?, ?)");
  if (!insert.ok()) return insert.status();
  for (size_t i = 0; i < frames.size(); ++i) {
    insert->BindText(1, job_id).Bind(2, static_cast<int64_t>(i)).BindText(3, frames[i].frame());
    insert->BindText(4, v1::FrameState_Name(frames[i].state()));
    insert->Bind(5, static_cast<int64_t>(frames[i].attempts())).BindBytes(6, frames[i].SerializeAsString());
    if (absl::Status status = insert->Run(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Catalogue::WriteJob(const v1::Job& job) {
  absl::StatusOr<Statement> update =
      database_->Prepare("UPDATE jobs SET state = ?2, message = ?3, job = ?4 WHERE id = ?1");
  if (!update.ok()) return update.status();
  update->BindText(1, job.id()).BindText(2, v1::JobState_Name(job.state())).BindText(3, job.message());
  if (absl::Status status = update->BindBytes(4, job.SerializeAsString()).Run(); !status.ok()) return status;
  return database_->ChangedRows() > 0 ? absl::OkStatus() : NoSuchJob(job.id());
}

absl::Status Catalogue::UpdateJob(const v1::Job& job) { return WriteJob(job); }

absl::Status Catalogue::UpdateFrame(const std::string& job_id, size_t position, const v1::FrameInfo& info) {
  absl::StatusOr<Statement> update = database_->Prepare(
      "UPDATE frames SET state = ?3, attempts = ?4, info = ?5 WHERE job_id = ?1 AND position = ?2");
  if (!update.ok()) return update.status();
  update->BindText(1, job_id).Bind(2, static_cast<int64_t>(position));
  update->BindText(3, v1::FrameState_Name(info.state())).Bind(4, static_cast<int64_t>(info.attempts()));
  if (absl::Status status = update->BindBytes(5, info.SerializeAsString()).Run(); !status.ok()) return status;
  if (database_->ChangedRows() > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("no frame ", position, " in job \"", job_id, "\""));
}

absl::Status Catalogue::UpdateAll(const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
  Transaction transaction(*database_);
  if (absl::Status status = transaction.Begin(); !status.ok()) return status;
  if (absl::Status status = WriteJob(job); !status.ok()) return status;
  if (absl::Status status = WriteFrames(job.id(), frames); !status.ok()) return status;
  return transaction.Commit();
}

absl::StatusOr<v1::Job> Catalogue::ReadJob(const std::string& id) {
  absl::StatusOr<Statement> select = database_->Prepare("SELECT job FROM jobs WHERE id = ?");
  if (!select.ok()) return select.status();
  const absl::StatusOr<bool> row = select->BindText(1, id).Step();
  if (!row.ok()) return row.status();
  if (!*row) return NoSuchJob(id);
  return Parse<v1::Job>(*database_, select->Bytes(0));
}

absl::StatusOr<std::vector<v1::FrameInfo>> Catalogue::ReadFrames(const std::string& job_id) {
  absl::StatusOr<Statement> select =
      database_->Prepare("SELECT info FROM frames WHERE job_id = ? ORDER BY position");
  if (!select.ok()) return select.status();
  select->BindText(1, job_id);
  return ReadAll<v1::FrameInfo>(*database_, *select);
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::ListJobs(int limit) {
  absl::StatusOr<Statement> select =
      database_->Prepare("SELECT job FROM jobs ORDER BY sequence DESC LIMIT ?");
  if (!select.ok()) return select.status();
  select->Bind(1, static_cast<int64_t>(limit));
  return ReadAll<v1::Job>(*database_, *select);
}

absl::StatusOr<std::vector<v1::Job>> Catalogue::UnfinishedJobs() {
  absl::StatusOr<Statement> select =
      database_->Prepare("SELECT job FROM jobs WHERE state IN (?, ?) ORDER BY sequence");
  if (!select.ok()) return select.status();
  select->BindText(1, v1::JobState_Name(v1::JOB_STATE_QUEUED));
  select->BindText(2, v1::JobState_Name(v1::JOB_STATE_RUNNING));
  return ReadAll<v1::Job>(*database_, *select);
}

}  // namespace weft

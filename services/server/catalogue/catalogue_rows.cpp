#include "services/server/catalogue/catalogue_rows.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "capture/file/plain_text.h"
#include "services/server/catalogue/message_text.h"

namespace weft {
namespace {

constexpr char kTables[] = R"sql(
CREATE TABLE jobs (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  state TEXT NOT NULL,
  message TEXT NOT NULL,
  job BLOB NOT NULL,
  checksum INTEGER NOT NULL
);
CREATE INDEX jobs_by_state ON jobs (state);
CREATE TABLE frames (
  job_id TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  state TEXT NOT NULL,
  attempts INTEGER NOT NULL,
  info BLOB NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (job_id, position)
) WITHOUT ROWID;
)sql";

// Length and bytes of each part, so that nothing can move from one to the next.
int64_t ChecksumOf(std::initializer_list<absl::string_view> parts) {
  std::string all;
  for (const absl::string_view part : parts) absl::StrAppend(&all, part.size(), ":", part);
  return static_cast<int64_t>(Checksum(all.data(), all.size()));
}

int64_t ChecksumOf(const JobRow& row) { return ChecksumOf({row.id, row.state, row.message, row.job}); }

int64_t ChecksumOf(const FrameRow& row) {
  return ChecksumOf(
      {row.job_id, absl::StrCat(row.position), row.name, row.state, absl::StrCat(row.attempts), row.info});
}

absl::Status Damaged(const std::string& what) {
  return absl::DataLossError(absl::StrCat("the catalogue's entry of ", what, " is damaged"));
}

template <typename Message>
absl::StatusOr<Message> Parse(const std::string& bytes, const std::string& what) {
  Message message;
  if (ParseWithEscapes(bytes, message)) return message;
  return Damaged(what);
}

}  // namespace

absl::Status MakeTables(Database& database) {
  return database.Execute(absl::StrCat(kTables, "PRAGMA user_version = ", kSchemaVersion));
}

JobRow MakeRow(const v1::Job& job) {
  v1::Job escaped = job;
  EscapeTexts(escaped);
  JobRow row{0, escaped.id(), v1::JobState_Name(escaped.state()), escaped.message(),
             escaped.SerializeAsString()};
  row.checksum = ChecksumOf(row);
  return row;
}

FrameRow MakeRow(const std::string& job_id, int64_t position, const v1::FrameInfo& info) {
  v1::FrameInfo escaped = info;
  EscapeTexts(escaped);
  FrameRow row{job_id,
               position,
               escaped.frame(),
               v1::FrameState_Name(escaped.state()),
               escaped.attempts(),
               escaped.SerializeAsString()};
  row.checksum = ChecksumOf(row);
  return row;
}

absl::StatusOr<v1::Job> ReadRow(const JobRow& row, int64_t version) {
  const std::string what = absl::StrCat("job ", EscapedText(row.id));
  const bool first = version == kFirstSchemaVersion;
  if (!first && ChecksumOf(row) != row.checksum) return Damaged(what);
  absl::StatusOr<v1::Job> job = Parse<v1::Job>(row.job, what);
  if (!job.ok() || !first) return job;
  return job->id() == row.id && v1::JobState_Name(job->state()) == row.state ? job : Damaged(what);
}

absl::StatusOr<v1::FrameInfo> ReadRow(const FrameRow& row, int64_t version) {
  const std::string what = absl::StrCat("frame ", row.position, " of job ", EscapedText(row.job_id));
  const bool first = version == kFirstSchemaVersion;
  if (!first && ChecksumOf(row) != row.checksum) return Damaged(what);
  absl::StatusOr<v1::FrameInfo> info = Parse<v1::FrameInfo>(row.info, what);
  if (!info.ok() || !first) return info;
  const bool same = v1::FrameState_Name(info->state()) == row.state && info->attempts() == row.attempts;
  return same ? info : Damaged(what);
}

std::string JobColumns(int64_t version) {
  return absl::StrCat("sequence, id, state, message, job, ",
                      version == kFirstSchemaVersion ? "0" : "checksum");
}

std::string FrameColumns(int64_t version) {
  return absl::StrCat("job_id, position, name, state, attempts, info, ",
                      version == kFirstSchemaVersion ? "0" : "checksum");
}

JobRow JobRowOf(const Statement& statement) {
  return {statement.Int(0),   statement.Bytes(1), statement.Bytes(2),
          statement.Bytes(3), statement.Bytes(4), statement.Int(5)};
}

FrameRow FrameRowOf(const Statement& statement) {
  return {statement.Bytes(0), statement.Int(1),   statement.Bytes(2), statement.Bytes(3),
          statement.Int(4),   statement.Bytes(5), statement.Int(6)};
}

absl::Status PutRows(Database& database, const v1::JobUpdate& whole) {
  WEFT_ASSIGN_OR_RETURN(
      Statement put,
      database.Prepare("INSERT INTO jobs (id, state, message, job, checksum) VALUES (?, ?, ?, ?, ?) "
                       "ON CONFLICT (id) DO UPDATE SET state = excluded.state, message = excluded.message, "
                       "job = excluded.job, checksum = excluded.checksum"));
  const JobRow row = MakeRow(whole.job());
  put.BindText(1, row.id).BindText(2, row.state).BindText(3, row.message).BindBytes(4, row.job);
  WEFT_RETURN_IF_ERROR(put.Bind(5, row.checksum).Run());
  WEFT_ASSIGN_OR_RETURN(Statement remove, database.Prepare("DELETE FROM frames WHERE job_id = ?"));
  WEFT_RETURN_IF_ERROR(remove.BindText(1, row.id).Run());
  WEFT_ASSIGN_OR_RETURN(Statement replace, database.Prepare(kReplaceFrame));
  for (int i = 0; i < whole.frames_size(); ++i)
    WEFT_RETURN_IF_ERROR(ReplaceRow(replace, MakeRow(row.id, i, whole.frames(i))));
  return absl::OkStatus();
}

absl::Status ReplaceRow(Statement& replace_frame, const FrameRow& row) {
  replace_frame.BindText(1, row.job_id).Bind(2, row.position).BindText(3, row.name).BindText(4, row.state);
  return replace_frame.Bind(5, row.attempts).BindBytes(6, row.info).Bind(7, row.checksum).Run();
}

}  // namespace weft

#include "services/server/catalogue/sqlite.h"

#include <sqlite3.h>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/path_facts.h"
#include "base/status_macros.h"

namespace weft {
namespace {

absl::Status DamagedError(const std::string& path, const std::string& what) {
  return absl::DataLossError(absl::StrCat(
      path, ": damaged (", what,
      "); start weftd again: it keeps this file aside, makes a new one from the records of the jobs, and "
      "loses no results"));
}

absl::Status ErrorOf(const std::string& path, int code, const std::string& what) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::FailedPreconditionError(
          absl::StrCat(path, ": in use by another weftd; stop that one, or give another --state folder"));
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return DamagedError(path, what);
    case SQLITE_FULL:
      return absl::ResourceExhaustedError(absl::StrCat(path, ": ", what, "; make room on the disk"));
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return absl::PermissionDeniedError(
          absl::StrCat(path, ": cannot be opened for writing (", what, "); check the folder's permissions"));
    case SQLITE_IOERR:
      // A disk that no longer gives back what was written.
      if (code == SQLITE_IOERR_READ || code == SQLITE_IOERR_CORRUPTFS) return DamagedError(path, what);
      return absl::UnavailableError(absl::StrCat(path, ": ", what, "; check the disk"));
    default:
      return absl::InternalError(absl::StrCat(path, ": ", what));
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::string& path) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(
      path.c_str(), &handle,
      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX | SQLITE_OPEN_EXRESCODE, nullptr);
  if (handle == nullptr) return absl::ResourceExhaustedError(absl::StrCat(path, ": out of memory"));
  std::unique_ptr<Database> database(new Database(path, handle));
  if (code != SQLITE_OK) return database->LastError();
  WEFT_RETURN_IF_ERROR(database->Lock());
  return database;
}

absl::Status Database::Lock() {
  // With locking_mode EXCLUSIVE the lock of the first write transaction is kept.
  for (const char* sql :
       {"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL",
        "PRAGMA foreign_keys = ON", "BEGIN IMMEDIATE", "PRAGMA schema_version", "COMMIT"}) {
    WEFT_RETURN_IF_ERROR(Execute(sql));
  }
  return absl::OkStatus();
}

Database::~Database() { sqlite3_close_v2(handle_); }

absl::Status Database::LastError() const {
  return ErrorOf(path_, sqlite3_extended_errcode(handle_), sqlite3_errmsg(handle_));
}

int64_t Database::ChangedRows() const { return sqlite3_changes64(handle_); }

absl::Status Database::CheckIntegrity() {
  WEFT_ASSIGN_OR_RETURN(Statement check, Prepare("PRAGMA integrity_check(1)"));
  WEFT_ASSIGN_OR_RETURN(const bool row, check.Step());
  const std::string found = row ? check.Bytes(0) : "no answer";
  if (found == "ok") return absl::OkStatus();
  return DamagedError(path_, absl::StrReplaceAll(found, {{"\n", ": "}}));
}

absl::Status Database::Execute(const std::string& sql) {
  return sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK ? absl::OkStatus()
                                                                                    : LastError();
}

absl::StatusOr<Statement> Database::Prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(handle_, sql.data(), static_cast<int>(sql.size()), &statement, nullptr) != SQLITE_OK)
    return LastError();
  return Statement(this, statement);
}

absl::StatusOr<int64_t> Database::ReadNumber(const std::string& sql) {
  WEFT_ASSIGN_OR_RETURN(Statement statement, Prepare(sql));
  WEFT_ASSIGN_OR_RETURN(const bool row, statement.Step());
  return row ? statement.Int(0) : 0;
}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_), handle_(other.handle_), bind_error_(other.bind_error_) {
  other.handle_ = nullptr;
}

Statement::~Statement() { sqlite3_finalize(handle_); }

Statement& Statement::Bind(int parameter, int64_t value) {
  bind_error_ |= sqlite3_bind_int64(handle_, parameter, value);
  return *this;
}

Statement& Statement::BindText(int parameter, std::string_view value) {
  bind_error_ |=
      sqlite3_bind_text64(handle_, parameter, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  return *this;
}

Statement& Statement::BindBytes(int parameter, std::string_view value) {
  bind_error_ |= sqlite3_bind_blob64(handle_, parameter, value.data(), value.size(), SQLITE_TRANSIENT);
  return *this;
}

absl::StatusOr<bool> Statement::Step() {
  if (bind_error_ != SQLITE_OK) {
    return absl::InternalError(
        absl::StrCat(database_->path(), ": a parameter cannot be bound to ", sqlite3_sql(handle_)));
  }
  switch (sqlite3_step(handle_)) {
    case SQLITE_ROW:
      return true;
    case SQLITE_DONE:
      return false;
    default:
      return database_->LastError();
  }
}

absl::Status Statement::Run() {
  const absl::StatusOr<bool> row = Step();
  Reset();
  return row.status();
}

void Statement::Reset() {
  sqlite3_reset(handle_);
  sqlite3_clear_bindings(handle_);
  bind_error_ = SQLITE_OK;
}

int64_t Statement::Int(int column) const { return sqlite3_column_int64(handle_, column); }

std::string Statement::Bytes(int column) const {
  const void* data = sqlite3_column_blob(handle_, column);
  const int size = sqlite3_column_bytes(handle_, column);
  return data == nullptr ? std::string()
                         : std::string(static_cast<const char*>(data), static_cast<size_t>(size));
}

void RemoveDatabase(const std::string& path) {
  for (const char* ending : {"", "-wal", "-shm", "-journal"}) RemoveFile(path + ending);
}

Transaction::~Transaction() {
  // Nothing can be done about a failed rollback: SQLite rolls back when the file is opened again.
  if (open_) database_.Execute("ROLLBACK").IgnoreError();
}

absl::Status Transaction::Begin() {
  absl::Status status = database_.Execute("BEGIN IMMEDIATE");
  open_ = status.ok();
  return status;
}

absl::Status Transaction::Commit() {
  absl::Status status = database_.Execute("COMMIT");
  if (status.ok()) open_ = false;
  return status;
}

}  // namespace weft

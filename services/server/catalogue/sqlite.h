// SQLite with RAII and absl::Status. One connection, used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct sqlite3;
struct sqlite3_stmt;

namespace weft {

class Statement;

class Database {
 public:
  // Opens or creates the file and locks it for the lifetime of the Database. The lock ends with the
  // process. FailedPrecondition: another process holds it. DataLoss: not a database, or damaged. Otherwise
  // as the operating system says. The message names the file.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // Runs statements without parameters and results.
  absl::Status Execute(const std::string& sql);
  absl::StatusOr<Statement> Prepare(const std::string& sql);
  // The first number of the first row; 0 where there is none.
  absl::StatusOr<int64_t> ReadNumber(const std::string& sql);
  // By the last INSERT, UPDATE or DELETE.
  int64_t ChangedRows() const;
  // Looks at every page and index. DataLoss: damaged; the message says where.
  absl::Status CheckIntegrity();
  // What SQLite says of the last failure, as a status that names the file.
  absl::Status LastError() const;
  const std::string& path() const { return path_; }

 private:
  Database(std::string path, sqlite3* handle) : path_(std::move(path)), handle_(handle) {}
  absl::Status Lock();

  const std::string path_;
  sqlite3* const handle_;
};

// A prepared statement. Parameters are numbered from 1, columns from 0. May be run again after Reset.
class Statement {
 public:
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  ~Statement();

  Statement& Bind(int parameter, int64_t value);
  Statement& BindText(int parameter, std::string_view value);
  Statement& BindBytes(int parameter, std::string_view value);

  // True when there is a row, false at the end. Reports failed Binds too.
  absl::StatusOr<bool> Step();
  // For statements without rows: runs it and makes it ready for the next Bind.
  absl::Status Run();
  void Reset();

  int64_t Int(int column) const;
  // Text or bytes.
  std::string Bytes(int column) const;

 private:
  friend class Database;
  Statement(const Database* database, sqlite3_stmt* handle) : database_(database), handle_(handle) {}

  const Database* database_;
  sqlite3_stmt* handle_;
  int bind_error_ = 0;
};

// Removes the file and what SQLite keeps beside it, where they exist.
void RemoveDatabase(const std::string& path);

// All or nothing: rolls back unless Commit was called.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) {}
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  absl::Status Begin();
  absl::Status Commit();

 private:
  Database& database_;
  bool open_ = false;
};

}  // namespace weft

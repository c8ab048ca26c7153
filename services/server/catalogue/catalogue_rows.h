// The catalogue's tables, and their rows as they stand in the file.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "services/server/catalogue/sqlite.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Of PRAGMA user_version. 1: rows without checksums.
inline constexpr int64_t kSchemaVersion = 2;
inline constexpr int64_t kFirstSchemaVersion = 1;

// Makes the tables in an empty database.
absl::Status MakeTables(Database& database);

// State and other columns repeat what the message holds, for people who look with sqlite3. The checksum is of
// all other columns but `sequence`.
struct JobRow {
  int64_t sequence = 0;
  std::string id, state, message;
  std::string job;  // v1::Job
  int64_t checksum = 0;
};
struct FrameRow {
  std::string job_id;
  int64_t position = 0;
  std::string name, state;
  int64_t attempts = 0;
  std::string info;  // v1::FrameInfo
  int64_t checksum = 0;
};

JobRow MakeRow(const v1::Job& job);
FrameRow MakeRow(const std::string& job_id, int64_t position, const v1::FrameInfo& info);

// The message of a row that is as it was written. DataLoss: it is not. In version 1, texts that are not UTF-8
// are escaped, and what the columns repeat takes the checksum's place.
absl::StatusOr<v1::Job> ReadRow(const JobRow& row, int64_t version = kSchemaVersion);
absl::StatusOr<v1::FrameInfo> ReadRow(const FrameRow& row, int64_t version = kSchemaVersion);

// Columns in the order of the structs, for SELECT; version 1 has 0 for the checksum.
std::string JobColumns(int64_t version = kSchemaVersion);
std::string FrameColumns(int64_t version = kSchemaVersion);
JobRow JobRowOf(const Statement& statement);
FrameRow FrameRowOf(const Statement& statement);

// Adds the job with its frames, or replaces them; it keeps its place in the order of jobs.
absl::Status PutRows(Database& database, const v1::JobUpdate& whole);
absl::Status ReplaceRow(Statement& replace_frame, const FrameRow& row);
inline constexpr char kReplaceFrame[] =
    "INSERT OR REPLACE INTO frames (job_id, position, name, state, attempts, info, checksum) "
    "VALUES (?, ?, ?, ?, ?, ?, ?)";

}  // namespace weft

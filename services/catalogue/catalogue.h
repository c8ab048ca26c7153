// What the daemon remembers: jobs and the state of each of their frames, in one SQLite file.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/catalogue/sqlite.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Every call is one transaction that is on the disk when it returns, so the content survives a killed process
// and a power cut. Errors name the file. Thread safety: one thread at a time.
class Catalogue {
 public:
  // Makes the file where it is missing. Errors of Database::Open. FailedPrecondition: written by a newer
  // Weft.
  static absl::StatusOr<std::unique_ptr<Catalogue>> Open(const std::string& path);

  // AlreadyExists: a job of this id.
  absl::Status AddJob(const v1::Job& job, const std::vector<v1::FrameInfo>& frames);
  // NotFound: no such job.
  absl::Status UpdateJob(const v1::Job& job);
  // Frames by their position in AddJob. NotFound: no such frame.
  absl::Status UpdateFrame(const std::string& job_id, size_t position, const v1::FrameInfo& info);
  // The job and all its frames at once.
  absl::Status UpdateAll(const v1::Job& job, const std::vector<v1::FrameInfo>& frames);

  // NotFound: no such job.
  absl::StatusOr<v1::Job> ReadJob(const std::string& id);
  // In the order of AddJob.
  absl::StatusOr<std::vector<v1::FrameInfo>> ReadFrames(const std::string& job_id);
  // Newest first.
  absl::StatusOr<std::vector<v1::Job>> ListJobs(int limit);
  // Queued and running ones, oldest first.
  absl::StatusOr<std::vector<v1::Job>> UnfinishedJobs();

 private:
  explicit Catalogue(std::unique_ptr<Database> database) : database_(std::move(database)) {}
  absl::Status MakeSchema();
  absl::Status WriteFrames(const std::string& job_id, const std::vector<v1::FrameInfo>& frames);
  absl::Status WriteJob(const v1::Job& job);

  std::unique_ptr<Database> database_;
};

}  // namespace weft

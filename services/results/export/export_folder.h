// The folder of an export: what stands in it, and what an interrupted export left.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/export.pb.h"

namespace weft {

inline constexpr char kExportFile[] = "export.json";

// Cancelled: the export was stopped, and what to do.
absl::Status StoppedAfter(size_t done, size_t all);

// Thread safety: none; one process at a time.
class ExportFolder {
 public:
  explicit ExportFolder(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }
  std::string Of(const std::string& name) const;
  // Of a file that is not complete.
  std::string UnfinishedOf(const std::string& name) const;

  enum class Holds { kNothing, kPart, kAll };
  // How much of this export stands here. FailedPrecondition: another export does, or other files of the same
  // names.
  absl::StatusOr<Holds> Compare(const v1::Export& wanted) const;
  // ResourceExhausted: fewer bytes are free than are needed besides `present_bytes`.
  absl::Status CheckRoom(uint64_t needed_bytes, uint64_t present_bytes) const;
  // Makes the folder, and notes what is to be exported.
  absl::Status Begin(const v1::Export& wanted) const;
  // Compare, and unless all of it is there: removes leftovers, checks the room, begins what has not begun.
  absl::StatusOr<Holds> BeginOrGoOn(const v1::Export& wanted, uint64_t needed_bytes) const;
  // Removes temporary files of `wanted` that a killed export left.
  void RemoveLeftovers(const v1::Export& wanted) const;

  std::optional<v1::ExportCheckpoint> Checkpoint() const;
  absl::Status WriteCheckpoint(const v1::ExportCheckpoint& checkpoint) const;
  // Gives an unfinished file its name.
  absl::Status Publish(const std::string& name) const;
  // Writes export.json and removes what was noted.
  absl::Status Finish(const v1::Export& manifest) const;

 private:
  std::string path_;
};

}  // namespace weft

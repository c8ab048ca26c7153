// The takes that a daemon records: a folder each, with a recorder of its own.
#pragma once

#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/takes.pb.h"

namespace weft {

// The folders below `takes_folder` are all that is remembered: takes go on without a daemon, and the next one
// finds them. Thread safety: any thread may call any function.
class TakeKeeper {
 public:
  // Closes takes whose recorders died, in the background.
  TakeKeeper(std::string takes_folder, std::string recorder_program);

  // Errors as takes.proto says; those of StartRecorder.
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request);
  absl::StatusOr<v1::RecordedTake> Stop(const std::string& id);
  absl::StatusOr<v1::RecordedTake> Get(const std::string& id);
  // Newest first.
  v1::ListTakesResponse List(size_t limit);

 private:
  std::string FolderOf(const std::string& id) const { return takes_folder_ + "/" + id; }
  std::vector<std::string> Ids() const;
  absl::Status CheckCamerasAreFree(const v1::Session& session);

  const std::string takes_folder_;
  const std::string recorder_program_;
  std::mutex starting_;    // one request at a time looks which cameras are free
  std::mutex recovering_;  // one take at a time is closed
  std::jthread recovery_;
};

// "take:<id>" as the folder of that take; anything else as it is. InvalidArgument: no id of a take.
absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name);

}  // namespace weft

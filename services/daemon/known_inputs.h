// What the inputs of jobs hold, remembered for as long as nobody changes them.
#pragma once

#include <ctime>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <semaphore>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "services/daemon/input_stamps.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// What a job's inputs hold.
struct LoadedInputs {
  std::vector<std::string> frames;  // the names of those that are asked for
  v1::InputHashes hashes;
  std::vector<std::string> warnings;
  std::optional<v1::DrivenJob> driven;  // of jobs with spec.driving
};

// Reads the inputs of a job and checks them against each other.
using InputsLoader = std::function<absl::StatusOr<LoadedInputs>(const v1::RegistrationSpec& spec)>;

// A studio submits job after job of the same inputs. Thread safety: any thread.
class KnownInputs {
 public:
  using Clock = std::function<time_t()>;
  explicit KnownInputs(Clock now_s = [] { return std::time(nullptr); }) : now_s_(std::move(now_s)) {}

  // What the inputs of `spec` hold: known, or from `load`, which a few calls at most do at a time, as inputs
  // are large. Its errors are not remembered. The paths of `spec` are canonical.
  absl::StatusOr<LoadedInputs> Get(const v1::RegistrationSpec& spec, const InputsLoader& load);

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const InputStamps> stamps;
    LoadedInputs inputs;
  };

  std::optional<LoadedInputs> Find(const std::string& key);
  void Keep(Entry entry);

  const Clock now_s_;
  std::counting_semaphore<> loading_{2};
  std::mutex mutex_;
  std::list<Entry> entries_;  // the one used last comes first
};

}  // namespace weft

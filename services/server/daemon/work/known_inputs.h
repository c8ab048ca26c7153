// What the inputs of jobs hold, remembered for as long as nobody changes them.
#pragma once

#include <ctime>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/callers/turn_gate.h"
#include "services/server/daemon/work/input_stamps.h"
#include "services/work/kinds/work_kind.h"

namespace weft {

// A studio submits job after job of the same inputs. Thread safety: any thread.
class KnownInputs {
 public:
  using Clock = std::function<time_t()>;
  explicit KnownInputs(Clock now_s = [] { return std::time(nullptr); }) : now_s_(std::move(now_s)) {}

  // What the inputs of `spec` hold: known, or from `load`, which a few calls at most do at a time, as inputs
  // are large; two of each caller, so that nobody waits for the slow inputs of another. Its errors are not
  // remembered. The paths of `spec` are canonical.
  absl::StatusOr<LoadedInputs> Get(const v1::RegistrationSpec& spec, const std::string& caller_name,
                                   const InputsLoader& load);

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const InputStamps> stamps;
    LoadedInputs inputs;
  };

  std::optional<LoadedInputs> Find(const std::string& key);
  void Keep(Entry entry);

  const Clock now_s_;
  TurnGate loading_{4, 2};
  Mutex mutex_;
  std::list<Entry> entries_ ABSL_GUARDED_BY(mutex_);  // the one used last comes first
};

}  // namespace weft

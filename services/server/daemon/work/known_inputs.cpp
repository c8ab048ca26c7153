#include "services/server/daemon/work/known_inputs.h"

#include <algorithm>
#include <memory>

namespace weft {
namespace {

constexpr size_t kMaxStamps = 200'000;  // of all entries: some 50 MB

// Everything of `spec` that says what is read.
std::string KeyOf(v1::RegistrationSpec spec) {
  spec.clear_out();
  return spec.SerializeAsString();
}

}  // namespace

std::optional<LoadedInputs> KnownInputs::Find(const std::string& key) {
  std::shared_ptr<const InputStamps> stamps;
  LoadedInputs inputs;
  const auto is_it = [&key](const Entry& entry) { return entry.key == key; };
  {
    const MutexLock lock(mutex_);
    const auto found = std::find_if(entries_.begin(), entries_.end(), is_it);
    if (found == entries_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found);
    stamps = found->stamps;
    inputs = found->inputs;
  }
  if (stamps->StillHold()) return inputs;
  const MutexLock lock(mutex_);
  entries_.remove_if([&](const Entry& entry) { return entry.stamps == stamps; });
  return std::nullopt;
}

void KnownInputs::Keep(Entry entry) {
  const MutexLock lock(mutex_);
  entries_.remove_if([&entry](const Entry& older) { return older.key == entry.key; });
  entries_.push_front(std::move(entry));
  size_t count = 0;
  const auto first_beyond = std::find_if(entries_.begin(), entries_.end(), [&count](const Entry& kept) {
    count += kept.stamps->count() + kept.inputs.frames.size();
    return count > kMaxStamps;
  });
  entries_.erase(first_beyond, entries_.end());
}

absl::StatusOr<LoadedInputs> KnownInputs::Get(const v1::RegistrationSpec& spec,
                                              const std::string& caller_name, const InputsLoader& load) {
  const std::string key = KeyOf(spec);
  if (std::optional<LoadedInputs> known = Find(key)) return *std::move(known);
  const TurnGate::Pass pass = loading_.Enter(caller_name);
  // Another call may have read them meanwhile.
  if (std::optional<LoadedInputs> known = Find(key)) return *std::move(known);
  // Before they are read: a change meanwhile must not look like what was read.
  auto stamps = std::make_shared<const InputStamps>(InputStamps::Take(spec, now_s_()));
  absl::StatusOr<LoadedInputs> inputs = load(spec);
  if (inputs.ok() && stamps->conclusive()) Keep({key, std::move(stamps), *inputs});
  return inputs;
}

}  // namespace weft

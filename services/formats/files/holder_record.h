// Who holds a folder, as a file says it: what keeps two processes apart where flock() does not, as over FUSE
// and some network file systems.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/formats/files/confined_folder.h"

namespace weft {

// A process on a machine since its boot.
struct HolderIdentity {
  std::string host;     // name and machine id
  std::string boot_id;  // of the kernel
  std::string pid_namespace;
  int64_t pid = 0;
  int64_t started = 0;  // the process, in ticks since boot
  std::string owner;    // in words, for people

  static HolderIdentity OfThisProcess(const std::string& owner);
};

// The file's text, and back. Otherwise InvalidArgument.
std::string TextOf(const HolderIdentity& holder);
absl::StatusOr<HolderIdentity> ParseHolder(const std::string& text);

// Holds `path` while it lives: a file that names this process, and whose time a thread sets anew every
// kRefresh. Thread safety: any thread.
class HolderRecord {
 public:
  static constexpr std::chrono::seconds kRefresh{10};
  static constexpr std::chrono::seconds kStale{60};  // six refreshes that did not come

  // The file appears at once and whole. One of a process that has ended is replaced: on this machine where no
  // such process lives or it booted since; of another one after kStale without a refresh, by the times of the
  // file system. FailedPrecondition: a live process holds it; the message says which, and what to do.
  // Otherwise errors of WriteFileAtomically.
  // `on_lost` is called once, in a thread, where IsHeld becomes false.
  static absl::StatusOr<HolderRecord> Take(const std::string& path, const std::string& owner,
                                           std::function<void()> on_lost = {});
  // The file `name` in a folder that stays the same whatever takes its place.
  static absl::StatusOr<HolderRecord> TakeIn(const ConfinedFolder& folder, const std::string& name,
                                             const std::string& owner);
  HolderRecord(HolderRecord&&) noexcept;
  HolderRecord& operator=(HolderRecord&&) noexcept;
  // Removes the file where it is still this one's.
  ~HolderRecord();

  // False: another process has it by now, since this one stood still for longer than kStale.
  bool IsHeld() const;
  // What a refresh does: true where the file was still this one's, or nobody's. For tests, too.
  bool Refresh();

 private:
  struct Held;
  explicit HolderRecord(std::shared_ptr<Held> held) : held_(std::move(held)) {}
  static absl::StatusOr<HolderRecord> TakeAs(std::shared_ptr<Held> held, const std::string& owner);

  std::shared_ptr<Held> held_;
};

}  // namespace weft

#include "services/formats/files/holder_record.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <functional>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/mutex.h"
#include "base/process_identity.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {

// What is refreshed.
struct HolderRecord::Held {
  std::optional<ConfinedFolder> folder;  // that `path` goes through
  std::string path, text;
  std::function<void()> on_lost;
  std::atomic<bool> is_ours = true;

  void Lose() {
    if (is_ours.exchange(false) && on_lost) on_lost();
  }
};

namespace {

constexpr uint64_t kMaxBytes = 4096;
constexpr char kFormat[] = "weft-holder 1";

// One line of printable characters.
std::string Plain(std::string text) {
  for (char& c : text) c = absl::ascii_isprint(static_cast<unsigned char>(c)) ? c : '?';
  return text;
}

enum class Life { kLives, kEnded, kElsewhere };

Life LifeOf(const HolderIdentity& holder, const HolderIdentity& own) {
  if (holder.host != own.host) return Life::kElsewhere;
  // Machines without an id may have the same name.
  if (holder.boot_id != own.boot_id) return holder.host.ends_with(' ') ? Life::kElsewhere : Life::kEnded;
  if (holder.pid_namespace != own.pid_namespace) return Life::kElsewhere;  // a container beside this one
  const int64_t start = StartOfProcess(holder.pid);
  const bool is_there = start == 0 ? kill(static_cast<pid_t>(holder.pid), 0) == 0 || errno == EPERM  // hidden
                                   : start == holder.started;
  return is_there ? Life::kLives : Life::kEnded;
}

// How long ago the file was refreshed, by the clock that the file system gives to files.
std::chrono::seconds AgeOf(const std::string& path) {
  struct stat then, now;
  if (stat(path.c_str(), &then) != 0) return {};
  const std::string probe = absl::StrCat(path, ".now.", getpid());
  const int fd = open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600);
  const bool is_known = fd >= 0 && fstat(fd, &now) == 0;
  if (fd >= 0) {
    close(fd);
    unlink(probe.c_str());
  }
  const time_t now_s = is_known ? now.st_mtime : time(nullptr);  // on a full disk by this machine's clock
  return std::chrono::seconds(now_s - then.st_mtime);
}

absl::Status Refusal(const std::string& path, const HolderIdentity& holder, Life life) {
  const std::string who = Plain(absl::StrCat(holder.owner, ", process ", holder.pid, " on ",
                                             holder.host.substr(0, holder.host.find(' '))));
  if (life == Life::kLives) {
    return absl::FailedPreconditionError(
        absl::StrCat(path, ": is held by ", who, "; wait until it has ended, or stop it"));
  }
  return absl::FailedPreconditionError(absl::StrCat(
      path, ": is held by ", who, "; wait until it has ended. If it ended without a word, it counts ",
      "as gone after ", HolderRecord::kStale.count(),
      " s without a refresh; remove the file where you are sure of that before"));
}

// 0, or errno. The file has all of `text` from its first moment on.
int MakeFile(const std::string& path, const std::string& text) {
  static std::atomic<uint64_t> counter{0};
  const std::string draft = absl::StrCat(path, ".tmp.", getpid(), ".", counter++);
  const int fd = open(draft.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) return errno;
  int error = WriteAll(fd, text);
  if (close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && link(draft.c_str(), path.c_str()) != 0) error = errno;
  // Without hard links; RENAME_NOREPLACE is as good.
  if ((error == EPERM || error == ENOTSUP || error == EMLINK || error == ENOSYS) &&
      renameat2(AT_FDCWD, draft.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0)
    return 0;
  unlink(draft.c_str());
  return error;
}

// Takes away the file of `text`, and puts back another one that came meanwhile. False: it was another.
bool TakeAway(const std::string& path, const std::string& text) {
  const std::string aside = absl::StrCat(path, ".tmp.", getpid(), ".stale");
  if (rename(path.c_str(), aside.c_str()) != 0) return errno == ENOENT;
  const absl::StatusOr<std::string> moved = ReadWholeFile(aside, kMaxBytes);
  const bool is_stale = moved.ok() && *moved == text;
  if (!is_stale && link(aside.c_str(), path.c_str()) != 0)
    renameat2(AT_FDCWD, aside.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE);
  unlink(aside.c_str());
  return is_stale;
}

// Refreshes in one thread all that this process holds.
class Refresher {
 public:
  static Refresher& Get() {
    static Refresher* const one = new Refresher;  // as long as the process
    return *one;
  }

  template <typename Held>
  void Add(const std::shared_ptr<Held>& held, std::function<void()> refresh) {
    const MutexLock lock(mutex_);
    held_.push_back({held, held->text, std::move(refresh)});
    if (!std::exchange(runs_, true)) Start();
  }

  bool Holds(const std::string& text) {
    const MutexLock lock(mutex_);
    return std::ranges::any_of(held_,
                               [&](const One& one) { return one.text == text && !one.held.expired(); });
  }

 private:
  struct One {
    std::weak_ptr<void> held;
    std::string text;
    std::function<void()> refresh;
  };

  // Signals are for the threads that wait for them.
  void Start() {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    std::thread([this] { Run(); }).detach();
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  void Run() {
    for (;;) {
      std::this_thread::sleep_for(HolderRecord::kRefresh);
      std::vector<One> now;
      {
        const MutexLock lock(mutex_);
        std::erase_if(held_, [](const One& one) { return one.held.expired(); });
        now = held_;
      }
      for (const One& one : now) one.refresh();
    }
  }

  Mutex mutex_;
  std::vector<One> held_ ABSL_GUARDED_BY(mutex_);
  bool runs_ ABSL_GUARDED_BY(mutex_) = false;
};

// False: it is another process's by now.
bool RefreshFile(const std::string& path, const std::string& text) {
  const absl::StatusOr<std::string> there = ReadWholeFile(path, kMaxBytes);
  if (there.ok() && *there == text) {
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
    return true;
  }
  // Removed, perhaps with its folder; a disk that cannot be read says nothing.
  if (absl::IsNotFound(there.status())) return MakeFile(path, text) != EEXIST;
  return !there.ok();
}

// Makes the file, or says who has it.
absl::Status Claim(const std::string& path, const std::string& text, const HolderIdentity& own) {
  constexpr int kTries = 5;  // others may come and go meanwhile
  for (int i = 0; i < kTries; ++i) {
    const int error = MakeFile(path, text);
    if (error == 0) return absl::OkStatus();
    if (error != EEXIST) return WriteError(path, error);
    const absl::StatusOr<std::string> there = ReadWholeFile(path, kMaxBytes);
    if (absl::IsNotFound(there.status())) continue;
    if (!there.ok()) return there.status();
    const absl::StatusOr<HolderIdentity> holder = ParseHolder(*there);
    Life life = holder.ok() ? LifeOf(*holder, own) : Life::kElsewhere;
    if (life == Life::kLives && holder->pid == own.pid && !Refresher::Get().Holds(*there))
      life = Life::kEnded;
    if (life == Life::kElsewhere && AgeOf(path) >= HolderRecord::kStale) life = Life::kEnded;
    if (life != Life::kEnded)
      return Refusal(path, holder.value_or(HolderIdentity{.owner = "somebody"}), life);
    TakeAway(path, *there);
  }
  return absl::FailedPreconditionError(absl::StrCat(path, ": other processes take it at this moment"));
}

}  // namespace

HolderIdentity HolderIdentity::OfThisProcess(const std::string& owner) {
  char host[256] = "";
  gethostname(host, sizeof host - 1);
  HolderIdentity own;
  own.host = absl::StrCat(host, " ", KernelText("/etc/machine-id"));
  own.boot_id = BootId();
  own.pid_namespace = PidNamespace();
  own.pid = getpid();
  own.started = StartOfProcess(own.pid);
  own.owner = owner;
  return own;
}

std::string TextOf(const HolderIdentity& holder) {
  return absl::StrCat(kFormat, "\nhost ", Plain(holder.host), "\nboot ", Plain(holder.boot_id),
                      "\nnamespace ", Plain(holder.pid_namespace), "\npid ", holder.pid, "\nstarted ",
                      holder.started, "\nowner ", Plain(holder.owner), "\n");
}

absl::StatusOr<HolderIdentity> ParseHolder(const std::string& text) {
  HolderIdentity holder;
  std::vector<std::string> lines = absl::StrSplit(text, '\n');
  bool is_right = lines[0] == kFormat;
  const auto take = [&](size_t line, const std::string& key) -> std::string {
    is_right = is_right && line < lines.size() && absl::StartsWith(lines[line], key + " ");
    return is_right ? lines[line].substr(key.size() + 1) : "";
  };
  holder.host = take(1, "host");
  holder.boot_id = take(2, "boot");
  holder.pid_namespace = take(3, "namespace");
  is_right = absl::SimpleAtoi(take(4, "pid"), &holder.pid) && is_right;
  is_right = absl::SimpleAtoi(take(5, "started"), &holder.started) && is_right;
  holder.owner = take(6, "owner");
  if (is_right && holder.pid > 0) return holder;
  return absl::InvalidArgumentError("it does not say who holds it");
}

absl::StatusOr<HolderRecord> HolderRecord::Take(const std::string& path, const std::string& owner,
                                                std::function<void()> on_lost) {
  auto held = std::make_shared<Held>();
  held->path = path;
  held->on_lost = std::move(on_lost);
  return TakeAs(std::move(held), owner);
}

absl::StatusOr<HolderRecord> HolderRecord::TakeIn(const ConfinedFolder& folder, const std::string& name,
                                                  const std::string& owner) {
  auto held = std::make_shared<Held>();
  WEFT_ASSIGN_OR_RETURN(ConfinedFolder own, folder.Again());
  held->path = own.At(name);
  held->folder.emplace(std::move(own));
  absl::StatusOr<HolderRecord> record = TakeAs(std::move(held), owner);
  if (!record.ok())  // named by another descriptor, which is closed by now
    return absl::Status(
        record.status().code(),
        absl::StrCat(folder.Named(name),
                     std::string(record.status().message().substr(record.status().message().find(':')))));
  return record;
}

absl::StatusOr<HolderRecord> HolderRecord::TakeAs(std::shared_ptr<Held> held, const std::string& owner) {
  static std::atomic<uint64_t> counter{0};
  const HolderIdentity own = HolderIdentity::OfThisProcess(owner);
  const std::string& path = held->path;
  // One process may hold the same place again.
  held->text = absl::StrCat(TextOf(own), "number ", counter++, "\n");
  WEFT_RETURN_IF_ERROR(Claim(path, held->text, own));
  HolderRecord record(held);
  Refresher::Get().Add(held, [weak = std::weak_ptr<Held>(held)] {
    if (const std::shared_ptr<Held> one = weak.lock(); one && !RefreshFile(one->path, one->text)) one->Lose();
  });
  return record;
}

HolderRecord::HolderRecord(HolderRecord&&) noexcept = default;
HolderRecord& HolderRecord::operator=(HolderRecord&& other) noexcept {
  std::swap(held_, other.held_);
  return *this;
}

HolderRecord::~HolderRecord() {
  if (!held_) return;
  const absl::StatusOr<std::string> there = ReadWholeFile(held_->path, kMaxBytes);
  if (there.ok() && *there == held_->text) unlink(held_->path.c_str());
}

bool HolderRecord::IsHeld() const { return held_ && held_->is_ours; }

bool HolderRecord::Refresh() {
  if (!RefreshFile(held_->path, held_->text)) held_->Lose();
  return held_->is_ours;
}

}  // namespace weft

#include "services/server/daemon/door/connections.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "capture/file/plain_text.h"
#include "services/ground/process/freed_memory.h"
#include "services/ground/process/process_limits.h"
#include "services/ground/process/thread_priority.h"
#include "services/server/rpc/message_limit.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kDescriptors[] = "/proc/self/fd";
constexpr std::chrono::seconds kCountEvery{1};
constexpr int kCountsPerGivingBack = 10;
// A gigabit in so long is 1.2 MB.
constexpr std::chrono::milliseconds kGuardEvery{10};
constexpr std::chrono::milliseconds kCountAgain{50};  // where there is no room
// Of one peer. Clients that are told when to come again do not get there.
constexpr double kMostRefusals = 1000, kRefusals_per_s = 50;
// A call of a connection that was closed just now may still be looked at.
constexpr std::chrono::seconds kSlotRests{10};

int SlotsOf(ListenKind kind) {
  switch (kind) {
    case ListenKind::kUnixSocket:
      return 4;  // closed to all but its owner and root
    case ListenKind::kLoopback:
      return 16;
    case ListenKind::kConsole:
      return 64;
    default:
      return 128;
  }
}

Trust TrustOf(ListenKind kind) {
  if (kind == ListenKind::kConsole) return Trust::kConsole;
  return kind == ListenKind::kNetwork ? Trust::kNobody : Trust::kUsers;
}

bool IsOwner(const Peer& peer) { return peer.uid && (*peer.uid == geteuid() || *peer.uid == 0); }

// Of all sockets that this process has open.
std::set<ino_t> OpenSockets() {
  std::set<ino_t> sockets;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(kDescriptors, error)) {
    const std::string target = fs::read_symlink(entry.path(), error).string();
    absl::string_view inode = target;
    uint64_t number = 0;
    if (absl::ConsumePrefix(&inode, "socket:[") && absl::ConsumeSuffix(&inode, "]") &&
        absl::SimpleAtoi(inode, &number)) {
      sockets.insert(number);
    }
  }
  return sockets;
}

std::string TextOf(ReceiveGuard::Ended::Reason reason) {
  if (reason == ReceiveGuard::Ended::kWithoutCall)
    return "a connection sent more than a handshake, made no call, and broke HTTP/2's rules or left";
  return absl::StrCat("a connection sent more than was heard of it in calls and messages, each of which has ",
                      kLargestRequest_bytes >> 20, " MiB at most, and was ended");
}

}  // namespace

ConnectionLimits LimitsFor(int64_t descriptors) {
  constexpr int64_t kOwn = 256;  // pipes of workers, catalogue, files that are sent, folders
  constexpr int64_t kLeast = 32;
  ConnectionLimits limits;
  limits.all = static_cast<int>(
      std::clamp<int64_t>(descriptors - kOwn - limits.reserve, kLeast, static_cast<int64_t>(limits.all)));
  limits.of_one_peer = std::min(limits.of_one_peer, limits.all / 2);
  return limits;
}

ConnectionLimits LimitsOfProcess() {
  const int64_t descriptors = DescriptorLimit();
  const ConnectionLimits limits = LimitsFor(descriptors);
  if (limits.all < ConnectionLimits().all) {
    spdlog::warn(
        "only {} descriptors: {} connections at once instead of {}; raise LimitNOFILE of the service, or "
        "`ulimit -Hn`",
        descriptors, limits.all, ConnectionLimits().all);
  }
  return limits;
}

struct Connections::Slot {
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::shared_ptr<CallCheck> check;
  Peer peer;
  int open = 0;
  int refused = 0;   // since the logs told of it
  int admitted = 0;  // since they told of connections without a call
  int asked_before = 0;
  std::string refused_peer, refused_why;
  int64_t refusals_before = 0;  // calls
  double refusals = 0;          // those that count yet
  Clock::time_point left{};
};

struct Connections::Listener {
  ListeningSocket socket;
  std::vector<Slot> slots;
};

Connections::Connections(std::vector<ListeningSocket> sockets, ConnectionLimits limits,
                         const CallerSources& sources, const CredentialsOf& credentials_of,
                         grpc::ServerBuilder& builder)
    : limits_(limits), audit_(sources.audit), guard_(sources.guard) {
  for (ListeningSocket& socket : sockets) {
    auto listener = std::make_unique<Listener>();
    listener->slots.resize(SlotsOf(socket.kind));
    for (Slot& slot : listener->slots) {
      slot.check = std::make_shared<CallCheck>(sources, TrustOf(socket.kind));
      const std::shared_ptr<grpc::ServerCredentials> credentials = credentials_of(socket.kind);
      credentials->SetAuthMetadataProcessor(slot.check);
      slot.acceptor = builder.experimental().AddExternalConnectionAcceptor(
          grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
    }
    listener->socket = std::move(socket);
    listeners_.push_back(std::move(listener));
  }
}

Connections::~Connections() { Stop(); }

absl::Status Connections::Begin() {
  if (OpenSockets().empty()) {
    return absl::UnavailableError(absl::StrCat(
        kDescriptors, " cannot be read, which tells how many clients are connected; mount /proc"));
  }
  wake_ = UniqueFd(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  handover_.Begin();
  accepting_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  guarding_ = std::jthread([this](const std::stop_token& stop) { Guard(stop); });
  return absl::OkStatus();
}

void Connections::Stop() {
  handover_.Stop();  // while the guard still ends whoever holds it up
  if (accepting_.joinable()) {
    accepting_.request_stop();
    eventfd_write(wake_.get(), 1);
    accepting_.join();
  }
  guarding_ = {};
  // While it is open no other daemon takes its name.
  for (const auto& listener : listeners_) {
    if (!listener->socket.path.empty()) unlink(listener->socket.path.c_str());
  }
  listeners_.clear();
}

void Connections::Run(const std::stop_token& stop) {
  YieldToOthers(kNicenessOfNewConnections);
  std::vector<pollfd> sockets;
  for (const auto& listener : listeners_) sockets.push_back({listener->socket.socket.get(), POLLIN, 0});
  sockets.push_back({wake_.get(), POLLIN, 0});
  FreedMemory freed;
  int counts = 0;
  while (!stop.stop_requested()) {
    poll(sockets.data(), sockets.size(), std::chrono::milliseconds(kCountEvery).count());
    {
      const MutexLock lock(mutex_);
      if (Clock::now() - counted_ >= kCountEvery) {
        CountOpen();
        ++counts;
      }
    }
    // What clients sent and never read has grown the process, and they are gone.
    if (counts >= kCountsPerGivingBack) {
      freed.Requeue();
      counts = 0;
    }
    for (size_t i = 0; i < listeners_.size() && !stop.stop_requested(); ++i) {
      if ((sockets[i].revents & POLLIN) != 0) Accept(*listeners_[i]);
    }
  }
}

void Connections::Guard(const std::stop_token& stop) {
  MutexLock lock(mutex_);
  Clock::time_point guarded = Clock::now();
  while (!stop.stop_requested()) {
    // Nobody to guard against: sleeps until somebody comes.
    came_.wait(lock, stop, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !open_.empty(); });
    lock.unlock();
    std::this_thread::sleep_for(kGuardEvery);
    lock.lock();
    const Clock::time_point now = Clock::now();
    EndNoisy(std::chrono::duration<double>(now - std::exchange(guarded, now)).count());
  }
}

void Connections::Accept(Listener& listener) {
  // In turns, so that no listener waits for another one's flood.
  constexpr int kAtOnce = 32;
  for (int i = 0; i < kAtOnce; ++i) {
    UniqueFd connection(
        accept4(listener.socket.socket.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (connection.open()) {
      // Answers don't wait until the client acknowledges the one before; fails for sockets of the file
      // system.
      const int on = 1;
      setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      setsockopt(connection.get(), SOL_SOCKET, SO_RCVBUF, &ReceiveGuard::kReceiveBuffer_bytes,
                 sizeof ReceiveGuard::kReceiveBuffer_bytes);
      const Peer peer = PeerOf(connection.get());
      Admit(listener, std::move(connection), peer);
      continue;
    }
    const int error = errno;
    if (error == ECONNABORTED || error == EINTR) continue;
    if (error != EAGAIN) {
      spdlog::warn("{}: no connection can be accepted: {}", listener.socket.address, strerror(error));
      std::this_thread::sleep_for(kCountAgain);
    }
    return;
  }
}

absl::StatusOr<UniqueFd> Connections::ConnectConsole(const std::string& browser) {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0)
    return absl::UnavailableError(absl::StrCat("the console cannot connect: ", strerror(errno)));
  UniqueFd ours(ends[0]), theirs(ends[1]);
  for (const auto& listener : listeners_) {
    if (listener->socket.kind == ListenKind::kConsole &&
        Admit(*listener, std::move(ours), {absl::StrCat(browser, " (console)"), std::nullopt}))
      return theirs;
  }
  return absl::ResourceExhaustedError("too many clients are connected; try again in a minute");
}

bool Connections::Admit(Listener& listener, UniqueFd connection, const Peer& peer) {
  struct stat file = {};
  if (fstat(connection.get(), &file) != 0) return false;
  const MutexLock lock(mutex_);
  Slot& slot = SlotOf(listener, peer);
  if (!HasRoom(slot, peer) && Clock::now() - counted_ >= kCountAgain) CountOpen();
  if (std::string why = WhyRefused(slot, peer); !why.empty()) {
    ++slot.refused;
    slot.refused_peer = peer.name;
    slot.refused_why = std::move(why);
    return false;  // closed
  }
  if (slot.peer != peer) {
    slot.peer = slot.open == 0 ? peer : Peer{"several machines", std::nullopt};
    slot.check->SetPeer(slot.peer);
  }
  ++slot.open;
  ++slot.admitted;
  open_[file.st_ino] = &slot;
  open_now_ = static_cast<int>(open_.size());
  guard_.Add(connection.get(), file.st_ino);
  came_.notify_one();
  handover_.HandOver(*slot.acceptor, listener.socket.socket.get(), std::move(connection));
  return true;
}

// That of the peer, or one that nobody uses. Where there is none, the last is for all that are left.
Connections::Slot& Connections::SlotOf(Listener& listener, const Peer& peer) const {
  Slot* free = nullptr;
  for (Slot& slot : listener.slots) {
    if (slot.peer == peer && !peer.name.empty()) return slot;
    if (free == nullptr && slot.open == 0 && Clock::now() - slot.left >= kSlotRests) free = &slot;
  }
  return free != nullptr ? *free : listener.slots.back();
}

std::string Connections::WhyRefused(const Slot& slot, const Peer& peer) {
  if (!HasRoom(slot, peer))
    return absl::StrCat("it has ", slot.open, " open, all clients together ", open_.size());
  if (IsOwner(peer)) return "";
  const Clock::time_point now = Clock::now();
  if (budget_.IsKeptOut(peer.name, now)) return "it is kept out for a while, as was told";
  if (budget_.Admit(peer.name, now)) return "";
  return absl::StrCat("it makes more than ", PeerBudget::kConnections_per_s, " in a second");
}

bool Connections::HasRoom(const Slot& slot, const Peer& peer) const {
  const int free = limits_.all - static_cast<int>(open_.size());
  if (slot.open >= limits_.of_one_peer) return false;
  if (IsOwner(peer)) return free + limits_.reserve > 0;
  // A few peers leave room for the next, as FairShare does.
  return free > 0 && (slot.open == 0 || slot.open + 1 <= (free - 1) / 2);
}

void Connections::CountOpen() {
  counted_ = Clock::now();
  if (!open_.empty()) {
    const std::set<ino_t> sockets = OpenSockets();
    std::erase_if(open_, [&](const auto& connection) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      if (sockets.contains(connection.first)) return false;
      guard_.Remove(connection.first);
      --connection.second->open;
      connection.second->left = counted_;
      return true;
    });
  }
  open_now_ = static_cast<int>(open_.size());
  for (const auto& listener : listeners_) {
    for (Slot& slot : listener->slots) Notify(slot);
  }
}

void Connections::EndNoisy(double passed_s) {
  for (const ReceiveGuard::Ended& ended : guard_.Check()) {
    const auto connection = open_.find(ended.inode);
    if (connection == open_.end()) continue;
    ReportViolation(*connection->second, TextOf(ended.reason),
                    ended.reason == ReceiveGuard::Ended::kFlood ? PeerBudget::kMostViolations : 1);
  }
  for (const auto& listener : listeners_) {
    for (Slot& slot : listener->slots) EndRefused(slot, passed_s);
  }
}

void Connections::EndRefused(Slot& slot, double passed_s) {
  const int64_t refused = slot.check->refused();
  slot.refusals = std::max(0.0, slot.refusals - kRefusals_per_s * passed_s) +
                  static_cast<double>(refused - std::exchange(slot.refusals_before, refused));
  if (slot.refusals <= kMostRefusals || IsOwner(slot.peer)) return;
  slot.refusals = 0;
  ReportViolation(
      slot,
      absl::StrCat("more than ", kMostRefusals, " of its calls were refused; its connections were ended"),
      PeerBudget::kMostViolations);
}

void Connections::ReportViolation(const Slot& slot, const std::string& message, int offences) {
  const bool keeps_out = !IsOwner(slot.peer) && budget_.Violate(slot.peer.name, offences, Clock::now());
  if (keeps_out) {
    for (const auto& [inode, of] : open_) {
      if (of == &slot) guard_.End(inode);
    }
  }
  v1::AuditEntry entry;
  entry.set_peer(EscapedText(slot.peer.name));
  entry.set_outcome("ENDED");
  entry.set_message(message);
  if (keeps_out)
    absl::StrAppend(entry.mutable_message(), "; it is kept out for ", PeerBudget::kKeptOut.count(), " s");
  if (audit_.Refused(entry)) spdlog::warn("{}: {}", entry.peer(), entry.message());
}

void Connections::Notify(Slot& slot) {
  const auto tell = [this](const std::string& peer, int connections, const std::string& message) {
    v1::AuditEntry entry;
    entry.set_peer(EscapedText(peer));
    entry.set_outcome("REFUSED");
    entry.set_message(message);
    entry.set_times(connections);
    if (audit_.Refused(entry)) spdlog::warn("{} connections of {}: {}", connections, entry.peer(), message);
  };
  if (slot.refused > 0) {
    tell(slot.refused_peer, slot.refused, absl::StrCat("refused: ", slot.refused_why));
    slot.refused = 0;
  }
  if (slot.open > 0) return;
  const int asked = slot.check->connections();
  const int silent = slot.admitted - (asked - slot.asked_before);
  if (silent > 0)
    tell(slot.peer.name, silent, "ended without a call, which a failed TLS handshake does as well");
  slot.admitted = 0;
  slot.asked_before = asked;
}

}  // namespace weft

// Daemon: what its retention looks after.
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/server/daemon/program/daemon.h"
#include "services/server/daemon/program/daemon_parts.h"

namespace weft {
namespace {

RetentionSource SourceOf(std::set<v1::HoldingKind> kinds, std::function<std::vector<Holding>()> list,
                         std::function<absl::Status(const RetentionStep& step)> carry) {
  RetentionSource source;
  source.kinds = std::move(kinds);
  source.list = std::move(list);
  source.carry = std::move(carry);
  return source;
}

// Of jobs, or operations.
template <typename Queue>
RetentionSource SourceOfEnded(v1::HoldingKind kind, Queue& queue) {
  return SourceOf(
      {kind}, [&queue] { return queue.EndedHoldings(); },
      [&queue](const RetentionStep& step) { return queue.ForgetEnded(step.id, step.since_unix_ns); });
}

std::vector<Holding> HoldingsOf(const Uploads& uploads) {
  std::vector<Holding> holdings;
  for (const Uploads::Unfinished& one : uploads.ListUnfinished())
    holdings.push_back({v1::HOLDING_KIND_UPLOAD, one.upload_id, one.last_piece_unix_ns, one.bytes, false});
  return holdings;
}

std::vector<Holding> HoldingsOf(EndNotices& notices) {
  std::vector<Holding> holdings;
  for (const Outbox::Waits& one : notices.Waiting())
    holdings.push_back({v1::HOLDING_KIND_NOTICE, one.name, one.since_unix_ns, 0, false});
  return holdings;
}

uint64_t LeastFreeBytes(const v1::RetentionRules& rules) {
  constexpr double kBytesOfGib = 1024.0 * 1024 * 1024;
  return static_cast<uint64_t>(rules.least_free_gib() * kBytesOfGib);
}

}  // namespace

void Daemon::BeginRetention(const DaemonOptions& options) {
  Parts& parts = *parts_;
  Uploads& uploads = *parts.uploads;
  uploads.SetLeastFree(LeastFreeBytes(options.retention));
  RetentionKeeperOptions keeping;
  keeping.state_file = absl::StrCat(options.state_folder, "/retention.json");
  keeping.takes_folder = absl::StrCat(options.state_folder, "/takes");
  keeping.rules = options.retention;
  TakeStore& takes = *parts.take_store;
  RetentionSource jobs = SourceOfEnded(v1::HOLDING_KIND_JOB, *parts.queue);
  jobs.longest_pause = std::chrono::hours(1);  // all of them are read
  jobs.is_in_use = [&parts](const RetentionStep& step) { return parts.queue->IsInUse(step.id); };
  EndNotices& notices = *parts.notices;
  keeping.sources = {
      SourceOf(
          {v1::HOLDING_KIND_TAKE, v1::HOLDING_KIND_TRASH}, [&takes] { return takes.Holdings(); },
          [&takes](const RetentionStep& step) { return takes.Carry(step); }),
      jobs, SourceOfEnded(v1::HOLDING_KIND_OPERATION, *parts.operation_queue),
      SourceOf(
          {v1::HOLDING_KIND_UPLOAD}, [&uploads] { return HoldingsOf(uploads); },
          [&uploads](const RetentionStep& step) { return uploads.Abandon(step.id, step.since_unix_ns); }),
      SourceOf(
          {v1::HOLDING_KIND_NOTICE}, [&notices] { return HoldingsOf(notices); },
          [&notices](const RetentionStep& step) { return notices.GiveUp(step.id); })};
  parts.retention = std::make_unique<RetentionKeeper>(std::move(keeping), *parts.audit);
}

void Daemon::SetRetention(const v1::RetentionRules& rules) {
  parts_->retention->SetRules(rules);
  parts_->uploads->SetLeastFree(LeastFreeBytes(rules));
}

}  // namespace weft

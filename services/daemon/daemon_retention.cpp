// Daemon: what its retention looks after.
#include "services/daemon/daemon.h"
#include "services/daemon/daemon_parts.h"

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

RetentionSource SourceOfTakes(TakeKeeper& takes) {
  RetentionSource source;
  source.kinds = {v1::HOLDING_KIND_TAKE, v1::HOLDING_KIND_TRASH};
  source.list = [&takes] { return takes.Holdings(); };
  source.carry = [&takes](const RetentionStep& step) { return takes.Carry(step); };
  return source;
}

RetentionSource SourceOfJobs(JobQueue& queue) {
  RetentionSource source;
  source.kinds = {v1::HOLDING_KIND_JOB};
  source.longest_pause = std::chrono::hours(1);  // all of them are read
  source.list = [&queue] { return queue.EndedHoldings(); };
  source.is_in_use = [&queue](const RetentionStep& step) { return queue.IsInUse(step.id); };
  source.carry = [&queue](const RetentionStep& step) {
    return queue.ForgetEnded(step.id, step.since_unix_ns);
  };
  return source;
}

RetentionSource SourceOfOperations(OperationQueue& operations) {
  RetentionSource source;
  source.kinds = {v1::HOLDING_KIND_OPERATION};
  source.list = [&operations] { return operations.EndedHoldings(); };
  source.carry = [&operations](const RetentionStep& step) {
    return operations.ForgetEnded(step.id, step.since_unix_ns);
  };
  return source;
}

RetentionSource SourceOfUploads(Uploads& uploads) {
  RetentionSource source;
  source.kinds = {v1::HOLDING_KIND_UPLOAD};
  source.list = [&uploads] {
    std::vector<Holding> holdings;
    for (const Uploads::Unfinished& one : uploads.ListUnfinished())
      holdings.push_back({v1::HOLDING_KIND_UPLOAD, one.upload_id, one.last_piece_unix_ns, one.bytes, false});
    return holdings;
  };
  source.carry = [&uploads](const RetentionStep& step) {
    return uploads.Abandon(step.id, step.since_unix_ns);
  };
  return source;
}

RetentionSource SourceOfNotices(EndNotices& notices) {
  RetentionSource source;
  source.kinds = {v1::HOLDING_KIND_NOTICE};
  source.list = [&notices] {
    std::vector<Holding> holdings;
    for (const Outbox::Waits& one : notices.Waiting())
      holdings.push_back({v1::HOLDING_KIND_NOTICE, one.name, one.since_unix_ns, 0, false});
    return holdings;
  };
  source.carry = [&notices](const RetentionStep& step) { return notices.GiveUp(step.id); };
  return source;
}

uint64_t LeastFreeBytes(const RetentionRules& rules) {
  constexpr double kBytesOfGib = 1024.0 * 1024 * 1024;
  return static_cast<uint64_t>(rules.least_free_gib * kBytesOfGib);
}

}  // namespace

void Daemon::BeginRetention(const DaemonOptions& options) {
  Parts& parts = *parts_;
  Uploads& uploads = parts.library_service->uploads();
  uploads.SetLeastFree(LeastFreeBytes(options.retention));
  RetentionKeeperOptions keeping;
  keeping.state_file = absl::StrCat(options.state_folder, "/retention.json");
  keeping.takes_folder = absl::StrCat(options.state_folder, "/takes");
  keeping.rules = options.retention;
  keeping.sources = {SourceOfTakes(*parts.take_keeper), SourceOfJobs(*parts.queue),
                     SourceOfOperations(*parts.operation_queue), SourceOfUploads(uploads),
                     SourceOfNotices(*parts.notices)};
  parts.retention = std::make_unique<RetentionKeeper>(std::move(keeping), *parts.audit);
}

void Daemon::SetRetention(const RetentionRules& rules) {
  parts_->retention->SetRules(rules);
  parts_->library_service->uploads().SetLeastFree(LeastFreeBytes(rules));
}

}  // namespace weft

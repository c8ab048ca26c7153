#include "services/server/daemon/program/retention_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/json_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr double kDay_s = 24 * 3600;
constexpr size_t kMostDone = 100;

v1::RetentionState ReadState(const std::string& path) {
  v1::RetentionState state;
  const absl::Status status = ReadJsonFile(path, state);
  if (!status.ok() && !absl::IsNotFound(status)) {
    spdlog::warn("{}; ages count from now on", EscapedText(std::string(status.message())));
    state.Clear();
  }
  return state;
}

v1::RetentionStep InMessage(const RetentionStep& step) {
  v1::RetentionStep message;
  message.set_kind(step.kind);
  message.set_id(step.id);
  message.set_to_trash(step.to_trash);
  message.set_because(step.because);
  message.set_bytes(static_cast<int64_t>(step.bytes));
  message.set_due_in_s(step.due_in_s);
  return message;
}

// The least of what the rules keep of a source's kinds; what goes at once, or never, asks for no pace.
double LeastKept_s(const v1::RetentionRules& rules, const std::set<v1::HoldingKind>& kinds) {
  double least_s = kDay_s;
  for (const v1::HoldingKind kind : kinds) {
    const double kept_s = KeepDays(rules, kind).value_or(0) * kDay_s;
    if (kept_s > 0) least_s = std::min(least_s, kept_s);
  }
  return least_s;
}

}  // namespace

RetentionKeeper::RetentionKeeper(RetentionKeeperOptions options, AuditLog& audit)
    : options_(std::move(options)),
      audit_(audit),
      policy_(options_.rules, ReadState(options_.state_file)),
      worker_([this](const std::stop_token& stop) { Work(stop); }) {}

RetentionKeeper::~RetentionKeeper() {
  worker_.request_stop();
  worker_.join();
  const MutexLock lock(mutex_);
  PassTime();
  Save();
}

void RetentionKeeper::SetRules(const v1::RetentionRules& rules) {
  const MutexLock lock(mutex_);
  if (rules.SerializeAsString() == policy_.rules().SerializeAsString()) return;
  policy_.SetRules(rules);
  hurry_ = true;
  changed_.notify_all();
}

// The clocks are looked at every second: what happens just after a jump would be dated wrong.
void RetentionKeeper::PassTime() {
  const std::string told = policy_.PassTime(HostTime_ns(), MonotonicTime_ns());
  if (told.empty()) return;
  spdlog::warn("retention: {}", told);
  v1::AuditEntry entry;
  entry.set_caller("weftd");
  entry.set_method("Retention");
  entry.set_outcome("POSTPONED");
  entry.set_message(told);
  audit_.Record(std::move(entry));
  Save();
}

void RetentionKeeper::Save() {
  const absl::Status status = WriteJsonFile(options_.state_file, policy_.State());
  const std::string trouble(status.message());
  if (!trouble.empty() && trouble != save_trouble_) spdlog::warn("{}", EscapedText(trouble));
  save_trouble_ = trouble;
}

std::chrono::milliseconds RetentionKeeper::PauseOf(const RetentionSource& source) const {
  const double longest_s = std::chrono::duration<double>(source.longest_pause).count();
  const double pause_s = std::clamp(LeastKept_s(policy_.rules(), source.kinds) / 10, 0.2, longest_s);
  return std::chrono::milliseconds(static_cast<int64_t>(1000 * pause_s));
}

void RetentionKeeper::Work(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kTick{1000};
  constexpr std::chrono::seconds kSaveEvery{60};
  std::vector<Clock::time_point> next(options_.sources.size(), Clock::now());
  Clock::time_point save_at = Clock::now();
  MutexLock lock(mutex_);
  while (!stop.stop_requested()) {
    PassTime();
    if (std::exchange(hurry_, false)) std::ranges::fill(next, Clock::now());
    if (Clock::now() >= save_at) {
      Save();
      save_at = Clock::now() + kSaveEvery;
    }
    Clock::time_point wake = Clock::now() + kTick;
    for (size_t i = 0; i < next.size() && !stop.stop_requested(); ++i) {
      if (Clock::now() >= next[i]) {
        lock.unlock();
        Inspect(options_.sources[i], stop);
        lock.lock();
        next[i] = Clock::now() + PauseOf(options_.sources[i]);
      }
      wake = std::min(wake, next[i]);
    }
    changed_.wait_until(lock, stop, wake, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return hurry_; });
  }
}

uint64_t RetentionKeeper::FreeBytes() const {
  std::error_code error;
  const fs::space_info space = fs::space(options_.takes_folder, error);
  return error ? UINT64_MAX : space.available;
}

bool RetentionKeeper::Record(const RetentionStep& step, const absl::Status& status) {
  v1::AuditEntry entry;
  entry.set_caller("weftd");
  entry.set_method("Retention");
  (*entry.mutable_about())[HoldingWords(step.kind)] = step.id;
  (*entry.mutable_about())["to"] = step.to_trash ? "the trash" : "nothing, it is removed";
  if (step.bytes > 0) (*entry.mutable_about())["bytes"] = absl::StrCat(step.bytes);
  entry.set_outcome(absl::StatusCodeToString(status.code()));
  entry.set_message(EscapedText(status.ok() ? step.because : std::string(status.message())));
  return audit_.Record(std::move(entry));
}

// Once, for as long as it is so.
void RetentionKeeper::Report(const std::vector<std::string>& notes) {
  std::set<std::string> now;
  for (const std::string& note : notes) {
    std::string words = note;
    std::erase_if(words, [](char letter) { return letter >= '0' && letter <= '9'; });
    if (!told_.contains(words)) spdlog::warn("retention: {}", note);
    now.insert(std::move(words));
  }
  told_ = std::move(now);
}

void RetentionKeeper::Inspect(const RetentionSource& source, const std::stop_token& stop) {
  const std::vector<Holding> holdings = source.list();
  RetentionPlan plan;
  {
    const MutexLock lock(mutex_);
    PassTime();
    plan = policy_.Due(source.kinds, holdings, FreeBytes());
  }
  if (source.kinds.contains(v1::HOLDING_KIND_TAKE)) Report(plan.notes);
  for (const RetentionStep& step : plan.steps) {
    if (stop.stop_requested()) return;
    if (source.is_in_use(step)) continue;
    // What is not written down beforehand does not happen.
    if (!Record(step, absl::OkStatus())) return;
    const absl::Status status = source.carry(step);
    if (!status.ok()) {
      Record(step, status);
      spdlog::warn("{} {} stays: {}", HoldingWords(step.kind), EscapedText(step.id),
                   EscapedText(std::string(status.message())));
      continue;
    }
    spdlog::info("{} {} {}: {}", HoldingWords(step.kind), EscapedText(step.id),
                 step.to_trash ? "goes to the trash" : "is removed", step.because);
    const MutexLock lock(mutex_);
    done_.push_front(InMessage(step));
    if (done_.size() > kMostDone) done_.pop_back();
  }
}

v1::RetentionRehearsal RetentionKeeper::Rehearse(const v1::RetentionRules& asked, double ahead_days) {
  std::vector<Holding> holdings;
  for (const RetentionSource& source : options_.sources) {
    for (Holding& holding : source.list()) {
      RetentionStep step;
      step.kind = holding.kind;
      step.id = holding.id;
      holding.kept = holding.kept || source.is_in_use(step);
      holdings.push_back(std::move(holding));
    }
  }
  v1::RetentionRehearsal rehearsal;
  RetentionPlan plan;
  {
    const MutexLock lock(mutex_);
    PassTime();
    v1::RetentionRules rules = policy_.rules();
    rules.MergeFrom(asked);
    plan = policy_.Rehearse(rules, holdings, FreeBytes(), ahead_days * kDay_s);
    *rehearsal.mutable_rules() = rules;
    rehearsal.set_seen_days(policy_.seen_days());
    for (const v1::RetentionStep& step : done_) *rehearsal.add_done() = step;
  }
  for (const RetentionStep& step : plan.steps) *rehearsal.add_steps() = InMessage(step);
  for (const std::string& note : plan.notes) rehearsal.add_notes(note);
  return rehearsal;
}

}  // namespace weft

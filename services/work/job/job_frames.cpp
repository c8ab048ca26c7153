#include "services/work/job/job_frames.h"

#include <algorithm>

namespace weft {
namespace {

constexpr size_t kMaxLiveChunk = 4;
// A worker loads its inputs once per task, so a chunk is as long as balance allows: each worker gets this
// many.
constexpr size_t kChunksPerWorker = 4;

bool IsEnd(v1::FrameState state) {
  return state != v1::FRAME_STATE_WAITING && state != v1::FRAME_STATE_RUNNING;
}

}  // namespace

JobFrames::JobFrames(std::vector<v1::FrameInfo> frames)
    : infos_(std::move(frames)), taken_(infos_.size()), late_(infos_.size()), changed_(infos_.size()) {
  for (size_t i = 0; i < infos_.size(); ++i) {
    position_of_.emplace(infos_[i].frame(), i);
    // Watchers that begin now are told of every frame that is past waiting.
    if (infos_[i].state() != v1::FRAME_STATE_WAITING) Touch(i);
  }
}

std::optional<size_t> JobFrames::Find(const std::string& name) const {
  const auto found = position_of_.find(name);
  if (found == position_of_.end()) return std::nullopt;
  return found->second;
}

v1::FrameCounts JobFrames::Counts() const {
  v1::FrameCounts counts;
  counts.set_total(static_cast<int>(infos_.size()));
  int waiting = 0, running = 0, done = 0, degraded = 0, failed = 0, cancelled = 0, reused = 0, bridged = 0;
  for (const v1::FrameInfo& info : infos_) {
    waiting += info.state() == v1::FRAME_STATE_WAITING;
    running += info.state() == v1::FRAME_STATE_RUNNING;
    done += info.state() == v1::FRAME_STATE_DONE;
    degraded += info.state() == v1::FRAME_STATE_DEGRADED;
    failed += info.state() == v1::FRAME_STATE_FAILED;
    cancelled += info.state() == v1::FRAME_STATE_CANCELLED;
    reused += info.reused();
    bridged += info.bridged();
  }
  counts.set_waiting(waiting);
  counts.set_running(running);
  counts.set_done(done);
  counts.set_degraded(degraded);
  counts.set_failed(failed);
  counts.set_cancelled(cancelled);
  counts.set_reused(reused);
  counts.set_bridged(bridged);
  return counts;
}

bool JobFrames::CanBeTaken(size_t position) const {
  if (taken_[position] || infos_[position].state() != v1::FRAME_STATE_WAITING) return false;
  return !live_every_ || (*live_every_ > 0 && position % static_cast<size_t>(*live_every_) == 0);
}

bool JobFrames::HasWaiting() const {
  for (size_t i = 0; i < infos_.size(); ++i) {
    if (CanBeTaken(i)) return true;
  }
  return false;
}

void JobFrames::Append(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    v1::FrameInfo info;
    info.set_frame(name);
    info.set_state(v1::FRAME_STATE_WAITING);
    position_of_.emplace(name, infos_.size());
    infos_.push_back(std::move(info));
  }
  taken_.resize(infos_.size());
  late_.resize(infos_.size());
  changed_.resize(infos_.size());
}

void JobFrames::SetLive(std::optional<int> every) { live_every_ = every; }

int JobFrames::Backlog() const {
  if (!live_every_ || *live_every_ == 0) return 0;
  int backlog = 0;
  for (size_t i = 0; i < infos_.size(); i += static_cast<size_t>(*live_every_)) backlog += !IsProcessed(i);
  return backlog;
}

bool JobFrames::AllProcessed() const {
  return std::ranges::all_of(infos_, [](const v1::FrameInfo& info) { return IsEnd(info.state()); });
}

std::vector<size_t> JobFrames::TakeLiveChunk(int slots) {
  std::vector<size_t> newest;
  for (size_t i = infos_.size(); i-- > 0;) {
    if (CanBeTaken(i)) newest.push_back(i);
  }
  // A frame that comes while all workers are busy waits for the shortest task.
  const size_t share = newest.size() / static_cast<size_t>(std::max(1, slots));
  newest.resize(std::min(newest.size(), std::clamp<size_t>(share, 1, kMaxLiveChunk)));
  for (const size_t i : newest) taken_[i] = true;
  return newest;
}

std::vector<size_t> JobFrames::TakeChunk(int slots, ChunkLimits limits) {
  if (live_every_) return TakeLiveChunk(slots);
  std::vector<size_t> fresh, retried;
  for (size_t i = 0; i < infos_.size(); ++i) {
    if (!CanBeTaken(i)) continue;
    (infos_[i].attempts() > 0 || late_[i] ? retried : fresh).push_back(i);
  }
  const size_t chunks = slots <= 1 ? 1 : static_cast<size_t>(slots) * kChunksPerWorker;
  const size_t share = fresh.size() / chunks;
  fresh.resize(std::min(fresh.size(), std::clamp<size_t>(share, limits.least, limits.most)));
  if (fresh.empty() && !retried.empty()) fresh.push_back(retried.front());
  for (const size_t i : fresh) taken_[i] = true;
  return fresh;
}

std::vector<size_t> JobFrames::TakeAll() {
  std::vector<size_t> all;
  for (size_t i = 0; i < infos_.size(); ++i)
    if (CanBeTaken(i)) all.push_back(i);
  for (const size_t i : all) taken_[i] = true;
  return all;
}

void JobFrames::Take(size_t position) {
  taken_[position] = true;
  late_[position] = false;
}

void JobFrames::Start(size_t position) {
  v1::FrameInfo& info = infos_[position];
  info.set_state(v1::FRAME_STATE_RUNNING);
  info.set_attempts(info.attempts() + 1);
  info.set_share_done(0);
  Touch(position);
}

void JobFrames::Advance(size_t position, double share_done) {
  infos_[position].set_share_done(std::clamp(share_done, 0.0, 1.0));
  Touch(position);
}

void JobFrames::Finish(size_t position, const v1::FrameInfo& info) {
  v1::FrameInfo& own = infos_[position];
  const std::string name = own.frame();
  const int attempts = own.attempts();
  const double latency_s = own.latency_s();
  own = info;
  own.set_frame(name);
  own.set_attempts(attempts);
  own.set_latency_s(latency_s);
  own.set_share_done(1);
  taken_[position] = false;
  computed_ += !info.reused();
  Touch(position);
}

void JobFrames::SetLatency(size_t position, double latency_s) {
  infos_[position].set_latency_s(latency_s);
  Touch(position);
}

void JobFrames::ForgetRedone(size_t position) {
  infos_[position].clear_redone_from();
  infos_[position].clear_redone_because();
}

void JobFrames::Requeue(size_t position, Attempt attempt) {
  v1::FrameInfo& info = infos_[position];
  const bool ran = info.state() == v1::FRAME_STATE_RUNNING;
  if (ran && attempt != Attempt::kCounts) info.set_attempts(info.attempts() - 1);
  if (attempt == Attempt::kDaemonKilled) late_[position] = true;
  info.set_state(v1::FRAME_STATE_WAITING);
  info.set_share_done(0);
  taken_[position] = false;
  Touch(position);
}

void JobFrames::DoAgain(size_t position) {
  v1::FrameInfo fresh;
  fresh.set_frame(infos_[position].frame());
  fresh.set_latency_s(infos_[position].latency_s());
  fresh.set_state(v1::FRAME_STATE_WAITING);
  infos_[position] = std::move(fresh);
  Touch(position);
}

void JobFrames::End(size_t position, v1::FrameState state, const std::string& reason) {
  infos_[position].set_state(state);
  infos_[position].set_reason(reason);
  infos_[position].set_share_done(0);
  taken_[position] = false;
  Touch(position);
}

void JobFrames::Bridge(size_t position) {
  infos_[position].set_bridged(true);
  Touch(position);
}

bool JobFrames::IsProcessed(size_t position) const { return IsEnd(infos_[position].state()); }

void JobFrames::Touch(size_t position) {
  by_change_.erase(changed_[position]);
  changed_[position] = ++version_;
  by_change_[version_] = position;
}

JobFrames::Changes JobFrames::ChangedSince(uint64_t version, size_t limit) const {
  Changes changes;
  changes.up_to = version_;
  for (auto it = by_change_.upper_bound(version); it != by_change_.end(); ++it) {
    if (changes.positions.size() == limit) break;
    changes.positions.push_back(it->second);
    changes.up_to = it->first;
  }
  return changes;
}

double JobFrames::FramesComputed() const {
  double computed = computed_;
  for (const v1::FrameInfo& info : infos_) {
    if (info.state() == v1::FRAME_STATE_RUNNING) computed += info.share_done();
  }
  return computed;
}

double JobFrames::FramesLeft() const {
  double left = 0;
  for (const v1::FrameInfo& info : infos_) {
    if (info.state() == v1::FRAME_STATE_WAITING) left += 1;
    if (info.state() == v1::FRAME_STATE_RUNNING) left += 1 - info.share_done();
  }
  return left;
}

}  // namespace weft

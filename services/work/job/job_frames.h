// The frames of one job: which are waiting, running, dealt with. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "weft/v1/job.pb.h"

namespace weft {

// Runs of a frame whose worker ends abnormally before the frame is set aside.
inline constexpr int kMaxAttempts = 3;

// Frames that one worker gets at once.
struct ChunkLimits {
  size_t least = 1;
  size_t most = 16;
};

// Positions are those of the list that it was made from. Thread safety: none.
class JobFrames {
 public:
  explicit JobFrames(std::vector<v1::FrameInfo> frames);

  const std::vector<v1::FrameInfo>& infos() const { return infos_; }
  std::optional<size_t> Find(const std::string& name) const;
  v1::FrameCounts Counts() const;
  bool HasWaiting() const;
  bool AllProcessed() const;

  // The next frames for one of `slots` workers: many while many wait, few at the end so that no worker idles,
  // within the limits. A frame whose worker crashed comes last and alone. Empty when none waits. The frames
  // count as taken until they end or are given back.
  std::vector<size_t> TakeChunk(int slots, ChunkLimits limits = {});

  // All that wait, in order: for jobs whose frames follow each other.
  std::vector<size_t> TakeAll();

  // Has this frame taken as by TakeChunk, which must be waiting: a task that runs already has it.
  void Take(size_t position);

  void Start(size_t position);
  void Advance(size_t position, double share_done);
  // Takes over state, reason and figures; attempts stay.
  void Finish(size_t position, const v1::FrameInfo& info);
  void SetLatency(size_t position, double latency_s);
  void ForgetRedone(size_t position);
  // Back to waiting. A refunded attempt does not count against the frame. One that ran when the daemon itself
  // was killed comes after the others and alone, in case that it was the cause.
  enum class Attempt { kCounts, kRefunded, kDaemonKilled };
  void Requeue(size_t position, Attempt attempt);
  // Frames that came to the take.
  void Append(const std::vector<std::string>& names);
  // Of a take that is being recorded: TakeChunk gives every so-manieth frame, the newest first and few at a
  // time; with 0 it gives none, without a value all as usual.
  void SetLive(std::optional<int> every);
  // Those that TakeChunk gives and that have no result yet.
  int Backlog() const;

  // Back to waiting after it was dealt with, as if it had never run: its results are gone.
  void DoAgain(size_t position);
  // Ends it without a result.
  void End(size_t position, v1::FrameState state, const std::string& reason);
  // The results hold a mesh for this failed frame after all.
  void Bridge(size_t position);
  bool IsProcessed(size_t position) const;

  // Counts up with every change; ChangedSince lists at most `limit` frames in the order of their changes.
  uint64_t version() const { return version_; }
  struct Changes {
    std::vector<size_t> positions;
    uint64_t up_to = 0;  // the version that a reader of these frames has seen
  };
  Changes ChangedSince(uint64_t version, size_t limit) const;

  // Work computed since this object was made, in frames, with parts of running ones; and what is left.
  double FramesComputed() const;
  double FramesLeft() const;

 private:
  void Touch(size_t position);
  // Neither taken nor held back until the take has ended.
  bool CanBeTaken(size_t position) const;
  std::vector<size_t> TakeLiveChunk(int slots);

  std::vector<v1::FrameInfo> infos_;
  std::vector<bool> taken_;
  std::vector<bool> late_;                // taken after the others and alone
  std::vector<uint64_t> changed_;         // [frames], the version of the last change, 0 for none
  std::map<uint64_t, size_t> by_change_;  // the reverse
  std::map<std::string, size_t> position_of_;
  std::optional<int> live_every_;
  uint64_t version_ = 0;
  int computed_ = 0;
};

}  // namespace weft

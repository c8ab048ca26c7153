// Images of the frames at hand, copied from a shared file system to a disk of this machine.
#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "capture/take/frame_source.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

struct ScratchOptions {
  std::string folder;        // of this machine alone; made where it is missing
  uint64_t quota_bytes = 0;  // of the copies of one process
};

// A source whose views of held frames come from copies; all others come from where they lie. Copies end with
// the object. Those of a process that was killed are removed by the next one that uses the folder: a lock
// says who lives. Thread safety: Hold is called by one thread, while no other reads.
class ScratchFrames : public FrameSource {
 public:
  // ResourceExhausted: no room. PermissionDenied, Unavailable: the folder cannot be used. Names it.
  static absl::StatusOr<std::unique_ptr<ScratchFrames>> Create(std::unique_ptr<FrameSource> shared,
                                                               size_t cameras, ScratchOptions options);
  ~ScratchFrames() override;

  // Has copies of frame `index`, and begins to copy `next` in the background where the quota has room for
  // both; removes those of other frames. What cannot be read is left to ReadView. FailedPrecondition: the
  // frame is larger than the quota. ResourceExhausted: the disk is full; copies of the frame are removed.
  // Otherwise errors of PosixFile.
  absl::Status Hold(size_t index, std::optional<size_t> next);
  // Bytes of all copies now.
  uint64_t bytes_held() const;

  const std::vector<std::string>& frame_names() const override { return shared_->frame_names(); }
  absl::StatusOr<FrameSet> Read(size_t index) const override { return shared_->Read(index); }
  absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const override;
  std::optional<int64_t> ViewTime_ns(size_t index, size_t camera) const override {
    return shared_->ViewTime_ns(index, camera);
  }
  std::optional<int64_t> FrameTime_ns(size_t index) const override { return shared_->FrameTime_ns(index); }
  absl::StatusOr<std::string> Fingerprint(size_t index) const override { return shared_->Fingerprint(index); }
  const std::vector<std::string>& warnings() const override { return shared_->warnings(); }
  std::vector<std::string> unknown_cameras() const override { return shared_->unknown_cameras(); }

 private:
  struct Copy {
    std::string path;
    StoredView from;
  };
  struct Views {
    std::vector<std::pair<size_t, StoredView>> views;  // camera, place
    uint64_t bytes = 0;
  };

  ScratchFrames(std::unique_ptr<FrameSource> shared, size_t cameras, ScratchOptions options,
                std::string folder, UniqueFd lock);
  Views ViewsOf(size_t index) const;
  absl::Status CopyFrame(size_t index, const Views& views);
  void Drop(size_t index);

  const std::unique_ptr<FrameSource> shared_;
  const size_t cameras_;
  const ScratchOptions options_;
  const std::string folder_;
  const UniqueFd lock_;  // held as long as the folder stands

  mutable Mutex mutex_;
  std::map<size_t, std::map<size_t, Copy>> copies_ ABSL_GUARDED_BY(mutex_);  // by frame, by camera
  std::optional<size_t> ahead_;                                              // the frame that is being copied
  std::future<absl::Status> copied_ahead_;
};

}  // namespace weft

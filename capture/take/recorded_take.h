// Takes that were recorded here, as a source of frame sets: raw and exact, or as the stages want them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/sync/ledger.h"
#include "capture/take/frame_source.h"
#include "capture/take/stream_reader.h"

namespace weft {

// Thread safety: const functions may be called from any number of threads.
class RecordedTake {
 public:
  // Opens streams and ledger. A take that was not closed has the frame sets that its index knows, and
  // warnings() say how to get the rest. Errors of StreamReader; InvalidArgument: streams of different takes.
  static absl::StatusOr<std::unique_ptr<RecordedTake>> Open(const std::string& folder);

  // Numbers of the frame sets of which any stream knows, in order.
  const std::vector<uint64_t>& sets() const { return sets_; }
  const std::vector<std::string>& camera_ids() const { return camera_ids_; }
  const std::vector<LedgerEntry>& ledger() const { return ledger_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  uint64_t take() const { return streams_.front()->header().take; }

  // One camera's frame of the set at `index`, as it was recorded. OutOfRange: no such set or camera.
  // NotFound: the camera had no frame, the message is the reason. DataLoss: it is damaged.
  absl::StatusOr<RawFrame> ReadRaw(size_t index, size_t camera) const;
  // All cameras; damaged frames are listed as missing.
  absl::StatusOr<RawFrameSet> ReadSet(size_t index) const;
  // What the index says of it; null where the stream does not know the set.
  const IndexRecord* Record(size_t index, size_t camera) const;
  const StreamReader& stream(size_t camera) const { return *streams_[camera]; }

 private:
  RecordedTake() = default;
  void ReadLedger(const std::string& folder);
  void MergeSets();

  std::vector<std::string> camera_ids_;
  std::vector<std::unique_ptr<StreamReader>> streams_;  // of each camera
  std::vector<uint64_t> sets_;
  std::vector<LedgerEntry> ledger_;
  std::vector<std::string> warnings_;
};

// Name of a frame set: its number with four digits at least.
std::string FrameNameOf(uint64_t set);

// A recorded take as the stages read it, in the order of the rig's cameras.
class RecordedTakeDump : public FrameSource {
 public:
  // InvalidArgument: no frame set, or no camera of the rig.
  static absl::StatusOr<std::unique_ptr<RecordedTakeDump>> Open(const std::string& folder, const Rig& rig);

  const std::vector<std::string>& frame_names() const override { return frame_names_; }
  absl::StatusOr<FrameSet> Read(size_t index) const override;
  absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const override;
  absl::StatusOr<StoredView> Locate(size_t index, size_t camera) const override;
  absl::StatusOr<Frame> ReadCopy(const std::string& copy, size_t index, size_t camera) const override;
  // Of takes made of videos, whose times compare.
  std::optional<int64_t> ViewTime_ns(size_t index, size_t camera) const override;
  std::optional<int64_t> FrameTime_ns(size_t index) const override;
  // Over numbers, sizes and checksums of the frames, and those that observations are moved by.
  absl::StatusOr<std::string> Fingerprint(size_t index) const override;
  const std::vector<std::string>& warnings() const override { return warnings_; }
  std::vector<std::string> unknown_cameras() const override { return unknown_cameras_; }

 private:
  RecordedTakeDump() = default;
  void ReadSetTimes();
  // Null where the camera of the rig has none.
  const IndexRecord* RecordOf(size_t index, size_t camera) const;
  // The stream of a camera of the rig. Errors of ReadView.
  absl::StatusOr<size_t> StreamOf(size_t index, size_t camera) const;
  absl::StatusOr<Frame> AsRigHasIt(const absl::StatusOr<RawFrame>& raw, size_t index, size_t camera) const;

  Rig rig_;
  std::unique_ptr<RecordedTake> take_;
  std::vector<int> stream_of_camera_;  // of the rig; -1 where the take has none
  std::vector<std::string> frame_names_;
  std::vector<std::optional<int64_t>> set_times_ns_;  // of each frame; empty where times do not compare
  std::vector<std::string> warnings_, unknown_cameras_;
};

}  // namespace weft

#include "services/formats/synthetic/cloth_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/self_intersection.h"
#include "base/median.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "capture/file/checksum.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/little_endian.h"
#include "services/formats/synthetic/frames_file.h"
#include "services/formats/synthetic/studio_files.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

constexpr double kSaveEveryS = 60;

// frames.bin while it grows, and beside it the cloth's state after a number of frames.
class GrowingFrames {
 public:
  explicit GrowingFrames(const TakeFolder& folder)
      : final_(folder.FramesFile()), part_(final_ + ".part"), state_(final_ + ".state") {}

  absl::Status Begin(const FramesHead& head) {
    head_ = head;
    frames_ = 0;
    RemoveFile(state_);
    return Open(EncodeFramesHead(head));
  }

  // Takes up what was saved; empty where there is nothing to go on from.
  std::optional<std::string> TakeUp() {
    absl::StatusOr<std::string> saved = ReadWholeFile(state_);
    if (!saved.ok() || saved->size() < kStateHeadBytes) return std::nullopt;
    std::string_view rest = *saved;
    const auto checksum = TakeLittleEndian<uint64_t>(rest);
    if (checksum != Checksum(rest.data(), rest.size())) return std::nullopt;
    const auto frames = TakeLittleEndian<uint32_t>(rest);
    const absl::StatusOr<FramesReader> reader = FramesReader::Open(part_, true);
    if (!reader.ok() || reader->frames() < static_cast<int>(frames)) return std::nullopt;
    head_ = reader->head();
    frames_ = static_cast<int>(frames);
    if (!Open({}).ok()) return std::nullopt;
    const auto bytes = FramesHeadBytes(head_) + ClothFrameBytes(head_) * frames;
    if (ftruncate(file_.get(), static_cast<off_t>(bytes)) != 0) return std::nullopt;
    if (lseek(file_.get(), 0, SEEK_END) < 0) return std::nullopt;
    return std::string(rest);
  }

  absl::Status Add(const ClothFrame& frame) {
    const std::string bytes = EncodeClothFrame(head_, frame);
    if (const int error = WriteAll(file_.get(), bytes); error != 0) return WriteError(part_, error);
    ++frames_;
    return absl::OkStatus();
  }

  absl::Status Save(const std::string& state) {
    if (fdatasync(file_.get()) != 0) return WriteError(part_, errno);
    std::string bytes;
    PutLittleEndian(static_cast<uint32_t>(frames_), bytes);
    bytes += state;
    std::string head;
    PutLittleEndian(Checksum(bytes.data(), bytes.size()), head);
    return WriteFileAtomically(state_, head + bytes);
  }

  absl::Status Finish() {
    if (fdatasync(file_.get()) != 0 || rename(part_.c_str(), final_.c_str()) != 0)
      return WriteError(final_, errno);
    RemoveFile(state_);
    return absl::OkStatus();
  }

  int frames() const { return frames_; }
  const FramesHead& head() const { return head_; }

 private:
  static constexpr size_t kStateHeadBytes = 12;

  absl::Status Open(const std::string& start) {
    const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (start.empty() ? 0 : O_TRUNC);
    file_ = UniqueFd(open(part_.c_str(), flags, 0666));
    if (file_.get() < 0) return WriteError(part_, errno);
    if (const int error = WriteAll(file_.get(), start); error != 0) return WriteError(part_, error);
    return absl::OkStatus();
  }

  std::string final_, part_, state_;
  UniqueFd file_;
  FramesHead head_;
  int frames_ = 0;
};

FramesHead HeadOf(const SyntheticTake& take) {
  FramesHead out;
  out.template_hash = take.garment().ContentHash();
  out.vertices = static_cast<uint32_t>(take.garment().rest.vertices_mm.size());
  out.fps = take.options().performance.fps;
  out.has_pose = take.options().performance.clip != nullptr;
  return out;
}

absl::Status CheckWhole(const SyntheticTake& take, const PerformanceFrame& frame, int index) {
  const double stretch = MedianStretch(take.garment().rest, frame.vertices_mm);
  if (stretch <= kTornStretch) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(
      "frame ", index, ": the simulation broke down, half of the cloth's edges are off their length by ",
      std::lround(100 * stretch), " % and more; take a slower motion or other cells"));
}

}  // namespace

double MedianStretch(const TriangleMesh& rest, const std::vector<Eigen::Vector3d>& vertices_mm) {
  std::vector<double> stretch;
  for (const Face& face : rest.faces)
    for (size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<size_t>(face[k]), b = static_cast<size_t>(face[(k + 1) % 3]);
      const double length = (rest.vertices_mm[a] - rest.vertices_mm[b]).norm();
      if (length > 0) stretch.push_back(std::abs((vertices_mm[a] - vertices_mm[b]).norm() / length - 1));
    }
  return Median(std::move(stretch));
}

absl::StatusOr<ClothSummary> WriteClothTake(const SyntheticTakeOptions& options, const TakeFolder& folder,
                                            const std::function<void(double)>& on_dress,
                                            const std::function<void(int)>& on_frame,
                                            const std::stop_token& stop) {
  GrowingFrames file(folder);
  absl::StatusOr<SyntheticTake> take = absl::UnavailableError("no take was made yet");
  if (const std::optional<std::string> state = file.TakeUp()) take = SyntheticTake::Resume(options, *state);
  ClothSummary out;
  if (take.ok() && take->next() == file.frames()) {
    out.resumed_at = file.frames();
  } else {
    // What was saved by another build is made again; it would be the same.
    take = SyntheticTake::Make(options, on_dress);
    if (!take.ok()) return take.status();
    WEFT_RETURN_IF_ERROR(WriteStudio(*take, folder.path()));
    WEFT_RETURN_IF_ERROR(file.Begin(HeadOf(*take)));
  }
  out.frames = take->frames();
  out.vertices = static_cast<int>(file.head().vertices);
  out.bytes_per_frame = ClothFrameBytes(file.head());
  Stopwatch since_saved;
  const auto save = [&]() -> absl::Status {
    if (file.frames() == 0) return absl::OkStatus();
    since_saved = Stopwatch();
    const absl::StatusOr<std::string> state = take->SaveState();
    if (absl::IsUnimplemented(state.status())) return absl::OkStatus();  // then it begins anew
    return state.ok() ? file.Save(*state) : state.status();
  };
  while (file.frames() < take->frames()) {
    if (stop.stop_requested()) {
      WEFT_RETURN_IF_ERROR(save());
      return absl::CancelledError(
          absl::StrCat("stopped after ", file.frames(), " frames; the same command resumes it"));
    }
    WEFT_ASSIGN_OR_RETURN(PerformanceFrame frame, take->NextCloth());
    WEFT_RETURN_IF_ERROR(CheckWhole(*take, frame, file.frames()));
    if (!FindIntersectingPairs(frame.vertices_mm, take->garment().rest.faces).empty())
      ++out.intersecting_frames;
    absl::Status status = file.Add({frame.time_ns, std::move(frame.vertices_mm), frame.pose});
    if (status.ok() && since_saved.Seconds() > kSaveEveryS) status = save();
    if (!status.ok()) return status;
    if (on_frame) on_frame(file.frames());
  }
  WEFT_RETURN_IF_ERROR(file.Finish());
  return out;
}

}  // namespace weft

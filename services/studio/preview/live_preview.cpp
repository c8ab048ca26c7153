#include "services/studio/preview/live_preview.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/image/thumbnail.h"
#include "pattern/board/board_index.h"
#include "pattern/decoder.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/thread_priority.h"
#include "services/studio/preview/coverage_picture.h"
#include "services/studio/preview/preview_page.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kLowestPriority = 19;
constexpr size_t kMinCells = 50;  // that say where the cloth is

// A part of a picture; even, so that mosaics keep their order.
struct Box {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};

// Around the middle 80 % of the cells along each axis.
std::optional<Box> BoxOf(const std::vector<Observation>& observations) {
  if (observations.size() < kMinCells) return std::nullopt;
  std::vector<double> x_px, y_px;
  for (const Observation& observation : observations) {
    x_px.push_back(observation.x_px);
    y_px.push_back(observation.y_px);
  }
  std::ranges::sort(x_px);
  std::ranges::sort(y_px);
  const size_t low = x_px.size() / 10, high = x_px.size() - 1 - low;
  const auto even = [](double px) { return std::max(0, static_cast<int>(px) / 2 * 2); };
  return Box{even(x_px[low]), even(y_px[low]), even(x_px[high] - x_px[low]) + 2,
             even(y_px[high] - y_px[low]) + 2};
}

// Nothing where the box is not within the picture.
std::optional<Frame> Cut(const Frame& frame, const Box& box) {
  if (box.left_px + box.width_px > frame.width_px || box.top_px + box.height_px > frame.height_px)
    return std::nullopt;
  const auto bytes = static_cast<size_t>(BytesPerPixel(frame.format));
  const size_t line = static_cast<size_t>(box.width_px) * bytes;
  std::vector<uint8_t> pixels(line * static_cast<size_t>(box.height_px));
  for (int y = 0; y < box.height_px; ++y)
    std::memcpy(&pixels[static_cast<size_t>(y) * line],
                frame.row(box.top_px + y) + static_cast<size_t>(box.left_px) * bytes, line);
  Frame part = frame;
  part.width_px = box.width_px;
  part.height_px = box.height_px;
  part.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
  return part;
}

std::vector<std::pair<int, int>> CellsOf(const std::optional<Template>& garment) {
  std::vector<std::pair<int, int>> cells;
  if (!garment) return cells;
  for (const VertexNode& cell : garment->node_of_vertex)
    if (cell.IsCell()) cells.emplace_back(cell.row, cell.col);
  return cells;
}

}  // namespace

absl::Status LivePreviewOptions::Validate() const {
  if (folder.empty()) return absl::InvalidArgumentError("the preview needs a folder");
  if (!(interval_s >= 0.1)) return absl::InvalidArgumentError("previews must be at least 0.1 s apart");
  if (thumbnail_px < 16 || thumbnail_px > 4096)
    return absl::InvalidArgumentError("pictures of the preview must be 16 to 4096 px wide");
  if (decoded_views < 0)
    return absl::InvalidArgumentError("the number of decoded views must not be negative");
  if (garment && !board) return absl::InvalidArgumentError("coverage of a garment needs its board");
  return absl::OkStatus();
}

class LivePreview::Impl {
 public:
  Impl(const LivePreviewOptions& options, std::optional<BoardIndex> board)
      : options_(options), board_(std::move(board)) {
    if (board_) coverage_.emplace(options_.board->rows, options_.board->cols, CellsOf(options_.garment));
  }
  ~Impl() { static_cast<void>(End(Ending::kNow)); }

  absl::Status Start() {
    WEFT_RETURN_IF_ERROR(CreateFolders(options_.folder));
    WEFT_RETURN_IF_ERROR(Write(PreviewPage{}));
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  void Offer(const RawFrameSet& set) {
    const MutexLock lock(mutex_);
    passed_over_ += newest_.has_value();
    newest_ = set;  // the bytes are shared
    changed_.notify_all();
  }

  void Describe(std::string state) {
    const MutexLock lock(mutex_);
    state_ = std::move(state);
  }

  enum class Ending { kNone, kNow, kAfterLastSet };
  absl::Status End(Ending ending) {
    {
      const MutexLock lock(mutex_);
      ending_ = ending;
    }
    changed_.notify_all();
    if (thread_.joinable()) {
      thread_.join();
      last_.is_over = true;
      const absl::Status written = Write(last_);
      const MutexLock lock(mutex_);
      status_.Update(written);
    }
    const MutexLock lock(mutex_);
    return status_;
  }

 private:
  void Run() {
    YieldToOthers(kLowestPriority);
    while (true) {
      MutexLock lock(mutex_);
      changed_.wait(
          lock, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return newest_ || ending_ != Ending::kNone; });
      if (!newest_ || ending_ == Ending::kNow) return;
      const RawFrameSet set = *std::exchange(newest_, std::nullopt);
      const uint64_t passed_over = std::exchange(passed_over_, 0);
      lock.unlock();
      const Clock::time_point begin = Clock::now();
      last_ = MakePage(set);
      last_.passed_over = passed_over;
      const absl::Status written = Write(last_);
      lock.lock();
      status_.Update(written);
      const auto interval =
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.interval_s));
      const Clock::time_point next = begin + std::max(interval, 2 * (Clock::now() - begin));
      changed_.wait_until(lock, next, [&] { return ending_ != Ending::kNone; });
    }
  }

  absl::Status Write(PreviewPage page) {
    page.title = options_.title;
    page.refresh_s = options_.interval_s;
    page.made_unix_ms = HostTime_ns() / 1'000'000;
    {
      const MutexLock lock(mutex_);
      page.state = state_;
    }
    return WriteFileAtomically((std::filesystem::path(options_.folder) / "index.html").string(),
                               PreviewHtml(page));
  }

  PreviewPage MakePage(const RawFrameSet& set) {
    PreviewPage page;
    page.set = set.number;
    const std::vector<size_t> decoded = NextToDecode(set);
    for (size_t i = 0; i < set.frames.size(); ++i)
      page.cameras.push_back(Look(set.frames[i], std::ranges::find(decoded, i) != decoded.end()));
    for (const MissingFrame& missing : set.missing) {
      page.cameras.emplace_back();
      page.cameras.back().id = missing.camera_id;
      page.cameras.back().missing = missing.reason;
    }
    std::ranges::sort(page.cameras,
                      [](const PreviewCamera& a, const PreviewCamera& b) { return NaturalLess(a.id, b.id); });
    if (coverage_) page.coverage = DescribeCoverage();
    return page;
  }

  // Those that were decoded longest ago.
  std::vector<size_t> NextToDecode(const RawFrameSet& set) {
    std::vector<size_t> order;
    if (!board_) return order;
    for (size_t i = 0; i < set.frames.size(); ++i) order.push_back(i);
    std::ranges::stable_sort(order, [&](size_t a, size_t b) {
      return decoded_at_[set.frames[a].camera_id] < decoded_at_[set.frames[b].camera_id];
    });
    order.resize(std::min(order.size(), static_cast<size_t>(options_.decoded_views)));
    return order;
  }

  PreviewCamera Look(const RawFrame& raw, bool decodes) {
    PreviewCamera camera;
    camera.id = raw.camera_id;
    const absl::StatusOr<Frame> frame = ToFrame(raw);
    absl::StatusOr<Frame> thumbnail = frame.ok() ? Thumbnail(*frame, options_.thumbnail_px) : frame;
    if (!thumbnail.ok()) {
      camera.missing = std::string(thumbnail.status().message());
      return camera;
    }
    camera.thumbnail = *std::move(thumbnail);
    if (decodes && ending_ != Ending::kNow) Decode(*frame, camera.id);
    if (coverage_) camera.cells = coverage_->CellsOf(camera.id);
    const auto cloth = cloth_.find(camera.id);
    const std::optional<Frame> part = cloth != cloth_.end() ? Cut(*frame, cloth->second) : std::nullopt;
    camera.is_cloth = part.has_value();
    camera.quality = MeasurePicture(part ? *part : *frame);
    double& best = best_focus_[{camera.id, camera.is_cloth}];
    best = std::max(best, camera.quality.focus);
    camera.best_focus = best;
    return camera;
  }

  void Decode(const Frame& frame, const std::string& camera) {
    decoded_at_[camera] = ++decodings_;
    DecodeOptions decode;
    decode.corners = false;
    const absl::StatusOr<DecodeResult> result = DecodeView(frame, *board_, decode);
    if (!result.ok()) return;  // grey cameras
    coverage_->Set(camera, result->observations);
    cloth_.erase(camera);
    if (const std::optional<Box> box = BoxOf(result->observations)) cloth_.emplace(camera, *box);
  }

  PreviewCoverage DescribeCoverage() const {
    PreviewCoverage coverage;
    coverage.cells = coverage_->Count();
    coverage.cameras = coverage_->cameras();
    if (options_.garment) {
      absl::StatusOr<std::vector<MeshPicture>> painted = PaintGarment(*options_.garment, *coverage_);
      if (painted.ok()) coverage.pictures = *std::move(painted);
    }
    if (coverage.pictures.empty()) coverage.pictures.push_back(PaintBoard(*coverage_));
    return coverage;
  }

  const LivePreviewOptions options_;
  const std::optional<BoardIndex> board_;
  // Of the thread, and after it of End.
  std::optional<Coverage> coverage_;
  std::map<std::string, Box> cloth_;  // where cells were read last, by camera
  std::map<std::string, uint64_t> decoded_at_;
  uint64_t decodings_ = 0;
  std::map<std::pair<std::string, bool>, double> best_focus_;  // by camera, and whether of the cloth
  PreviewPage last_;
  std::thread thread_;
  std::atomic<Ending> ending_ = Ending::kNone;

  mutable Mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<RawFrameSet> newest_ ABSL_GUARDED_BY(mutex_);
  uint64_t passed_over_ ABSL_GUARDED_BY(mutex_) = 0;
  std::string state_ ABSL_GUARDED_BY(mutex_);
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
};

LivePreview::LivePreview(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LivePreview::~LivePreview() = default;

absl::StatusOr<std::unique_ptr<LivePreview>> LivePreview::Start(const LivePreviewOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  std::optional<BoardIndex> board;
  if (options.board) {
    WEFT_ASSIGN_OR_RETURN(board, BoardIndex::Build(*options.board));
  }
  auto impl = std::make_unique<Impl>(options, std::move(board));
  WEFT_RETURN_IF_ERROR(impl->Start());
  return std::unique_ptr<LivePreview>(new LivePreview(std::move(impl)));
}

void LivePreview::Offer(const RawFrameSet& set) { impl_->Offer(set); }
void LivePreview::Describe(std::string state) { impl_->Describe(std::move(state)); }
absl::Status LivePreview::Stop() { return impl_->End(Impl::Ending::kNow); }
absl::Status LivePreview::Finish() { return impl_->End(Impl::Ending::kAfterLastSet); }

}  // namespace weft

#include "services/work/pipeline/frame_cloud.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/stopwatch.h"
#include "capture/file/content_hash.h"
#include "capture/image/image_size.h"
#include "pattern/decoder.h"
#include "services/work/pipeline/stage_reports.h"
#include "triangulation/clean.h"
#include "triangulation/footprint.h"
#include "triangulation/rejected_rays.h"

namespace weft {
namespace {

// A sixteenth of the rows tells pictures apart: noise is in each of them.
std::string HashOfPixels(const Frame& frame) {
  constexpr int kStep = 16;
  const size_t row_bytes = static_cast<size_t>(frame.width_px) * BytesPerPixel(frame.format);
  ContentHash hash;
  for (int y = 0; y < frame.height_px; y += kStep)
    hash.Add({reinterpret_cast<const char*>(frame.row(y)), row_bytes});
  return hash.Hex();
}

void DescribeSizes(const WrongSize& sizes, v1::ViewReport& report) {
  report.mutable_image_size()->set_width_px(sizes.found.width_px);
  report.mutable_image_size()->set_height_px(sizes.found.height_px);
  report.mutable_rig_size()->set_width_px(sizes.expected.width_px);
  report.mutable_rig_size()->set_height_px(sizes.expected.height_px);
}

// The decoder of a view, after its first pass; null where it has no usable image, and the report says why.
std::unique_ptr<ViewDecoder> DecodeCamera(const FrameImages& images, const DecodeOptions& options,
                                          size_t camera, v1::ViewReport& report) {
  const Stopwatch watch;
  const absl::StatusOr<Frame> frame = images.dump.ReadView(images.index, camera);
  report.set_read_ms(watch.Ms());
  if (!frame.ok()) {
    report.set_missing_reason(std::string(frame.status().message()));
    if (const std::optional<WrongSize> sizes = WrongSizeOf(frame.status())) DescribeSizes(*sizes, report);
    return nullptr;
  }
  report.set_image_hash(HashOfPixels(*frame));
  absl::StatusOr<std::unique_ptr<ViewDecoder>> view = ViewDecoder::Read(*frame, images.board, options);
  if (!view.ok()) {
    const std::string why(view.status().message());
    report.set_missing_reason(absl::StartsWith(why, frame->origin) ? why
                                                                   : absl::StrCat(frame->origin, ": ", why));
    return nullptr;
  }
  (*view)->Decode();
  return *std::move(view);
}

}  // namespace

DecodedFrame DecodeFrame(Computes<Stage::kDecode>, const FrameImages& images, const DecodeOptions& options,
                         std::optional<size_t> kept_image_bytes, const FrameProgress& progress,
                         const std::stop_token& stop) {
  const size_t cameras = images.rig.cameras.size();
  DecodedFrame frame{std::vector<ViewObservations>(cameras), std::vector<v1::ViewReport>(cameras),
                     std::vector<std::unique_ptr<ViewDecoder>>(cameras)};
  std::atomic<size_t> done = 0, kept_bytes = 0;
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, cameras, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t camera = range.begin(); camera < range.end(); ++camera) {
          if (stop.stop_requested()) return;
          v1::ViewReport& report = frame.reports[camera];
          report.set_camera(images.rig.cameras[camera].id);
          frame.views[camera].camera = static_cast<int>(camera);
          if (std::unique_ptr<ViewDecoder> view = DecodeCamera(images, options, camera, report)) {
            DecodeResult result = view->TakeResult();
            DescribeDecoding(result, report);
            frame.views[camera].observations = std::move(result.observations);
            if (kept_image_bytes) {
              const size_t bytes = view->image_bytes();
              const bool keeps_image = kept_bytes.fetch_add(bytes) + bytes <= *kept_image_bytes;
              if (!keeps_image) kept_bytes -= bytes;
              view->Rest(keeps_image);
              frame.decoders[camera] = std::move(view);
            }
          }
          if (progress) progress(static_cast<double>(++done) / static_cast<double>(cameras));
        }
      },
      tbb::simple_partitioner());
  return frame;
}

absl::StatusOr<Cloud> TriangulateFrame(Computes<Stage::kTriangulate>, const Rig& rig,
                                       const std::vector<double>& camera_sigma_px,
                                       const std::vector<ViewObservations>& views,
                                       const CloudOptions& options) {
  TriangulationOptions triangulation = options.triangulation;
  triangulation.refinement.camera_sigma_px = camera_sigma_px;
  absl::StatusOr<Cloud> cloud = Triangulate(rig, views, triangulation);
  if (!cloud.ok()) return cloud;
  cloud = SharpenCenters(CleanCloud(*std::move(cloud), options.cleaning), options.footprint);
  cloud->rays = RaysOfRejected(rig, views, *cloud, triangulation.refinement);
  return cloud;
}

std::string NoCloudReason(const std::vector<ViewObservations>& views,
                          const std::vector<v1::ViewReport>& reports, int min_views) {
  size_t seen = 0, used = 0;
  for (const ViewObservations& view : views) seen += view.observations.size();
  std::string missing;  // the first reason
  for (const v1::ViewReport& report : reports) {
    used += report.missing_reason().empty();
    if (missing.empty()) missing = report.missing_reason();
  }
  if (static_cast<int>(used) < min_views) {
    return absl::StrCat("only ", used, " of ", views.size(),
                        " cameras have a usable image, triangulation needs ", min_views,
                        missing.empty() ? "" : "; the first that has none: ", missing);
  }
  if (seen == 0) return "no cell of the board was decoded in any view; is it the right board, and in focus?";
  return absl::StrCat("no cell could be triangulated from ", seen,
                      " observations of cells, their rays do not meet; is it the rig of this take?");
}

}  // namespace weft

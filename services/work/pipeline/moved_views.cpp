#include "services/work/pipeline/moved_views.h"

#include <tbb/parallel_for.h>

#include <optional>
#include <utility>

#include "pattern/decoder.h"

namespace weft {

MovedViews MovedViews::Decode(const FrameImages& images, const DecodeOptions& options,
                              const std::stop_token& stop, const DecodedFrame& decoded) {
  std::vector<std::optional<Other>> found(decoded.views.size());
  const auto decode = [&](size_t view) {
    const auto camera = static_cast<size_t>(decoded.views[view].camera);
    const std::optional<ViewMoment> moment = MomentOfView(images.dump, images.index, camera);
    if (!moment || decoded.views[view].observations.empty() || stop.stop_requested()) return;
    const absl::StatusOr<Frame> frame = images.dump.ReadView(moment->other, camera);
    if (!frame.ok()) return;
    const auto decoder = ViewDecoder::Read(*frame, images.board, options);
    if (!decoder.ok()) return;
    (*decoder)->Decode();
    found[view] = Other{view, moment->own_s, {moment->other_s, (*decoder)->TakeResult().observations}, {}};
  };
  tbb::parallel_for(size_t{0}, found.size(), decode, tbb::simple_partitioner());
  MovedViews moved;
  for (std::optional<Other>& other : found)
    if (other) moved.others_.push_back(*std::move(other));
  return moved;
}

void MovedViews::Move(std::vector<ViewObservations>& views) {
  for (Other& other : others_) {
    other.as_decoded = views[other.view].observations;
    views[other.view].observations = RollToMoment({other.own_s, other.as_decoded}, other.seen);
  }
}

void MovedViews::Undo(std::vector<ViewObservations>& views) const {
  for (const Other& other : others_) views[other.view].observations = other.as_decoded;
}

void MovedViews::Describe(std::vector<v1::ViewReport>& reports) const {
  for (const Other& other : others_) reports[other.view].set_moved_ms(1e3 * other.own_s);
}

}  // namespace weft

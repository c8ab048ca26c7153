// The engine of decoding: everything that is known of one view, and the policies that add to it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/decoder.h"
#include "pattern/fit/appearance.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/fit/sampled_profile.h"
#include "pattern/image/color_image.h"
#include "pattern/image/exposure.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/patch_search.h"
#include "pattern/surface/board_state.h"
#include "pattern/surface/edge_runs.h"
#include "pattern/surface/predicted_cells.h"

namespace weft {

// Decodes one view, and may look for more in it later, when other views have told where its cells must be.
// Not thread-safe; deterministic.
class ViewDecoder {
 public:
  // Reads the frame's colours. Grey frames are InvalidArgument. `board` must outlive the decoder.
  static absl::StatusOr<std::unique_ptr<ViewDecoder>> Read(const Frame& frame, const BoardIndex& board,
                                                           const DecodeOptions& options);
  ViewDecoder(const ViewDecoder&) = delete;
  ViewDecoder& operator=(const ViewDecoder&) = delete;

  // Is called with the cells of a growth once they are scored, before the unsure ones are evicted.
  using ScoreObserver = std::function<void(const BoardState&)>;

  // The first pass: all that the view shows by itself. Call it once. `on_scored` may be empty.
  void Decode(const ScoreObserver& on_scored = {});

  // The second pass: looks for predicted cells (see FindPredicted), with the inks and the blur that the first
  // pass learnt, and grows from those that it finds. Centres near new cells are refined again. Returns why
  // each was not found, or nothing where it was. Nothing is looked for in a view of
  // which fewer than 20 cells are known (kNoFit). FailedPrecondition without the image (see Rest).
  absl::StatusOr<std::vector<std::optional<WhyMissing>>> Find(const std::vector<PredictedCell>& predicted,
                                                              const GuidedOptions& options);

  // Fits cells to the view; null without an image and seeds.
  const CellFitter* fitter() const { return fitter_ ? &*fitter_ : nullptr; }
  // Where cells are in the view so far.
  const BoardState& state() const { return state_; }
  // Centres and corners found so far, as DecodeResult.
  std::vector<Observation> Observations() const;
  // The observations, with the reports of the first pass, which are moved out.
  DecodeResult TakeResult();

  // Between two passes, a decoder at rest keeps little more than its cells, and the image where it
  // `keeps_image`; else the same frame is to be read again. Nothing else may be asked for until Wake.
  void Rest(bool keeps_image);
  void Wake() { state_.Wake(); }
  // Memory that the image takes.
  size_t image_bytes() const;
  bool has_image() const { return !pyramid_.empty(); }
  absl::Status ReadAgain(const Frame& frame);

 private:
  ViewDecoder(const Frame& frame, const BoardIndex& board, const DecodeOptions& options);

  // The steps of Decode, in the order of their use.
  bool FindSeeds();
  bool SeedFromStrips(const std::vector<LevelPatch>& patches);
  void Grow(const GrowthPolicy& policy);
  void Score(const ScoreObserver& on_scored);
  void Finish(const ScoreObserver& on_scored);
  void GrowFromFinds();

  bool LooksLikeChance() const;
  float GreyLevels() const;     // DecodeResult::grey_levels
  size_t LatticeNodes() const;  // in all levels of the pyramid
  void Reject();
  void MakeFitter();

  const BoardIndex& board_;
  const DecodeOptions options_;
  std::vector<ColorImage> pyramid_;
  Exposure exposure_;
  const SampledProfile profile_;
  InkModel inks_;
  std::vector<LooseBlob> blobs_;  // that no piece of lattice accounts for
  GrowthSeeds seeds_;
  Appearance appearance_;
  bool knows_inks_ = false;           // inks_ and appearance_ are those of the view
  std::optional<CellFitter> fitter_;  // with an image and inks
  BoardState state_;
  DecodeResult result_;
};

}  // namespace weft

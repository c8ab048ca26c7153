// Pieces of the board in one view: lattices at all sizes, the view's inks, and where each piece lies on the
// board.
#pragma once

#include <string>
#include <vector>

#include "pattern/board/board_index.h"
#include "pattern/fit/cell.h"
#include "pattern/image/color_image.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/keypoints.h"
#include "pattern/seeds/lattice.h"
#include "pattern/seeds/patch_decoder.h"

namespace weft {

// A patch found at one size of the image.
struct LevelPatch {
  MeasuredPatch measured;
  std::vector<Keypoint> points;  // [cells], in pixels of the full image
  int level = 0;                 // of the pyramid
  float scale = 1;               // pixels of the full image per pixel
  std::vector<DecodedPiece> pieces;
  bool mirrored = false;  // reads better in a mirror
  bool is_strip = false;  // read by DecodeStrip
};

// Patches of at least 3x3 cells in all images of a pyramid, the first one being the full image. Where a
// large patch of whole cells has been found, smaller images are not searched again. `loose` gets the
// keypoints that are in no patch.
std::vector<LevelPatch> FindPatches(const std::vector<ColorImage>& pyramid, const KeypointOptions& keypoints,
                                    const LatticeOptions& lattice, std::vector<LooseBlob>* loose);

// Adds the cells of patches that are in no piece that stands.
void AddUnread(const std::vector<LevelPatch>& patches, const PatchDecodeOptions& options,
               std::vector<LooseBlob>* loose);

// Learns the view's inks from what can be read, then reads all patches with them. Orders the patches by size.
InkModel DecodePatches(const BoardIndex& board, const PatchDecodeOptions& options,
                       std::vector<LevelPatch>* patches);

// Fills readings and pieces of patches, with inks that are known.
void ReadPatches(const InkModel& inks, const BoardIndex& board, std::vector<LevelPatch>* patches);

// Empty for a piece that stands, else the reason against it.
std::string WhyRejected(const LevelPatch& patch, const DecodedPiece& piece,
                        const PatchDecodeOptions& options);

// The cells of the pieces that stand, where growth can start.
std::vector<PlacedCell> SeedsOf(const std::vector<LevelPatch>& patches, const Board& board,
                                const PatchDecodeOptions& options);

}  // namespace weft

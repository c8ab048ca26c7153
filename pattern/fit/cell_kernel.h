// The inner loops of fitting cells, compiled for several instruction sets. All give the
// same bytes.
#pragma once

#include <cstdint>

#include "pattern/board/board.h"
#include "pattern/fit/cell.h"
#include "pattern/fit/sampled_profile.h"
#include "simd/dispatch.h"

namespace weft {

// A cell, its neighbours and the blur: what is needed to render it.
struct CellPrint {
  float colors[5][5][4];  // minus black; red, green, blue, unused
  float black[4];
  float neighbor_weights[9];  // 3x3, row by row
  const ProfileAlongU* along_u;
  const ProfileAlongV* along_v;
  // The slopes are those of a move of the centre alone, which dies out linearly towards the cells around,
  // instead of a move of all.
  bool moves_center = false;
};

// Weighted sums over the samples and the three channels. t is the rendered cell, tu and tv its derivatives by
// u and v. Where the centre alone moves, slopes times more than 1 (times t: more than 1, u, v) are not
// summed: those are 0.
struct CellModelSums {
  float uu[6], uv[6], vv[6];  // tu tu, tu tv, tv tv with monomials 1, u, v, uu, uv, vv
  float ut[6], vt[6], tt[6];  // tu t, tv t, t t with the same monomials
  float u1[3], v1[3], t1[3];  // tu, tv, t with monomials 1, u, v
  float weight;               // per channel
  // Over the cell itself, unweighted: its own square times t, and squared.
  float shape_t[3];
  float shape, shape2;
};

// A rendered cell.
struct alignas(64) CellModel {
  float wt[3][kSampleGroups][kSampleLanes], wtu[3][kSampleGroups][kSampleLanes],
      wtv[3][kSampleGroups][kSampleLanes];
  float w[kSampleGroups][kSampleLanes];
  float shape[2][kSampleLanes];  // groups 1 and 2; zero in the others
  CellModelSums sums;
};

// Sums that depend on the image i.
struct CellImageSums {
  float ui[3], vi[3], ti[3];  // tu i, tv i, t i with monomials 1, u, v
  float ii;
  float i1[3];       // per channel
  float shape_i[3];  // per channel
};

// Pixels as ColorImage holds them.
struct PixelView {
  const uint8_t* rgbx;
  int width_px, height_px;
};

struct alignas(64) CellSamples {
  float value[3][kSampleGroups][kSampleLanes];
};

// The inks of a cell and its neighbours, and the blur.
struct CellInks {
  int inks[5][5];  // kCellColors off the board
  float weights[kSampleGroups * kSampleLanes];
  const ProfileAlongU* along_u;
  const ProfileAlongV* along_v;
};

// Normal equations of the inks' colours and of black, the last, at light 1: the products of their shares of
// each sample, those times its values, and the values squared.
struct alignas(64) CellColorSums {
  double normal[kCellColors + 1][kCellColors + 1];  // [q][p]; only p >= q holds
  double target[3][kCellColors + 1];
  double square;
};

struct CellKernels {
  // `mask` [4][16] multiplies the weights; null for all ones.
  void (*render)(const CellPrint& print, const float* mask, CellModel* model);
  // Bilinear samples at the places of a cell; places outside of the image (at least 2x2) are moved to its
  // border.
  void (*sample)(const PixelView& image, const CellPose& pose, const CellWarp& warp, CellSamples* samples);
  void (*sum)(const CellModel& model, const CellSamples& samples, CellImageSums* sums);
  // Weights [4][16] of the samples under a Cauchy distribution of their residuals, as wide as these are in
  // the mean; 0 for samples without weight. `light`: gain, its changes along u and v, offset.
  void (*trust)(const CellModel& model, const CellSamples& samples, const float* light, float* weights);
  // Sample by sample.
  void (*colors)(const CellInks& cell, const CellSamples& samples, CellColorSums* sums);
};

// The fastest that this processor runs.
const CellKernels& BestCellKernels();

WEFT_DECLARE_BUILDS(CellKernels, kCellKernels)

}  // namespace weft

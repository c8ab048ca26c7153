// How the seven inks and the black lines look in one view.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "pattern/board/board.h"

namespace weft {

using Rgb = std::array<float, 3>;

// A cell's measured colour, divided by the light around it.
struct InkSample {
  Rgb color;
  CellColor label;
};

// One Gaussian per ink over colours relative to the light of their neighbourhood, and a uniform share for
// colours that are no ink (wrong place, highlight, print error).
class InkModel {
 public:
  // Inks as a printer's profile would name them, mixed with grey by `fade` (0 as in board.png, cloth is
  // nearer to 0.5), for measurements whose channels have the means `mean`.
  static InkModel Faded(float fade, const Rgb& mean);
  // From cells whose ink is known. Inks with few samples keep the values of `before`.
  static InkModel Fitted(const std::vector<InkSample>& samples, const InkModel& before);

  // Density of the colour under each ink.
  std::array<float, kCellColors> Likelihoods(const Rgb& color) const;

  const Rgb& mean(CellColor color) const { return inks_[static_cast<int>(color)].mean; }

 private:
  struct Ink {
    Rgb mean = {};
    Eigen::Matrix3f precision = Eigen::Matrix3f::Zero();  // inverse covariance
    float log_norm = 0;
  };

  static Ink MakeInk(const Rgb& mean, Eigen::Matrix3d covariance);

  std::array<Ink, kCellColors> inks_;
};

}  // namespace weft

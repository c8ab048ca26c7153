// The takes of an avatar's training, and what is learnt of each.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "services/work/animation/cloth_take.h"

namespace weft {

// Of data sets the split train is learnt from and the split validate is held out; tests are never read.
class TrainingTakes {
 public:
  // Sources to learn from, and those that are held out. `garment`: folder of the template; empty: that of the
  // first source. `fps` as of OpenClothSource. Errors of OpenClothSource and TemplateOfSources.
  static absl::StatusOr<TrainingTakes> Open(const std::vector<std::string>& sources,
                                            const std::vector<std::string>& held_out,
                                            const std::string& garment, double fps);

  const Template& garment() const { return garment_; }
  int size() const { return static_cast<int>(takes_.size()); }
  ClothTake& take(int t) { return takes_[static_cast<size_t>(t)]; }
  bool is_held_out(int t) const { return held_out_[static_cast<size_t>(t)]; }

  // Must not outlive the takes.
  TrainingFrames Frames();

 private:
  Template garment_;
  std::vector<ClothTake> takes_;
  std::vector<bool> held_out_;
};

}  // namespace weft

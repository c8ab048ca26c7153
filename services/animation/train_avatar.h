// From recorded or simulated meshes to an avatar's folder.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "animation/sparse_view_avatar.h"
#include "services/animation/avatar_file.h"

namespace weft {

struct AvatarRequest {
  std::vector<std::string> sources;   // to learn from; OpenClothSource says what they may be
  std::vector<std::string> held_out;  // not learnt from: they tell how far the avatar is to be trusted
  std::string garment;                // folder of the template; empty: that of the first source
  double fps = 0;                     // of meshes whose take tells no times; 0: 30
  SparseViewTraining training;
  std::string out;
};

// Learns and writes the avatar, and returns it as it stands in the folder. Of data sets the split train is
// learnt from and the split validate is held out; tests are never read. `on_progress` (may be empty) as that
// of TrainSparseView. Errors of OpenClothSource, TemplateOfSources, TrainSparseView and WriteAvatar, those of
// the place of the avatar before anything is learnt. Cancelled when `stop` is requested; nothing is left
// then.
absl::StatusOr<AvatarFile> TrainAvatar(
    const AvatarRequest& request,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop);

}  // namespace weft

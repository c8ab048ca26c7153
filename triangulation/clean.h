// Cleaning of a cloud: points that contradict their neighbours on the board move to `rejected`.
#pragma once

#include "absl/status/status.h"
#include "triangulation/cloud.h"

namespace weft {

struct CleaningOptions {
  absl::Status Validate() const;
};

Cloud CleanCloud(Cloud cloud, const CleaningOptions& options);

}  // namespace weft

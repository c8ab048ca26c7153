// A net that looks at a driven mesh and says how far it is off.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/template.h"
#include "animation/atlas/atlas.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/rays/evidence.h"
#include "animation/sparse_view/driving_features.h"
#include "animation/sparse_view/ray_driver.h"
#include "nets/net.h"

namespace weft {

struct CorrectedMesh {
  std::vector<Eigen::Vector3d> position_mm;  // [vertices]
  // Deviation per axis that the net expects of it, [vertices].
  std::vector<float> deviation_mm;
};

// Nets of avatars take an image of the garment's atlas by this name, and give one of the same size.
inline constexpr char kNetInput[] = "image", kNetOutput[] = "answer";
// Their channels.
struct AvatarNetChannels {
  int features = kDrivingFeatures, answers = kDrivingAnswers;
};

// InvalidArgument where the net does not read, has other inputs or outputs than these, or does not answer its
// sample as it did when it was trained, to 1e-4 of its largest answer.
absl::StatusOr<Net> LoadNet(const AvatarNet& net, const AvatarNetChannels& channels);
absl::Status CheckNet(const AvatarNet& net, const AvatarNetChannels& channels = {});
// The answer to an image. InvalidArgument where it is of another size; errors of the net.
absl::StatusOr<AtlasImage> AskNet(Net& net, AtlasImage image);

// Not for use by two threads at once. Parallel loops run in the calling thread's TBB arena.
class NetCorrection {
 public:
  // Model and avatar must outlive it. Errors of CheckNet and Atlas::Build.
  static absl::StatusOr<NetCorrection> Create(const Template& garment, const AlignmentModel& model,
                                              const SparseViewAvatar& avatar);

  // Errors of Net::Run.
  absl::StatusOr<CorrectedMesh> Correct(const RayDrivenFrame& frame, const std::vector<VertexRay>& rays);

 private:
  NetCorrection(const AlignmentModel& model, const SparseViewAvatar& avatar, Atlas atlas, Net net)
      : features_(model, avatar), atlas_(std::move(atlas)), net_(std::move(net)) {}

  DrivingFeatures features_;
  Atlas atlas_;
  Net net_;
};

}  // namespace weft

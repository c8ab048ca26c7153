#include "services/studio/calibration/rehearsal.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <filesystem>

#include "absl/strings/str_format.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/image/image_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/rig_file.h"

namespace weft {

absl::Status WriteRehearsal(const std::string& out, const CalibrationTarget& target,
                            const RehearsalOptions& options,
                            const std::function<void(size_t, size_t)>& on_image) {
  namespace fs = std::filesystem;
  WEFT_ASSIGN_OR_RETURN(const Rig rig, MakeStudioRig("rehearsal", options.rig));
  WEFT_ASSIGN_OR_RETURN(const MovedTarget moved, MoveTarget(target, rig, options.motion));
  absl::Status status = CreateFolders((fs::path(out) / "truth").string());
  status.Update(WriteRig((fs::path(out) / "truth" / "rig.json").string(), rig, "simulated"));
  const auto folder_of = [&](size_t frame) {
    return fs::path(out) / absl::StrFormat("%04d", static_cast<int>(frame));
  };
  for (int frame = 0; frame < options.motion.frames; ++frame)
    status.Update(CreateFolders(folder_of(frame).string()));
  if (!status.ok()) return status;

  const size_t cameras = rig.cameras.size(), all = cameras * static_cast<size_t>(options.motion.frames);
  struct {
    Mutex mutex;
    absl::Status status ABSL_GUARDED_BY(mutex);
  } images;
  std::atomic<size_t> done = 0;
  tbb::parallel_for(size_t{0}, all, [&](size_t i) {
    const CameraModel& camera = rig.cameras[i % cameras];
    const absl::StatusOr<Frame> image =
        RenderBoards(moved, static_cast<int>(i / cameras), camera, options.look);
    const absl::Status written =
        image.ok() ? WriteImageFile((folder_of(i / cameras) / (camera.id + ".png")).string(), *image)
                   : image.status();
    if (on_image) on_image(++done, all);
    const MutexLock lock(images.mutex);
    images.status.Update(written);
  });
  const MutexLock lock(images.mutex);
  return images.status;
}

}  // namespace weft

// Whether the cameras of a rig are those that made the recording: the same checks for registrations, their
// evaluation and the refinement of a rig.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "weft/v1/verdict.pb.h"

namespace weft {

// One camera over all frames; see CameraAgreement (triangulation/camera_agreement.h).
struct CameraStanding {
  std::string camera;
  int64_t compared = 0, agreeing = 0;  // observations
  double median_px = 0;                // distance from the others' points, mean over the frames
  double common_px = 0;                // what cells near each other have in common of it, as vectors
  int frames = 0, frames_apart = 0;    // that tell of it; of them, those where it disagrees
  // Of its images those are not used that have another size than the rig says; fits_camera then is the one
  // whose size they have.
  bool has_other_size = false;
  // Measured cloth that faces it, and what it saw of it; vertices of all frames.
  int64_t in_view = 0, seen = 0;
  // Images with cloth that faces the camera; of them, those in which it saw none, and the frame of the first.
  int facing_images = 0, blank_images = 0;
  std::string blank_frame;
  int images = 0, repeated = 0;       // images that have one before them; of them, those that are the same
  std::string fits_camera;            // whose place explains its images, of most frames where it disagrees
  std::string fits_part;              // what of that one, by CameraPartName; empty or "camera": all
  std::string fits_turned;            // "upside down", ...
  double fits_px = 0;                 // distance there; 0: not known
  double scale = 0, scale_sigma = 0;  // of what it sees; 0: not known
  double perspective = 0, perspective_sigma = 0;
};

struct CameraFacts {
  std::vector<CameraStanding> cameras;
  std::vector<std::string> unknown;  // of the recording, not of the rig
  int of_rig = 0;                    // cameras of the rig that the recording has
  // Size of the cloth over that of its print, and of its template; medians of the frames.
  std::optional<double> print_scale, template_scale;
};

// A camera that sees less than this share of the cloth where the others see it agrees with no other.
inline constexpr double kAgreeingShare = 0.8;
// Fewer observations say nothing of a camera.
inline constexpr int64_t kLeastCompared = 50;

bool IsApart(const CameraStanding& camera);

// "cameras c03 and c07 are exchanged: ..." and what to do; empty where all cameras agree.
struct CameraFault {
  std::string reason, remedy;
  bool is_named = false;  // exchanged or turned, not just apart
};
CameraFault FaultOf(const std::vector<CameraStanding>& cameras);

// The check that cameras agree; nothing where no camera was compared.
void AddAgreementCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict);

// A camera that sees less than this share of what the others see of the cloth before them is blind. The least
// of the right takes of `accuracy_cameras` is 0.34 (November 2026).
inline constexpr double kSeeingShare = 0.2;
// Fewer vertices in view say nothing of a camera.
inline constexpr int64_t kLeastInView = 100;

// The check that most cameras see cells where the others see them, but for the noise of single cells; nothing
// where fewer than three were compared.
void AddOffsetCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict);

// The check that each camera sees the cloth that faces it, but for those that agree with no other; nothing
// where no mesh tells.
void AddSightCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict);

// The check that no single image is blank, of cameras that see else; nothing where no mesh tells.
void AddBlankCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict);

// The check that no camera repeats its images; nothing of single frames.
void AddRepeatCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict);

// The checks of the lengths: lens, rig, print or template, by what tells them apart. Wrong focal lengths make
// the cloth too large or too small in depth as well, so that its perspective is not that of the images; a rig
// of another scale leaves no trace but the size of the cloth.
void AddScaleCheck(const CameraFacts& facts, v1::Verdict& verdict);

// The check that the rig knows the cameras of the recording.
void AddKnownCheck(const CameraFacts& facts, v1::Verdict& verdict);

}  // namespace weft

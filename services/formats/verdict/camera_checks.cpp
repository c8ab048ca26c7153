#include "services/formats/verdict/camera_checks.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "base/median.h"
#include "services/formats/verdict/verdict.h"

namespace weft {
namespace {

using Names = std::vector<std::string>;

// "c01", "c01 and c02", "c01, c02 and 5 more".
std::string Listed(const Names& names) {
  constexpr size_t kShown = 6;
  if (names.size() > kShown)
    return absl::StrCat(absl::StrJoin(names.begin(), names.begin() + kShown, ", "), " and ",
                        names.size() - kShown, " more");
  if (names.size() < 2) return absl::StrJoin(names, "");
  return absl::StrCat(absl::StrJoin(names.begin(), names.end() - 1, ", "), " and ", names.back());
}

// "camera c01", "cameras c01 and c02".
std::string CamerasText(const Names& names) {
  return absl::StrCat(names.size() == 1 ? "camera " : "cameras ", Listed(names));
}

// Its images have the size of one other camera, which has its own.
bool HasOthersSize(const CameraStanding& camera) {
  return camera.has_other_size && !camera.fits_camera.empty();
}

bool IsJudged(const CameraStanding& camera) { return camera.compared >= kLeastCompared; }

// Cameras that have each other's places, in rings, each followed by the one whose place it has.
std::vector<Names> RingsOf(const std::vector<CameraStanding>& cameras) {
  std::map<std::string, std::string> place_of;
  for (const CameraStanding& camera : cameras)
    if (HasOthersSize(camera) ||
        (IsApart(camera) && camera.fits_turned.empty() && !camera.fits_camera.empty()))
      place_of[camera.camera] = camera.fits_camera;
  std::vector<Names> rings;
  std::set<std::string> told;
  for (const auto& [first, place] : place_of) {
    if (told.contains(first)) continue;
    Names ring = {first};
    for (auto next = place_of.find(place);
         next != place_of.end() && next->first != first && ring.size() <= place_of.size();
         next = place_of.find(next->second))
      ring.push_back(next->first);
    const auto last = place_of.find(ring.back());
    if (last == place_of.end() || last->second != first) continue;  // leads to a camera that is right
    told.insert(ring.begin(), ring.end());
    rings.push_back(std::move(ring));
  }
  return rings;
}

bool IsWhole(const CameraStanding& camera) {
  return camera.has_other_size || camera.fits_part.empty() || camera.fits_part == "camera";
}

// "place", "place and lens", "lens".
std::string PartText(const CameraStanding& camera) {
  return IsWhole(camera) ? "place" : absl::StrReplaceAll(camera.fits_part, {{"-", " "}});
}

const CameraStanding& Named(const std::vector<CameraStanding>& cameras, const std::string& id) {
  return *std::ranges::find_if(cameras, [&](const auto& c) { return c.camera == id; });
}

int ImagesOf(const std::vector<CameraStanding>& cameras, const Names& names) {
  int images = 0;
  for (const std::string& name : names) images += Named(cameras, name).images;
  return images;
}

// " in 4 of 8 frames", of an exchange during the take; else nothing.
std::string PartOfFrames(const CameraStanding& camera) {
  return camera.has_other_size || camera.frames_apart == camera.frames
             ? ""
             : absl::StrCat(" in ", camera.frames_apart, " of ", camera.frames, " frames");
}

std::string RingText(const Names& ring, const std::vector<CameraStanding>& cameras) {
  const CameraStanding& camera = Named(cameras, ring[0]);
  const std::string when = PartOfFrames(camera);
  if (camera.has_other_size)
    return absl::StrCat(CamerasText(ring), " are exchanged: their images have each other's size");
  const std::string distance =
      camera.fits_px > 0 && camera.median_px > 0
          ? absl::StrFormat(", %.1f px off there, %.0f px at its own", camera.fits_px, camera.median_px)
          : "";
  if (ring.size() == 2)
    return absl::StrCat("cameras ", ring[0], " and ", ring[1], " are exchanged", when,
                        ": what each of them saw fits the ", PartText(camera), " of the other", distance);
  Names steps;
  for (size_t i = 0; i < ring.size(); ++i)
    steps.push_back(
        absl::StrCat(ring[i], " saw what fits the ", PartText(camera), " of ", ring[(i + 1) % ring.size()]));
  return absl::StrCat(CamerasText(ring), " are exchanged", when, ": ", absl::StrJoin(steps, ", "));
}

// Of several rings each writes the rig that the next one reads.
std::string RingRemedy(const Names& ring, const CameraStanding& camera, size_t step, size_t steps) {
  return absl::StrCat("`weft rig exchange ", step == 0 ? "RIG" : absl::StrCat("FILE", step), " ",
                      absl::StrJoin(ring, " "),
                      IsWhole(camera) ? "" : absl::StrCat(" --only ", camera.fits_part), " --out ",
                      steps == 1 ? "FILE" : absl::StrCat("FILE", step + 1), "`");
}

std::string ApartText(const Names& names, double farthest_px, int frames_apart, int frames) {
  std::string text =
      absl::StrCat(CamerasText(names), names.size() == 1 ? " agrees with no other" : " agree with no other");
  if (farthest_px > 0)
    absl::StrAppendFormat(&text, ": %s the cloth %.0f px from where the others see it",
                          names.size() == 1 ? "it sees" : "they see", farthest_px);
  if (frames_apart < frames) absl::StrAppend(&text, " in ", frames_apart, " of ", frames, " frames");
  return text;
}

// By how much the focal lengths are too short, in %, by the perspective of the cloth in all cameras; empty
// where they do not tell.
std::optional<double> LensError(const std::vector<CameraStanding>& cameras) {
  constexpr double kSignificant = 4;
  double sum = 0, weights = 0;
  int telling = 0;
  for (const CameraStanding& camera : cameras) {
    if (!IsJudged(camera) || !(camera.perspective_sigma > 0)) continue;
    // No camera tells more than this: what the decoder leaves is shared.
    const double weight = 1 / (std::pow(camera.perspective_sigma, 2) + 1e-4);
    sum += weight * camera.perspective, weights += weight;
    ++telling;
  }
  if (telling < 3 || std::abs(sum) < kSignificant * std::sqrt(weights)) return std::nullopt;
  return -100 * sum / weights;
}

// Of one camera, against all others.
const CameraStanding* WrongLens(const std::vector<CameraStanding>& cameras) {
  constexpr double kLeast = 0.005, kSignificant = 5;
  const CameraStanding* worst = nullptr;
  for (const CameraStanding& camera : cameras) {
    if (!IsJudged(camera) || !(camera.scale > 0)) continue;
    const double off = std::abs(camera.scale - 1);
    if (off < std::max(kLeast, kSignificant * camera.scale_sigma)) continue;
    if (worst == nullptr || off > std::abs(worst->scale - 1)) worst = &camera;
  }
  return worst;
}

std::vector<const CameraStanding*> WithClothInView(const std::vector<CameraStanding>& cameras) {
  std::vector<const CameraStanding*> out;
  for (const CameraStanding& camera : cameras)
    if (camera.in_view >= kLeastInView) out.push_back(&camera);
  return out;
}

double ShareSeen(const CameraStanding& camera) {
  return static_cast<double>(camera.seen) / static_cast<double>(camera.in_view);
}

double UsualShareSeen(const std::vector<const CameraStanding*>& cameras) {
  std::vector<double> shares;
  for (const CameraStanding* camera : cameras) shares.push_back(ShareSeen(*camera));
  return Median(std::move(shares));
}

bool IsBlind(const CameraStanding& camera, double usual_share) {
  return !IsApart(camera) && ShareSeen(camera) < kSeeingShare * usual_share;
}

double Off(double scale) { return 100 * std::abs(scale - 1); }

// "its cells lie 1.050 times as far apart as they are printed"; empty where nothing tells.
std::string SizeText(const CameraFacts& facts) {
  if (facts.print_scale)
    return absl::StrFormat("its cells lie %.4g times as far apart as they are printed", *facts.print_scale);
  if (facts.template_scale)
    return absl::StrFormat("its cells lie %.4g times as far apart as on the template", *facts.template_scale);
  return "";
}

std::string LensText(double too_short, const CameraFacts& facts) {
  const std::string size = SizeText(facts);
  return absl::StrFormat(
      "the lenses of the rig are not those of the recording: by the perspective of the cloth the "
      "focal lengths are about %.0f %% too %s%s",
      std::abs(too_short), too_short > 0 ? "short" : "long", size.empty() ? "" : absl::StrCat("; ", size));
}

std::string ScaleText(const CameraFacts& facts, bool is_lens) {
  const bool only_print =
      facts.print_scale && facts.template_scale && Off(*facts.template_scale) < Off(*facts.print_scale) / 2;
  return absl::StrCat("the cloth is not as large as its print: ", SizeText(facts),
                      is_lens ? "; the lenses of the rig explain it"
                      : only_print
                          ? "; it fits the template, so cell_mm of the board is not that of the print"
                          : "; the rig has another scale or other units, its focal lengths are off, or "
                            "cell_mm is not that of the print");
}

}  // namespace

bool IsApart(const CameraStanding& camera) {
  return IsJudged(camera) &&
         static_cast<double>(camera.agreeing) < kAgreeingShare * static_cast<double>(camera.compared);
}

CameraFault FaultOf(const std::vector<CameraStanding>& cameras) {
  Names reasons, remedies, apart;
  std::set<std::string> told;
  const std::vector<Names> rings = RingsOf(cameras);
  for (const Names& ring : rings) {
    told.insert(ring.begin(), ring.end());
    reasons.push_back(RingText(ring, cameras));
    const CameraStanding& camera = Named(cameras, ring[0]);
    if (!PartOfFrames(camera).empty()) {
      remedies.push_back(absl::StrCat("Register these frames apart (--frames), with the rig of ",
                                      RingRemedy(ring, camera, remedies.size(), rings.size())));
      continue;
    }
    remedies.push_back(absl::StrCat(IsWhole(camera)
                                        ? "Exchange the cables, or the cameras of the rig with "
                                        : "Calibrate again, or exchange what the rig has of them with ",
                                    RingRemedy(ring, camera, remedies.size(), rings.size())));
  }
  double farthest_px = 0;
  int frames_apart = 0, frames = 0;
  for (const CameraStanding& camera : cameras) {
    if (!IsApart(camera) || told.contains(camera.camera)) continue;
    if (!camera.fits_turned.empty()) {
      reasons.push_back(absl::StrCat("the images of camera ", camera.camera, " are ", camera.fits_turned));
      remedies.push_back(absl::StrCat("Turn the images of ", camera.camera, ", or the camera"));
    } else if (!camera.fits_camera.empty()) {
      reasons.push_back(IsWhole(camera)
                            ? absl::StrCat("camera ", camera.camera, " saw what fits the place of ",
                                           camera.fits_camera, ", where ", camera.fits_camera, " stands")
                            : absl::StrCat("camera ", camera.camera, " saw what fits the ", PartText(camera),
                                           " of ", camera.fits_camera));
      remedies.push_back(
          absl::StrCat("See which images are those of ", camera.camera, " and of ", camera.fits_camera));
    } else {
      apart.push_back(camera.camera);
      farthest_px = std::max(farthest_px, camera.median_px);
      frames_apart = std::max(frames_apart, camera.frames_apart);
      frames = std::max(frames, camera.frames);
    }
  }
  CameraFault fault;
  fault.is_named = !reasons.empty();
  if (!apart.empty()) {
    reasons.push_back(ApartText(apart, farthest_px, frames_apart, frames));
    remedies.push_back(
        "Check that it stands where the rig says and that its images are its own, else calibrate again");
  }
  if (reasons.empty()) return fault;
  fault.reason = absl::StrJoin(reasons, "; ");
  fault.remedy = absl::StrCat(absl::StrJoin(remedies, "; "), ". Then register again.");
  return fault;
}

void AddAgreementCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict) {
  int judged = 0, apart = 0;
  for (const CameraStanding& camera : cameras) {
    judged += IsJudged(camera) || HasOthersSize(camera);
    apart += IsApart(camera) || HasOthersSize(camera);
  }
  if (judged == 0) return;
  const CameraFault fault = FaultOf(cameras);
  AddCheck(verdict, kRegisterCamerasAgree, 100.0 * (judged - apart) / judged, fault.reason, fault.remedy);
}

void AddOffsetCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict) {
  constexpr size_t kFewest = 3;
  std::vector<double> offsets_px;
  for (const CameraStanding& camera : cameras)
    if (IsJudged(camera) && !IsApart(camera)) offsets_px.push_back(camera.common_px);
  if (offsets_px.size() < kFewest) return;
  const double usual_px = Median(std::move(offsets_px));
  AddCheck(
      verdict, kRegisterOffset, usual_px,
      absl::StrFormat("most cameras see whole regions of the cloth %.2g px from where the others see them: "
                      "images of several cameras are of another moment, or the calibration is off",
                      usual_px));
}

void AddScaleCheck(const CameraFacts& facts, v1::Verdict& verdict) {
  const std::optional<double> lens = LensError(facts.cameras);
  const std::optional<double>& scale = facts.print_scale ? facts.print_scale : facts.template_scale;
  const bool is_lens = lens && std::abs(*lens) > kRegisterLens.good;
  if (lens) AddCheck(verdict, kRegisterLens, std::abs(*lens), is_lens ? LensText(*lens, facts) : "");
  if (scale) AddCheck(verdict, kRegisterScale, Off(*scale), ScaleText(facts, is_lens));
  if (const CameraStanding* camera = is_lens ? nullptr : WrongLens(facts.cameras))
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrFormat("camera %s sees the cloth %.1f %% too %s: its focal length (zoom) or its "
                               "distance is off",
                               camera->camera, Off(camera->scale), camera->scale > 1 ? "large" : "small"),
               "Set its lens as it was when it was calibrated, or calibrate again.");
}

void AddSightCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict) {
  const std::vector<const CameraStanding*> judged = WithClothInView(cameras);
  if (judged.empty()) return;
  const double usual = UsualShareSeen(judged);
  Names blind;
  int64_t seen = 0, in_view = 0;
  for (const CameraStanding* camera : judged) {
    if (!IsBlind(*camera, usual)) continue;
    blind.push_back(camera->camera);
    seen += camera->seen, in_view += camera->in_view;
  }
  const bool is_one = blind.size() == 1;
  AddCheck(verdict, kRegisterCamerasSee,
           100.0 * static_cast<double>(judged.size() - blind.size()) / static_cast<double>(judged.size()),
           blind.empty() ? ""
                         : absl::StrFormat("%s %s %s of the cloth that faces %s: %d of %d cells, where most "
                                           "cameras see %.0f %%",
                                           CamerasText(blind), is_one ? "sees" : "see",
                                           seen == 0 ? "nothing" : "little", is_one ? "it" : "them", seen,
                                           in_view, 100 * usual));
}

void AddBlankCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict) {
  const std::vector<const CameraStanding*> judged = WithClothInView(cameras);
  if (judged.empty()) return;
  const double usual = UsualShareSeen(judged);
  int images = 0, blank = 0;
  Names names;
  for (const CameraStanding* camera : judged) {
    if (IsApart(*camera) || IsBlind(*camera, usual)) continue;
    images += camera->facing_images, blank += camera->blank_images;
    if (camera->blank_images > 0)
      names.push_back(absl::StrCat(
          camera->camera, " in frame ", camera->blank_frame,
          camera->blank_images == 1 ? "" : absl::StrCat(" and ", camera->blank_images - 1, " more")));
  }
  if (images == 0) return;
  AddCheck(verdict, kRegisterImagesSee, 100.0 * (images - blank) / images,
           blank == 0 ? ""
                      : absl::StrCat(blank, " of ", images, blank == 1 ? " images shows" : " images show",
                                     " nothing of the cloth that faces its camera: ", CamerasText(names)));
}

void AddRepeatCheck(const std::vector<CameraStanding>& cameras, v1::Verdict& verdict) {
  int images = 0, repeated = 0;
  Names names;
  for (const CameraStanding& camera : cameras) {
    images += camera.images, repeated += camera.repeated;
    if (camera.repeated > 0) names.push_back(camera.camera);
  }
  if (images == 0) return;
  AddCheck(verdict, kRegisterImagesNew, 100.0 * (images - repeated) / images,
           repeated == 0
               ? ""
               : absl::StrFormat("%s stood still: in %d of %d images %s sent the picture of the frame "
                                 "before",
                                 CamerasText(names), repeated, ImagesOf(cameras, names),
                                 names.size() == 1 ? "it" : "they"));
}

void AddKnownCheck(const CameraFacts& facts, v1::Verdict& verdict) {
  const int unknown = static_cast<int>(facts.unknown.size()), all = facts.of_rig + unknown;
  if (all == 0) return;
  AddCheck(verdict, kRegisterCamerasKnown, 100.0 * facts.of_rig / all,
           unknown == 0
               ? ""
               : absl::StrCat(unknown, " of ", all, " cameras of the recording ", unknown == 1 ? "is" : "are",
                              " not in the rig, their images were not used: ", Listed(facts.unknown)));
}

}  // namespace weft

#include "services/results/report/camera_facts.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

// Camera, part of it, turn.
using Fit = std::tuple<std::string, std::string, std::string>;

// Sums over the frames of one camera.
struct Sums {
  CameraStanding standing;
  std::map<Fit, int> fits;  // frames by what explains the images
  double fits_px = 0, scaled = 0;
  bool has_images = false;
  std::string last_hash;
  v1::ImageSize of_image, of_rig;  // of images that were not used, the first
};

void Add(const v1::CameraAgreement& agreement, Sums& sums) {
  CameraStanding& standing = sums.standing;
  const double compared = agreement.compared();
  standing.compared += agreement.compared();
  standing.agreeing += agreement.agreeing();
  ++standing.frames;
  standing.median_px += (agreement.median_px() - standing.median_px) / standing.frames;
  standing.common_px += (agreement.common_px() - standing.common_px) / standing.frames;
  standing.frames_apart += agreement.agreeing() < kAgreeingShare * compared ? 1 : 0;
  if (!agreement.fits_camera().empty() || !agreement.fits_turned().empty()) {
    ++sums.fits[{agreement.fits_camera(), agreement.fits_part(), agreement.fits_turned()}];
    sums.fits_px = std::max(sums.fits_px, agreement.fits_px());
  }
  if (!(agreement.scale() > 0)) return;
  sums.scaled += compared;
  standing.scale += (agreement.scale() - standing.scale) * compared / sums.scaled;
  // Frames resemble each other, so more of them are no more certain.
  standing.scale_sigma += (agreement.scale_sigma() - standing.scale_sigma) * compared / sums.scaled;
  standing.perspective += (agreement.perspective() - standing.perspective) * compared / sums.scaled;
  standing.perspective_sigma +=
      (agreement.perspective_sigma() - standing.perspective_sigma) * compared / sums.scaled;
}

void AddImage(const std::string& frame, const v1::ViewReport& view, Sums& sums) {
  if (view.has_image_size() && !sums.standing.has_other_size) {
    sums.standing.has_other_size = true;
    sums.of_image = view.image_size(), sums.of_rig = view.rig_size();
  }
  if (!view.missing_reason().empty()) return;
  sums.standing.in_view += view.vertices_in_view();
  sums.standing.seen += view.vertices_seen();
  if (view.vertices_in_view() >= kLeastInView) {
    ++sums.standing.facing_images;
    if (view.vertices_seen() == 0 && sums.standing.blank_images++ == 0) sums.standing.blank_frame = frame;
  }
  if (view.image_hash().empty()) return;
  sums.standing.images += !sums.last_hash.empty();
  sums.standing.repeated += view.image_hash() == sums.last_hash;
  sums.last_hash = view.image_hash();
}

// Of images that have another size than the rig says: the one such camera whose size they have.
void MatchSizes(std::vector<Sums>& cameras) {
  const auto are_equal = [](const v1::ImageSize& a, const v1::ImageSize& b) {
    return a.width_px() == b.width_px() && a.height_px() == b.height_px();
  };
  for (Sums& camera : cameras) {
    if (!camera.standing.has_other_size) continue;
    int matches = 0;
    for (const Sums& other : cameras) {
      if (!other.standing.has_other_size || !are_equal(camera.of_image, other.of_rig)) continue;
      camera.standing.fits_camera = other.standing.camera;
      ++matches;
    }
    if (matches != 1) camera.standing.fits_camera.clear();
  }
}

CameraStanding StandingOf(Sums sums) {
  const auto most =
      std::ranges::max_element(sums.fits, [](const auto& a, const auto& b) { return a.second < b.second; });
  // One frame among many that another place happens to explain is no exchange.
  if (most != sums.fits.end() && 2 * most->second >= sums.standing.frames_apart) {
    std::tie(sums.standing.fits_camera, sums.standing.fits_part, sums.standing.fits_turned) = most->first;
    sums.standing.fits_px = sums.fits_px;
  }
  return std::move(sums.standing);
}

std::optional<double> MedianIfAny(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  return Median(std::move(values));
}

}  // namespace

CameraFacts FactsOf(const std::vector<v1::FrameReport>& frames) {
  std::vector<Sums> cameras;
  std::map<std::string, size_t> index_of;
  std::set<std::string> unknown;
  std::vector<double> print_scales, template_scales;
  for (const v1::FrameReport& frame : frames) {
    for (const v1::ViewReport& view : frame.views()) {
      const auto [entry, added] = index_of.try_emplace(view.camera(), cameras.size());
      if (added) cameras.emplace_back().standing.camera = view.camera();
      Sums& sums = cameras[entry->second];
      sums.has_images |= view.missing_reason().empty();
      if (view.has_agreement()) Add(view.agreement(), sums);
      AddImage(frame.frame(), view, sums);
    }
    unknown.insert(frame.unknown_cameras().begin(), frame.unknown_cameras().end());
    if (frame.cloud().has_print_scale()) print_scales.push_back(frame.cloud().print_scale());
    if (frame.cloud().has_template_scale()) template_scales.push_back(frame.cloud().template_scale());
  }
  MatchSizes(cameras);
  CameraFacts facts;
  for (Sums& sums : cameras) {
    facts.of_rig += sums.has_images;
    facts.cameras.push_back(StandingOf(std::move(sums)));
  }
  facts.unknown.assign(unknown.begin(), unknown.end());
  facts.print_scale = MedianIfAny(std::move(print_scales));
  facts.template_scale = MedianIfAny(std::move(template_scales));
  return facts;
}

}  // namespace weft

#include "services/report/camera_facts.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

// Sums over the frames of one camera.
struct Sums {
  CameraStanding standing;
  std::map<std::pair<std::string, std::string>, int> fits;  // frames by camera and turn
  double fits_px = 0, scaled = 0;
  bool has_images = false;
};

void Add(const v1::CameraAgreement& agreement, Sums& sums) {
  CameraStanding& standing = sums.standing;
  const double compared = agreement.compared();
  standing.compared += agreement.compared();
  standing.agreeing += agreement.agreeing();
  ++standing.frames;
  standing.median_px += (agreement.median_px() - standing.median_px) / standing.frames;
  standing.frames_apart += agreement.agreeing() < kAgreeingShare * compared ? 1 : 0;
  if (!agreement.fits_camera().empty() || !agreement.fits_turned().empty()) {
    ++sums.fits[{agreement.fits_camera(), agreement.fits_turned()}];
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

CameraStanding StandingOf(Sums sums) {
  const auto most = std::max_element(sums.fits.begin(), sums.fits.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  // One frame among many that another place happens to explain is no exchange.
  if (most != sums.fits.end() && 2 * most->second >= sums.standing.frames_apart) {
    sums.standing.fits_camera = most->first.first;
    sums.standing.fits_turned = most->first.second;
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
    }
    unknown.insert(frame.unknown_cameras().begin(), frame.unknown_cameras().end());
    if (frame.cloud().has_print_scale()) print_scales.push_back(frame.cloud().print_scale());
    if (frame.cloud().has_template_scale()) template_scales.push_back(frame.cloud().template_scale());
  }
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

#include "services/results/report/rig_drawing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

constexpr double kSize = 500, kMargin = 30, kSymbol = 12, kFoot = 22;  // room for the scale bar
constexpr double kLetter = 5.2, kLine = 9;                             // of names, 9 px high
constexpr size_t kLongestName = 12;

struct Box {
  double left, top, right, bottom;
  bool Overlaps(const Box& b) const {
    return left < b.right && b.left < right && top < b.bottom && b.top < bottom;
  }
};

// A round length of about a fifth of the picture: 1, 2 or 5 times a power of ten.
double RoundLength(double mm) {
  const double decade = std::pow(10, std::floor(std::log10(std::max(mm, 1e-6))));
  for (const double factor : {5.0, 2.0})
    if (mm >= factor * decade) return factor * decade;
  return decade;
}

std::string LengthText(double mm) {
  return mm >= 1000 ? absl::StrFormat("%g\xC2\xA0m", mm / 1000) : absl::StrFormat("%g\xC2\xA0mm", mm);
}

}  // namespace

PaperAxes FromAbove() { return {"From above (x to the right, z down the page)", 0, 2}; }
PaperAxes FromTheSide() { return {"From the side (z to the right, y down)", 2, 1}; }

RigDrawing::RigDrawing(PaperAxes axes)
    : axes_(std::move(axes)),
      low_(Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity())),
      high_(Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity())) {}

void RigDrawing::Hold(const Eigen::Vector3d& world_mm) {
  if (!world_mm.allFinite()) return;
  low_ = low_.cwiseMin(OnPaper(world_mm));
  high_ = high_.cwiseMax(OnPaper(world_mm));
}

double RigDrawing::Scale() const { return kSize / std::max(1.0, (high_ - low_).maxCoeff()); }

Eigen::Vector2d RigDrawing::Size() const {
  return (high_ - low_).cwiseMax(0) * Scale() + Eigen::Vector2d(2 * kMargin, 2 * kMargin + kFoot);
}

Eigen::Vector2d RigDrawing::Place(const Eigen::Vector3d& world_mm) const {
  return (OnPaper(world_mm) - low_) * Scale() + Eigen::Vector2d(kMargin, kMargin);
}

void RigDrawing::AddCamera(const CameraModel& camera, const std::string& css_class, const std::string& more,
                           bool is_named) {
  const Eigen::Vector2d at = Place(camera.CenterWorld());
  const Eigen::Vector2d look = kSymbol * OnPaper(camera.rotation.row(2).transpose());
  const Eigen::Vector2d side(-0.45 * look.y(), 0.45 * look.x());
  const Eigen::Vector2d a = at + look + side, b = at + look - side;
  absl::StrAppendFormat(
      &body_, "<path class=\"%s\" d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fZ\"><title>%s%s</title></path>",
      css_class, at.x(), at.y(), a.x(), a.y(), b.x(), b.y(), EscapeHtml(camera.id), EscapeHtml(more));
  if (is_named) cameras_.push_back({at, look, camera.id});
}

std::string RigDrawing::Names(int* without_room) const {
  std::vector<Box> taken;
  for (const Named& camera : cameras_) {
    const Eigen::Vector2d middle = camera.at + 0.5 * camera.look;
    taken.push_back({middle.x() - 4, middle.y() - 4, middle.x() + 4, middle.y() + 4});
  }
  const Eigen::Vector2d size = Size();
  std::string svg;
  for (const Named& camera : cameras_) {
    const std::string name = Shortened(camera.name, kLongestName);
    const double width = kLetter * static_cast<double>(std::min(camera.name.size(), kLongestName + 1));
    // Behind the camera first, then around it, then farther away.
    const Eigen::Vector2d behind =
        camera.look.norm() > 1 ? Eigen::Vector2d(-camera.look.normalized()) : Eigen::Vector2d(0, -1);
    bool has_room = false;
    for (int attempt = 0; attempt < 24 && !has_room; ++attempt) {
      const double turn = (attempt % 2 == 0 ? 1 : -1) * ((attempt % 8 + 1) / 2) * M_PI / 4;
      const double away = 9 + 7 * static_cast<double>(attempt / 8);
      const Eigen::Vector2d way(std::cos(turn) * behind.x() - std::sin(turn) * behind.y(),
                                std::sin(turn) * behind.x() + std::cos(turn) * behind.y());
      const Eigen::Vector2d middle =
          camera.at + Eigen::Vector2d(way.x() * (away + width / 2), way.y() * away);
      const Box box{middle.x() - width / 2, middle.y() - kLine / 2, middle.x() + width / 2,
                    middle.y() + kLine / 2};
      if (box.left < 0 || box.top < 0 || box.right > size.x() || box.bottom > size.y() - kFoot) continue;
      if (std::ranges::any_of(taken, [&](const Box& other) { return box.Overlaps(other); })) continue;
      has_room = true;
      taken.push_back(box);
      absl::StrAppendFormat(&svg,
                            "<text class=\"names\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>",
                            middle.x(), middle.y() + 3, EscapeHtml(name));
    }
    *without_room += has_room ? 0 : 1;
  }
  return svg;
}

std::string RigDrawing::ScaleBar() const {
  const double length_mm = RoundLength(0.3 * kSize / Scale()), length = length_mm * Scale();
  const double y = Size().y() - 10;
  return absl::StrFormat(
      "<path class=\"bar-line\" d=\"M%.1f %.1fv6m0-3h%.1fm0-3v6\"/><text class=\"tick\" x=\"%.1f\" "
      "y=\"%.1f\">%s</text>",
      kMargin, y - 3, length, kMargin + length + 6, y + 4, LengthText(length_mm));
}

std::string RigDrawing::Figure() const {
  int without_room = 0;
  const std::string names = Names(&without_room);
  const Eigen::Vector2d size = Size();
  const std::string caption =
      without_room == 0 ? axes_.title
                        : absl::StrCat(axes_.title, "; ", Counted(without_room, "camera", "cameras"),
                                       " without room for a name");
  return absl::StrFormat(
      "<figure class=\"plot\"><figcaption>%s</figcaption><svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
      "aria-label=\"%s\">%s%s%s</svg></figure>\n",
      EscapeHtml(caption), size.x(), size.y(), EscapeHtml(axes_.title), body_, names, ScaleBar());
}

}  // namespace weft

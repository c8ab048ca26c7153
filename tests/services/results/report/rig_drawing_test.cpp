#include "services/results/report/rig_drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <regex>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Cameras on a circle of `radius_mm`, looking at its middle.
std::vector<CameraModel> Circle(int cameras, double radius_mm) {
  std::vector<CameraModel> rig(cameras);
  for (int c = 0; c < cameras; ++c) {
    const double angle = 2 * M_PI * c / cameras;
    const Eigen::Vector3d center(radius_mm * std::cos(angle), 0, radius_mm * std::sin(angle));
    const Eigen::Vector3d forward = -center.normalized(), down(0, 1, 0);
    rig[c].id = absl::StrCat("cam<", c, ">");
    rig[c].rotation.row(0) = down.cross(forward);
    rig[c].rotation.row(1) = down;
    rig[c].rotation.row(2) = forward;
    rig[c].translation_mm = -rig[c].rotation * center;
  }
  return rig;
}

std::string Drawn(const std::vector<CameraModel>& cameras) {
  RigDrawing drawing(FromAbove());
  for (const CameraModel& camera : cameras) drawing.Hold(camera.CenterWorld());
  for (const CameraModel& camera : cameras) drawing.AddCamera(camera, "point", ": 3 views", true);
  return drawing.Figure();
}

int Occurrences(const std::string& text, const std::string& what) {
  int count = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(RigDrawing, EveryCameraOfASmallRigBearsItsName) {
  const std::string svg = Drawn(Circle(16, 2000));
  EXPECT_EQ(Occurrences(svg, "class=\"names\""), 16);
  EXPECT_THAT(svg, HasSubstr(">cam&lt;7&gt;</text>"));
  EXPECT_THAT(svg, HasSubstr("<title>cam&lt;7&gt;: 3 views</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("without room")));
}

TEST(RigDrawing, NamesWithoutRoomAreCounted) {
  std::vector<CameraModel> rig = Circle(400, 2000);
  const std::string svg = Drawn(rig);
  const int named = Occurrences(svg, "class=\"names\"");
  EXPECT_LT(named, 400);
  EXPECT_THAT(svg, HasSubstr(absl::StrCat("; ", 400 - named, " cameras without room for a name")));
}

TEST(RigDrawing, NamesDoNotLieOnEachOther) {
  const std::string svg = Drawn(Circle(60, 2000));
  const std::regex text("class=\"names\" x=\"([0-9.]+)\" y=\"([0-9.]+)\"");
  std::vector<std::pair<double, double>> places;
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it)
    places.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
  ASSERT_GT(places.size(), 40u);
  for (size_t a = 0; a < places.size(); ++a)
    for (size_t b = 0; b < a; ++b)
      EXPECT_TRUE(std::abs(places[a].first - places[b].first) > 25 ||
                  std::abs(places[a].second - places[b].second) > 8.9)
          << a << " " << b;
}

TEST(RigDrawing, ScaleBarIsARoundLengthInTheDrawingsScale) {
  RigDrawing drawing(FromAbove());
  drawing.Hold({-1000, 0, 0});
  drawing.Hold({1000, 0, 500});
  const std::string svg = drawing.Figure();
  EXPECT_THAT(svg, HasSubstr("500\xC2\xA0mm</text>"));
  const double length =
      drawing.Place({500, 0, 0}).x() - drawing.Place({0, 0, 0}).x();  // of 500 mm, in the picture
  EXPECT_THAT(svg, HasSubstr(absl::StrCat("h", static_cast<int>(length), ".0m0")));
}

}  // namespace
}  // namespace weft

#include "simulation/wardrobe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/angles.h"
#include "base/status_macros.h"

namespace weft {
namespace {

using Vec2 = Eigen::Vector2d;
using Eigen::Vector3d;

// The T-shirt's measures, [mm]; heights from the point where shoulder and neck meet.
constexpr double kNeck = 80, kShoulder = 205, kShoulderDrop = 38, kChest = 240, kUnderarm = 225;
constexpr double kSleeve = 185, kCuff = 160, kSleeveSeam = 110;
constexpr double kNeckHeight = -372;  // of that point over the pelvis
constexpr double kLayerDepth = 45;    // of front and back from the middle when put on
constexpr double kOpeningWay = 140;   // below the underarm, until an open shirt is round
// Half axes of an open hem of half width 256: as long around as the cloth, and outside of the skirt's waist.
constexpr double kOpenSide = 188, kOpenFront = 136;
// The skirt's: half of the circumferences, and its length.
constexpr double kWaist = 208, kSkirtHem = 330, kSkirtLength = 470;
constexpr double kDressingArm = 60 * kRadPerDeg;

std::vector<Vec2> Line(const Vec2& a, const Vec2& b) { return {a, b}; }

std::vector<Vec2> Mirrored(std::vector<Vec2> path) {
  for (Vec2& p : path) p.x() = -p.x();
  return path;
}
std::vector<Vec2> Reversed(std::vector<Vec2> path) {
  std::reverse(path.begin(), path.end());
  return path;
}

// From the shoulder's tip to the underarm, at +x.
std::vector<Vec2> Armhole() {
  return BezierPath({kShoulder, kShoulderDrop}, {190, 110}, {195, 218}, {kChest, kUnderarm});
}

// Front or back as seen from outside; `plus` and `minus` name the sides at +x and -x.
Panel Trunk(const std::string& name, const std::string& plus, const std::string& minus, double neck_control,
            const ShirtCut& cut) {
  const Vec2 neck(kNeck, 0), shoulder(kShoulder, kShoulderDrop), underarm(kChest, kUnderarm),
      hem(cut.hem, cut.length);
  const auto mirror = [](const Vec2& p) { return Vec2(-p.x(), p.y()); };
  const std::string hole = "armhole_" + name + "_";
  return {name,
          {{"shoulder_" + plus, "N_" + plus, "S_" + plus, Line(neck, shoulder)},
           {hole + plus, "S_" + plus, "U_" + plus, Armhole()},
           {"side_" + plus, "U_" + plus, "H_" + plus, Line(underarm, hem)},
           {"hem_" + name, "H_" + plus, "H_" + minus, Line(hem, mirror(hem))},
           {"side_" + minus, "H_" + minus, "U_" + minus, Line(mirror(hem), mirror(underarm))},
           {hole + minus, "U_" + minus, "S_" + minus, Reversed(Mirrored(Armhole()))},
           {"shoulder_" + minus, "S_" + minus, "N_" + minus, Line(mirror(shoulder), mirror(neck))},
           {"neck_" + name, "N_" + minus, "N_" + plus,
            BezierPath(mirror(neck), {-kNeck + 8, neck_control}, {kNeck - 8, neck_control}, neck)}}};
}

// Half a sleeve's cap, from the underarm to the shoulder's tip.
std::vector<Vec2> HalfCap(double height) {
  return BezierPath({-kSleeve, height}, {-kSleeve + 60, height - 5}, {-75, 0}, {0, 0});
}

// Height at which both halves of the cap are as long as the armhole.
double CapHeight() {
  const double goal = LengthMm(Armhole());
  double low = 20, high = 200;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (LengthMm(HalfCap(middle)) < goal ? low : high) = middle;
  }
  return (low + high) / 2;
}

// As seen from outside; -x is the front for the right sleeve and the back for the left one.
Panel Sleeve(const std::string& side, const std::string& minus_panel, const std::string& plus_panel) {
  const double cap = CapHeight();
  const Vec2 underarm(kSleeve, cap), cuff(kCuff, cap + kSleeveSeam);
  const auto mirror = [](const Vec2& p) { return Vec2(-p.x(), p.y()); };
  const std::string u = "U_" + side, s = "S_" + side, c = "C_" + side;
  return {"sleeve_" + side,
          {{"armhole_" + minus_panel + "_" + side, u, s, HalfCap(cap)},
           {"armhole_" + plus_panel + "_" + side, s, u, Reversed(Mirrored(HalfCap(cap)))},
           {"sleeve_" + side, u, c, Line(underarm, cuff)},
           {"cuff_" + side, c, c, Line(cuff, mirror(cuff))},
           {"sleeve_" + side, c, u, Line(mirror(cuff), mirror(underarm))}},
          true};
}

double CollarHeight(double cell_mm) { return std::max(22.0, 3.5 * cell_mm); }

// Distance from a place of a front or back panel to the seams that join the two.
double SeamDistance(const Vec2& p, const ShirtCut& cut) {
  const auto to_segment = [&](const Vec2& a, const Vec2& b) {
    const Vec2 q(std::abs(p.x()), p.y()), d = b - a;
    const double t = std::clamp((q - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    return (q - a - t * d).norm();
  };
  return std::min(to_segment({kNeck, 0}, {kShoulder, kShoulderDrop}),
                  to_segment({kChest, kUnderarm}, {cut.hem, cut.length}));
}

Vector3d TrunkStart(const Vec2& p, bool is_back, const ShirtCut& cut) {
  const double t = std::clamp(SeamDistance(p, cut) / 80, 0.0, 1.0);
  double x = p.x(), z = kLayerDepth * std::sqrt(t * (2 - t));
  if (cut.open && p.y() > kUnderarm) {
    // An ellipse at the hem, as long around as the cloth; above it the shape goes over into the flat one.
    const double half_width = kChest + (p.y() - kUnderarm) / (cut.length - kUnderarm) * (cut.hem - kChest);
    const double scale = half_width / cut.hem, angle = std::numbers::pi / 2 * p.x() / half_width;
    const double open = std::clamp((p.y() - kUnderarm) / kOpeningWay, 0.0, 1.0),
                 s = open * open * (3 - 2 * open);
    x += s * (kOpenSide * scale * std::sin(angle) - x);
    z += s * (kOpenFront * scale * std::cos(angle) - z);
  }
  return is_back ? Vector3d(-x, p.y() + kNeckHeight, z) : Vector3d(x, p.y() + kNeckHeight, -z);
}

// A point of a path of vertices: `at` in intervals.
Vector3d Along(const std::vector<int>& vertices, const std::vector<Vector3d>& x, double at) {
  const double clamped = std::clamp(at, 0.0, static_cast<double>(vertices.size() - 1));
  const size_t k = std::min(static_cast<size_t>(clamped), vertices.size() - 2);
  const double t = clamped - static_cast<double>(k);
  return (1 - t) * x[vertices[k]] + t * x[vertices[k + 1]];
}

// Spans a sleeve as a ruled surface between its armhole, which is in place, and a ring around the arm.
class SleeveStart {
 public:
  SleeveStart(const SewnPanels& sewn, double side, const std::string& name, std::vector<Vector3d>& x)
      : side_(side), x_(x), cap_(HalfCap(CapHeight())), cap_height_(CapHeight()) {
    const std::string minus = side > 0 ? "front" : "back", plus = side > 0 ? "back" : "front";
    minus_ = sewn.of_seam.at("armhole_" + minus + "_" + name);
    plus_ = sewn.of_seam.at("armhole_" + plus + "_" + name);
    // From the underarm to the shoulder. The shoulder is the higher end; y points down.
    for (std::vector<int>* seam : {&minus_, &plus_})
      if (x[seam->front()].y() < x[seam->back()].y()) std::reverse(seam->begin(), seam->end());
  }

  Vector3d At(const Vec2& p) const {
    const double down = std::clamp((p.y() - cap_height_) / kSleeveSeam, 0.0, 1.0);
    const double across = std::clamp(p.x() / (kSleeve + down * (kCuff - kSleeve)), -1.0, 1.0);
    // The place of the cap on the same line along the arm.
    const double at = -std::abs(across) * kSleeve;
    size_t k = 0;
    while (k + 2 < cap_.size() && cap_[k + 1].x() < at) ++k;
    const double t = std::clamp((at - cap_[k].x()) / (cap_[k + 1].x() - cap_[k].x()), 0.0, 1.0);
    const std::vector<Vec2> before(cap_.begin(), cap_.begin() + k + 1);
    const double length = LengthMm(before) + t * (cap_[k + 1] - cap_[k]).norm();
    const std::vector<int>& seam = across < 0 ? minus_ : plus_;
    const double share = length / LengthMm(cap_);
    const Vector3d from = Along(seam, x_, share * static_cast<double>(seam.size() - 1));
    const double cap_y = cap_[k].y() + t * (cap_[k + 1].y() - cap_[k].y());
    const double out = std::clamp((p.y() - cap_y) / (cap_height_ + kSleeveSeam - cap_y), 0.0, 1.0);
    return from + out * (RingAt(across) - from);
  }

 private:
  Vector3d RingAt(double across) const {
    const Vector3d arm(side_ * std::sin(kDressingArm), std::cos(kDressingArm), 0);
    const Vector3d up(side_ * std::cos(kDressingArm), -std::sin(kDressingArm), 0);
    const Vector3d center = Vector3d(side_ * 205, -240, 0) + 150 * arm;
    const double angle = std::numbers::pi * across;
    return center + 80 * std::cos(angle) * up + Vector3d(0, 0, side_ * 38 * std::sin(angle));
  }

  double side_;
  const std::vector<Vector3d>& x_;
  std::vector<Vec2> cap_;
  double cap_height_;
  std::vector<int> minus_, plus_;
};

}  // namespace

BodyPose DressingPose() {
  BodyPose pose;
  pose.left.arm_out = pose.right.arm_out = kDressingArm;
  return pose;
}

BodyPose NaturalPose() {
  BodyPose pose;
  pose.left.arm_out = pose.right.arm_out = 38 * kRadPerDeg;
  pose.left.elbow = pose.right.elbow = 12 * kRadPerDeg;
  return pose;
}

std::vector<Panel> TShirtPanels(double cell_mm, const ShirtCut& cut) {
  std::vector<Panel> panels = {Trunk("front", "R", "L", 122, cut), Trunk("back", "L", "R", 34, cut),
                               Sleeve("L", "back", "front"), Sleeve("R", "front", "back")};
  const double front = LengthMm(panels[0].outline.back().path_mm);
  const double back = LengthMm(panels[1].outline.back().path_mm);
  const double around = front + back, height = CollarHeight(cell_mm);
  panels.push_back({"collar",
                    {{"neck_front", "N_L", "N_R", Line({0, height}, {front, height})},
                     {"neck_back", "N_R", "N_L", Line({front, height}, {around, height})},
                     {"collar", "N_L", "T", Line({around, height}, {around, 0})},
                     {"neck", "T", "T", Line({around, 0}, {0, 0})},
                     {"collar", "T", "N_L", Line({0, 0}, {0, height})}},
                    true});
  return panels;
}

absl::StatusOr<Outfit> MakeTShirt(double cell_mm, const ShirtCut& cut) {
  const std::vector<Panel> panels = TShirtPanels(cell_mm, cut);
  WEFT_ASSIGN_OR_RETURN(SewnPanels sewn, SewPanels(panels, cell_mm));
  Outfit out;
  out.start_mm.assign(sewn.place_of_vertex.size(), Vector3d::Zero());
  for (size_t v = 0; v < out.start_mm.size(); ++v) {
    const PanelPlace& place = sewn.place_of_vertex[v];
    if (place.panel <= 1) out.start_mm[v] = TrunkStart(place.at_mm, place.panel == 1, cut);
  }
  const SleeveStart left(sewn, -1, "L", out.start_mm), right(sewn, 1, "R", out.start_mm);
  const std::vector<int>&front = sewn.of_seam.at("neck_front"), &back = sewn.of_seam.at("neck_back");
  const double front_mm = LengthMm(panels[4].outline[0].path_mm),
               back_mm = LengthMm(panels[4].outline[1].path_mm);
  const double height = CollarHeight(cell_mm);
  for (size_t v = 0; v < out.start_mm.size(); ++v) {
    const auto& [panel, at] = sewn.place_of_vertex[v];
    if (panel == 2) out.start_mm[v] = left.At(at);
    if (panel == 3) out.start_mm[v] = right.At(at);
    if (panel != 4) continue;
    const double share_front = at.x() / front_mm, share_back = (at.x() - front_mm) / back_mm;
    const Vector3d foot =
        share_front <= 1 ? Along(front, out.start_mm, share_front * static_cast<double>(front.size() - 1))
                         : Along(back, out.start_mm, share_back * static_cast<double>(back.size() - 1));
    out.start_mm[v] = foot + (1 - at.y() / height) * Vector3d(-0.12 * foot.x(), -height, -0.15 * foot.z());
  }
  out.sewn = std::move(sewn);
  return out;
}

// The skirt's waist is held on an ellipse, its hem hangs on a wider one.
std::vector<Panel> SkirtPanels() {
  const auto half = [](const std::string& name, const std::string& plus, const std::string& minus) -> Panel {
    const Vec2 waist(kWaist, 0), hem(kSkirtHem, kSkirtLength);
    const auto mirror = [](const Vec2& p) { return Vec2(-p.x(), p.y()); };
    return {name,
            {{"side_" + plus, "W_" + plus, "H_" + plus, Line(waist, hem)},
             {"hem_" + name, "H_" + plus, "H_" + minus, Line(hem, mirror(hem))},
             {"side_" + minus, "H_" + minus, "W_" + minus, Line(mirror(hem), mirror(waist))},
             {"waist_" + name, "W_" + minus, "W_" + plus, Line(mirror(waist), waist)}}};
  };
  return {half("front", "R", "L"), half("back", "L", "R")};
}

absl::StatusOr<Outfit> MakeSkirt(double cell_mm) {
  WEFT_ASSIGN_OR_RETURN(SewnPanels sewn, SewPanels(SkirtPanels(), cell_mm));
  Outfit out;
  for (const auto& [panel, at] : sewn.place_of_vertex) {
    const double down = at.y() / kSkirtLength, half_width = kWaist + down * (kSkirtHem - kWaist);
    const double angle = std::numbers::pi / 2 * at.x() / half_width, side = panel == 0 ? 1 : -1;
    // Half an ellipse each, as wide as the cloth.
    const double scale = half_width / kWaist;
    out.start_mm.emplace_back(side * 152 * scale * std::sin(angle), 5 + at.y(),
                              -side * 110 * scale * std::cos(angle));
  }
  for (const char* border : {"waist_front", "waist_back"})
    for (const int v : sewn.of_seam.at(border)) out.waist.push_back(v);
  std::sort(out.waist.begin(), out.waist.end());
  out.waist.erase(std::unique(out.waist.begin(), out.waist.end()), out.waist.end());
  out.sewn = std::move(sewn);
  return out;
}

}  // namespace weft

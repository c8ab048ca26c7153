#include "tests/benchmark/layered_sheets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"
#include "figure/capsule.h"
#include "simulation/random.h"
#include "simulation/renderer.h"

namespace weft::testing {
namespace {

constexpr double kCellMm = 2.7;
constexpr int kBoardCols = 460;

class Dice {
 public:
  Dice(uint64_t seed, std::string_view use) : key_(KeyOf(seed, use)) {}
  double Uniform(double least, double most) { return least + (most - least) * UniformOf(key_, count_++); }
  bool Once(double probability) { return Uniform(0, 1) < probability; }

 private:
  uint64_t key_;
  uint64_t count_ = 0;
};

// A sum of waves: how the direction of the cloth, seen from above, changes along s.
struct Folds {
  double turn = 0;  // from one side to the other
  struct Wave {
    double size = 0, length_mm = 1, phase = 0, lean_mm = 1;
    double end_mm = 1, end_phase = 0;  // folds begin and end along t
  };
  std::array<Wave, 3> waves;

  static Folds Roll(Dice& dice, double turn, double deepest) {
    Folds folds{.turn = turn, .waves = {}};
    constexpr double kLengthsMm[] = {110, 55, 30}, kShares[] = {0.5, 0.9, 0.8};
    for (size_t k = 0; k < folds.waves.size(); ++k) {
      folds.waves[k] = {kShares[k] * dice.Uniform(0.3, 1) * deepest,
                        kLengthsMm[k] * dice.Uniform(0.7, 1.4),
                        dice.Uniform(0, 2 * M_PI),
                        dice.Uniform(40, 250) * (dice.Once(0.5) ? 1 : -1),
                        dice.Uniform(25, 60),
                        dice.Uniform(0, 2 * M_PI)};
    }
    return folds;
  }
  double DirectionAt(double s, double t, double width_mm) const {
    double direction = turn * (s / width_mm - 0.5);
    for (const Wave& wave : waves)
      direction += wave.size * (0.6 + 0.4 * std::sin(t / wave.end_mm + wave.end_phase)) *
                   std::sin(2 * M_PI * s / wave.length_mm + wave.phase + t / wave.lean_mm);
    return direction;
  }
};

// A sheet in mm: s across, t down. Panels meet at the breaks.
struct SheetPlan {
  std::vector<double> s_breaks, t_breaks;  // ascending, both ends included
  Folds folds;
  bool has_tape = false;  // thread along the seams
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
};

std::vector<double> Breaks(Dice& dice, double length_mm, double least_mm, double most_mm) {
  std::vector<double> breaks = {0};
  while (length_mm - breaks.back() > least_mm + most_mm)
    breaks.push_back(breaks.back() + dice.Uniform(least_mm, most_mm));
  breaks.push_back(length_mm);
  return breaks;
}

// Takes places on a board for panels, in shelves.
class BoardShelves {
 public:
  Eigen::Vector2d Take(double width_cells, double height_cells) {
    if (x_ + width_cells > kBoardCols - 1) {
      y_ += shelf_;
      x_ = 1;
      shelf_ = 0;
    }
    const Eigen::Vector2d corner(x_, y_);
    x_ += width_cells + 1;
    shelf_ = std::max(shelf_, height_cells + 1);
    return corner;
  }
  int Rows() const { return static_cast<int>(std::ceil(y_ + shelf_)) + 1; }

 private:
  double x_ = 1, y_ = 1, shelf_ = 0;
};

// From (s, t) in mm to the board.
struct PanelFrame {
  Eigen::Vector2d along_s, along_t, origin;

  // Half of the panels lie nearly along the board's rows, as in most garments.
  PanelFrame(Dice& dice, const Eigen::Vector2d& first, const Eigen::Vector2d& size, BoardShelves& shelves) {
    const double quarter = 0.5 * M_PI * std::floor(dice.Uniform(0, 4));
    const double angle = dice.Once(0.5) ? quarter + dice.Uniform(-0.08, 0.08) : dice.Uniform(0, 2 * M_PI);
    along_s = Eigen::Vector2d(std::cos(angle), std::sin(angle)) / kCellMm;
    along_t = Eigen::Vector2d(-std::sin(angle), std::cos(angle)) / kCellMm;
    Eigen::AlignedBox2d box(Eigen::Vector2d(0, 0));
    for (const double s : {0.0, size.x()}) {
      for (const double t : {0.0, size.y()}) box.extend(s * along_s + t * along_t);
    }
    const Eigen::Vector2d corner = shelves.Take(box.sizes().x() + 1, box.sizes().y() + 1);
    const Eigen::Vector2d shift(dice.Uniform(0, 1), dice.Uniform(0, 1));
    origin = corner + shift - box.min() - first.x() * along_s - first.y() * along_t;
  }
  BoardPoint At(double s, double t) const { return origin + s * along_s + t * along_t; }
};

// Grid lines between breaks, at most a cell apart, with lines beside the seams for the tape.
struct Lines {
  std::vector<double> at_mm;
  std::vector<int> panel;  // [lines - 1], -1 for tape
};

Lines LinesOf(const std::vector<double>& breaks, bool has_tape) {
  constexpr double kTapeMm = 0.5;  // half of its width
  Lines lines;
  lines.at_mm.push_back(breaks.front());
  for (size_t k = 0; k + 1 < breaks.size(); ++k) {
    const bool begins = k > 0 && has_tape, ends = k + 2 < breaks.size() && has_tape;
    const double from = breaks[k] + (begins ? kTapeMm : 0), to = breaks[k + 1] - (ends ? kTapeMm : 0);
    if (begins) {
      lines.at_mm.push_back(from);
      lines.panel.push_back(-1);
    }
    const int steps = static_cast<int>(std::ceil((to - from) / kCellMm));
    for (int i = 1; i <= steps; ++i) {
      lines.at_mm.push_back(from + (to - from) * i / steps);
      lines.panel.push_back(static_cast<int>(k));
    }
  }
  return lines;
}

// How far a seam draws the cloth in.
double GrooveMm(const std::vector<double>& breaks, double at_mm) {
  constexpr double kDeepMm = 1.2, kWideMm = 3;
  double groove = 0;
  for (size_t k = 1; k + 1 < breaks.size(); ++k) {
    const double d = (at_mm - breaks[k]) / kWideMm;
    groove += kDeepMm * std::exp(-d * d);
  }
  return groove;
}

// Places along a line of constant t, in the sheet's own axes: x right, z away from the camera.
std::vector<Eigen::Vector3d> BentLine(const SheetPlan& plan, const std::vector<double>& s_mm, double t) {
  constexpr double kStepMm = 0.4;
  std::vector<Eigen::Vector3d> line;
  Eigen::Vector3d at(0, t, 0);
  double s = 0;
  for (const double end : s_mm) {
    const int steps = std::max(1, static_cast<int>((end - s) / kStepMm));
    const double step = (end - s) / steps;
    for (int k = 0; k < steps; ++k) {
      const double direction = plan.folds.DirectionAt(s + 0.5 * step, t, s_mm.back());
      at += step * Eigen::Vector3d(std::cos(direction), 0, std::sin(direction));
      s += step;
    }
    line.push_back(at + Eigen::Vector3d(0, 0, GrooveMm(plan.s_breaks, end) + GrooveMm(plan.t_breaks, t)));
  }
  const Eigen::Vector3d middle = 0.5 * (line.front() + line.back());
  for (Eigen::Vector3d& p : line) p -= Eigen::Vector3d(middle.x(), 0, middle.z());
  return line;
}

struct Layers {
  TriangleMesh mesh;
  ClothPrint print;
  BoardShelves shelves;

  void Add(const SheetPlan& plan, Dice& dice) {
    std::vector<PanelFrame> frames;
    for (size_t i = 0; i + 1 < plan.t_breaks.size(); ++i) {
      for (size_t j = 0; j + 1 < plan.s_breaks.size(); ++j) {
        const Eigen::Vector2d first(plan.s_breaks[j], plan.t_breaks[i]);
        const Eigen::Vector2d last(plan.s_breaks[j + 1], plan.t_breaks[i + 1]);
        frames.emplace_back(dice, first, last - first, shelves);
      }
    }
    const Lines across = LinesOf(plan.s_breaks, plan.has_tape), down = LinesOf(plan.t_breaks, plan.has_tape);
    const int first_vertex = static_cast<int>(mesh.vertices_mm.size());
    const int columns = static_cast<int>(across.at_mm.size());
    const double half_mm = 0.5 * down.at_mm.back();
    for (const double t : down.at_mm) {
      for (const Eigen::Vector3d& p : BentLine(plan, across.at_mm, t))
        mesh.vertices_mm.push_back(plan.pose * (p - Eigen::Vector3d(0, half_mm, 0)));
    }
    const int panels_across = static_cast<int>(plan.s_breaks.size()) - 1;
    for (size_t i = 0; i < down.panel.size(); ++i) {
      for (size_t j = 0; j < across.panel.size(); ++j) {
        const bool is_tape = down.panel[i] < 0 || across.panel[j] < 0;
        const PanelFrame* frame =
            is_tape ? nullptr : &frames[static_cast<size_t>(panels_across) * down.panel[i] + across.panel[j]];
        const auto corner = [&](size_t di, size_t dj) {
          return std::pair(first_vertex + static_cast<int>(i + di) * columns + static_cast<int>(j + dj),
                           frame != nullptr ? frame->At(across.at_mm[j + dj], down.at_mm[i + di])
                                            : BoardPoint::Constant(std::numeric_limits<double>::quiet_NaN()));
        };
        const std::array q = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
        for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
          mesh.faces.push_back({q[a].first, q[b].first, q[c].first});
          print.of_face.push_back({q[a].second, q[b].second, q[c].second});
        }
      }
    }
  }
};

SheetPlan PlanBack(Dice& dice) {
  const double width_mm = 520, height_mm = 430;
  SheetPlan plan;
  plan.s_breaks = Breaks(dice, width_mm, 45, 110);
  plan.t_breaks = Breaks(dice, height_mm, 60, 150);
  plan.folds = Folds::Roll(dice, dice.Uniform(0, 2.9), dice.Uniform(0.7, 1.7));
  plan.has_tape = dice.Once(0.5);
  plan.pose = Eigen::AngleAxisd(dice.Uniform(-0.4, 0.4), Eigen::Vector3d::UnitZ()) *
              Eigen::AngleAxisd(dice.Uniform(-0.4, 0.4), Eigen::Vector3d::UnitX());
  return plan;
}

SheetPlan PlanFlap(Dice& dice) {
  SheetPlan plan;
  const double width_mm = dice.Uniform(50, 150), height_mm = dice.Uniform(90, 200);
  plan.s_breaks = dice.Once(0.3) ? std::vector{0.0, dice.Uniform(0.35, 0.65) * width_mm, width_mm}
                                 : std::vector{0.0, width_mm};
  plan.t_breaks = {0.0, height_mm};
  plan.folds = Folds::Roll(dice, dice.Uniform(-1, 3.2), dice.Uniform(0.5, 1.6));
  plan.has_tape = dice.Once(0.5);
  plan.pose =
      Eigen::Translation3d(dice.Uniform(-170, 170), dice.Uniform(-150, 150), dice.Uniform(-110, -60)) *
      Eigen::AngleAxisd(dice.Uniform(-M_PI, M_PI), Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(dice.Uniform(-0.5, 0.5), Eigen::Vector3d::UnitX());
  return plan;
}

TriangleMesh Fingers(Dice& dice) {
  TriangleMesh mesh;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d a(dice.Uniform(-180, 180), dice.Uniform(-150, 150), dice.Uniform(-160, -120));
    const Eigen::Vector3d way(dice.Uniform(-60, 60), dice.Uniform(-60, 60), dice.Uniform(-20, 20));
    AppendCapsuleFaces(static_cast<int>(mesh.vertices_mm.size()), mesh.faces);
    for (const Eigen::Vector3d& p : CapsuleVertices({a, a + way, dice.Uniform(7, 9), dice.Uniform(8, 11)}))
      mesh.vertices_mm.push_back(p);
  }
  return mesh;
}

// Two of three pictures are small parts of a larger one, enlarged.
bool IsCrop(int view) { return view % 3 != 2; }

CameraModel MakeCamera(Dice& dice, int view) {
  CameraModel camera;
  camera.id = absl::StrCat("c0", view);
  camera.width_px = IsCrop(view) ? 330 : 900, camera.height_px = IsCrop(view) ? 300 : 780;
  constexpr double kDistanceMm = 1400;
  camera.fx_px = camera.fy_px = dice.Uniform(4.4, 6.6) / kCellMm * kDistanceMm;
  const double aside_px = IsCrop(view) ? 220 : 0;
  camera.cx_px = 0.5 * camera.width_px + dice.Uniform(-aside_px, aside_px);
  camera.cy_px = 0.5 * camera.height_px + dice.Uniform(-aside_px, aside_px);
  camera.rotation = (Eigen::AngleAxisd(dice.Uniform(-0.5, 0.5), Eigen::Vector3d::UnitX()) *
                     Eigen::AngleAxisd(dice.Uniform(-0.7, 0.7), Eigen::Vector3d::UnitY()))
                        .toRotationMatrix();
  camera.translation_mm = {0, 0, kDistanceMm};
  return camera;
}

CameraOptions MakeOptics(Dice& dice, uint64_t seed) {
  CameraOptions options;
  options.lens.point_spread_sigma_px = dice.Uniform(0.6, 1.05);
  options.lens.f_number = dice.Once(0.3) ? 4 : 0;
  options.lens.focus_error_mm = 15;
  options.sensor.readout = Readout::kColor;
  options.sensor.exposure = dice.Uniform(0.4, 1.6);
  options.sensor.full_well_electrons = dice.Uniform(6000, 20000);
  options.sensor.color_variation = 0.05;
  options.sensor.sharpening = dice.Once(0.3) ? 0.4 : 0;
  options.sensor.seed = seed;
  return options;
}

absl::StatusOr<Frame> Enlarge(const Frame& image, int quality, double factor) {
  const auto bytes = EncodeJpeg({image.width_px, image.height_px, 3, 8, *image.pixels}, quality);
  if (!bytes.ok()) return bytes.status();
  auto decoded = DecodeJpeg(*bytes);
  if (!decoded.ok()) return decoded.status();
  const cv::Mat small(image.height_px, image.width_px, CV_8UC3, decoded->values.data());
  cv::Mat large;
  cv::resize(small, large, {}, factor, factor, cv::INTER_CUBIC);
  Frame out = image;
  out.width_px = large.cols;
  out.height_px = large.rows;
  out.pixels = std::make_shared<std::vector<uint8_t>>(large.data, large.data + large.total() * 3);
  return out;
}

// Pixel x of a picture is at (x + 0.5) factor - 0.5 of the one enlarged.
void EnlargeTruth(double x_factor, double y_factor, ViewTruth* truth) {
  for (NodeTruth& node : truth->nodes) {
    node.pixel_px = {(node.pixel_px.x() + 0.5) * x_factor - 0.5, (node.pixel_px.y() + 0.5) * y_factor - 0.5};
    node.pitch_px *= std::sqrt(x_factor * y_factor);
  }
}

}  // namespace

absl::StatusOr<LayeredScene> MakeLayers(uint64_t seed) {
  Dice dice(seed, "layers");
  Layers layers;
  layers.Add(PlanBack(dice), dice);
  for (int k = 0; k < 5; ++k) layers.Add(PlanFlap(dice), dice);
  auto board = GenerateBoard(layers.shelves.Rows(), kBoardCols, kCellMm, KeyOf(seed, "board"));
  if (!board.ok()) return board.status();
  StudioOptions look;
  look.light.rays = 64;
  look.inks.seed = KeyOf(seed, "inks");
  look.fabric.seed = KeyOf(seed, "fabric");
  look.room.seed = KeyOf(seed, "backdrop");
  auto scene = StudioScene::Build({std::move(layers.mesh), {}}, std::move(layers.print), *board,
                                  {Fingers(dice), {}}, look);
  if (!scene.ok()) return scene.status();
  return LayeredScene{*std::move(board), *std::move(scene)};
}

absl::StatusOr<LayeredView> FilmLayers(const LayeredScene& layered, uint64_t seed, int view) {
  Dice dice(seed, absl::StrCat("view", view));
  const StudioScene& scene = layered.scene;
  LayeredView out;
  out.camera = MakeCamera(dice, view);
  const auto picture = RenderView(scene, out.camera, MakeOptics(dice, KeyOf(seed, "sensor")), 0);
  if (!picture.ok()) return picture.status();
  out.image = ToFrame(*picture);
  out.truth = FindViewTruth(scene.mesh(), PrintLocator(scene.print()), scene.rays(), out.camera);
  if (!IsCrop(view)) return out;
  const int quality = static_cast<int>(dice.Uniform(72, 92));
  auto enlarged = Enlarge(out.image, quality, dice.Uniform(1.4, 3.1));
  if (!enlarged.ok()) return enlarged.status();
  EnlargeTruth(static_cast<double>(enlarged->width_px) / out.image.width_px,
               static_cast<double>(enlarged->height_px) / out.image.height_px, &out.truth);
  out.image = *std::move(enlarged);
  return out;
}

}  // namespace weft::testing

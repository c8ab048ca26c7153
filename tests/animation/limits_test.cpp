// What options and learnt numbers may be, and how a wrong one is named.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "animation/atlas/atlas.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/paper/graph_fit.h"
#include "animation/paper/graph_tracker.h"
#include "animation/paper/pixel_avatar.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "tests/services/work/animation/small_avatar.h"

namespace weft {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// How each change is answered; empty where it is allowed.
template <typename Options>
struct Limit {
  std::function<void(Options&)> change;
  const char* message;
};

template <typename Options>
void ExpectLimits(const Options& good, const std::vector<Limit<Options>>& limits) {
  EXPECT_EQ(good.Validate().message(), "");
  for (size_t k = 0; k < limits.size(); ++k) {
    Options options = good;
    limits[k].change(options);
    EXPECT_EQ(options.Validate().message(), limits[k].message) << k;
    EXPECT_EQ(options.Validate().ok(), limits[k].message[0] == 0);
  }
}

TEST(Limits, OfAnAtlas) {
  using O = AtlasOptions;
  ExpectLimits<O>({}, {{[](O& o) { o.level = 0; }, ""},
                       {[](O& o) { o.level = 6; }, ""},
                       {[](O& o) { o.level = -1; }, "atlas: level must be 0 to 6"},
                       {[](O& o) { o.level = 7; }, "atlas: level must be 0 to 6"},
                       {[](O& o) { o.gutter = 0; }, ""},
                       {[](O& o) { o.gutter = 16; }, ""},
                       {[](O& o) { o.gutter = -1; }, "atlas: gutter must be 0 to 16"},
                       {[](O& o) { o.gutter = 17; }, "atlas: gutter must be 0 to 16"},
                       {[](O& o) { o.multiple = 1; }, ""},
                       {[](O& o) { o.multiple = 256; }, ""},
                       {[](O& o) { o.multiple = 0; }, "atlas: multiple must be 1 to 256"},
                       {[](O& o) { o.multiple = 257; }, "atlas: multiple must be 1 to 256"}});
}

TEST(Limits, OfADeformationGraph) {
  using O = GraphOptions;
  ExpectLimits<O>({}, {{[](O& o) { o.nodes = 2; }, ""},
                       {[](O& o) { o.nodes = 1000; }, ""},
                       {[](O& o) { o.nodes = 1; }, "graph: nodes must be 2 to 1000"},
                       {[](O& o) { o.nodes = 1001; }, "graph: nodes must be 2 to 1000"},
                       {[](O& o) { o.nodes_of_vertex = 1; }, ""},
                       {[](O& o) { o.nodes_of_vertex = 16; }, ""},
                       {[](O& o) { o.nodes_of_vertex = 0; }, "graph: nodes_of_vertex must be 1 to 16"},
                       {[](O& o) { o.nodes_of_vertex = 17; }, "graph: nodes_of_vertex must be 1 to 16"}});
}

TEST(Limits, OfTheFitOfAGraph) {
  using O = GraphFitOptions;
  ExpectLimits<O>({}, {{[](O& o) { o.distortion = 1e-9; }, ""},
                       {[](O& o) { o.distortion = 0; }, "graph fit: distortion must be positive"},
                       {[](O& o) { o.distortion = kNan; }, "graph fit: distortion must be positive"},
                       {[](O& o) { o.max_steps = 1; }, ""},
                       {[](O& o) { o.max_steps = 0; }, "graph fit: max_steps must be at least 1"},
                       {[](O& o) { o.tolerance_mm = 0; }, ""},
                       {[](O& o) { o.tolerance_mm = -1; }, "graph fit: tolerance_mm must not be negative"}});
}

TEST(Limits, OfTheTrackingOfAGraph) {
  using O = GraphTrackerOptions;
  const char* const kBad = "graph tracking: a number is out of its limits";
  ExpectLimits<O>({}, {{[](O& o) { o.max_rays = 100; }, ""},
                       {[](O& o) { o.max_rays = 99; }, kBad},
                       {[](O& o) { o.min_rays = 10; }, ""},
                       {[](O& o) { o.min_rays = 9; }, kBad},
                       {[](O& o) { o.max_steps = 1; }, ""},
                       {[](O& o) { o.max_steps = 0; }, kBad},
                       {[](O& o) { o.spread_mm = 0; }, kBad},
                       {[](O& o) { o.robust_spreads = 0; }, kBad},
                       {[](O& o) { o.rays_of_view = 0; }, kBad},
                       {[](O& o) { o.agreeing_mm = 0; }, kBad},
                       {[](O& o) { o.min_agreeing_share = 0; }, ""},
                       {[](O& o) { o.min_agreeing_share = 1; }, ""},
                       {[](O& o) { o.min_agreeing_share = -0.1; }, kBad},
                       {[](O& o) { o.min_agreeing_share = 1.1; }, kBad},
                       {[](O& o) { o.min_agreeing_share = kNan; }, kBad}});
}

TEST(Limits, OfAnIsometricFitAndOfThePolish) {
  using O = IsometricOptions;
  ExpectLimits<O>({},
                  {{[](O& o) { o.least_strain = 0; }, "isometric fit: least_strain must be positive"},
                   {[](O& o) { o.tail_freedom = 0; }, "isometric fit: tail_freedom must be positive"},
                   {[](O& o) { o.bend_share = 0; }, "isometric fit: bend_share must be positive"},
                   {[](O& o) { o.max_steps = 1; }, ""},
                   {[](O& o) { o.max_steps = 0; }, "isometric fit: max_steps must be at least 1"},
                   {[](O& o) { o.steps_of_factor = 1; }, ""},
                   {[](O& o) { o.steps_of_factor = 0; }, "isometric fit: steps_of_factor must be at least 1"},
                   {[](O& o) { o.tolerance_mm = 0; }, "isometric fit: tolerance_mm must be positive"}});
  using P = PolishOptions;
  ExpectLimits<P>({}, {{[](P& p) { p.carrier_sigma_mm = 0; }, "polish: carrier_sigma_mm must be positive"},
                       {[](P& p) { p.rounds = 1; }, ""},
                       {[](P& p) { p.rounds = 10; }, ""},
                       {[](P& p) { p.rounds = 0; }, "polish: rounds must be 1 to 10"},
                       {[](P& p) { p.rounds = 11; }, "polish: rounds must be 1 to 10"},
                       {[](P& p) { p.outlier_spreads = 0; }, "polish: outlier_spreads must be positive"},
                       {[](P& p) { p.fit.max_steps = 0; }, "isometric fit: max_steps must be at least 1"}});
}

TEST(Limits, OfDriving) {
  using O = SparseViewOptions;
  const char* const kSigma = "driving: cloth_sigma_px must be at least 0.01";
  ExpectLimits<O>(
      {}, {{[](O& o) { o.cloth_sigma_px = 0.01; }, ""},
           {[](O& o) { o.cloth_sigma_px = 0.009; }, kSigma},
           {[](O& o) { o.cloth_sigma_px = kNan; }, kSigma},
           {[](O& o) { o.cloth_sigma_px = INFINITY; }, kSigma},
           {[](O& o) { o.driver.polish.rounds = 0; }, "polish: rounds must be 1 to 10"},
           {[](O& o) { o.driver.tracker.max_rays = 100; }, ""},
           {[](O& o) { o.driver.tracker.max_rays = 99; }, "tracking: max_rays must be at least 100"},
           {[](O& o) { o.driver.tracker.min_rays = 10; }, ""},
           {[](O& o) { o.driver.tracker.min_rays = 9; }, "tracking: min_rays must be at least 10"},
           {[](O& o) { o.driver.tracker.agreeing_size = 0; }, "tracking: agreeing_size must be positive"},
           {[](O& o) { o.driver.tracker.min_agreeing_share = 0; }, ""},
           {[](O& o) { o.driver.tracker.min_agreeing_share = 1; }, ""},
           {[](O& o) { o.driver.tracker.min_agreeing_share = -0.1; },
            "tracking: min_agreeing_share must be 0 to 1"},
           {[](O& o) { o.driver.tracker.min_agreeing_share = 1.1; },
            "tracking: min_agreeing_share must be 0 to 1"},
           {[](O& o) { o.driver.tracker.robust_spreads = 0; }, "tracking: robust_spreads must be positive"},
           {[](O& o) { o.driver.tracker.rays_of_view = 0; }, "tracking: rays_of_view must be positive"},
           {[](O& o) { o.driver.tracker.max_steps = 1; }, ""},
           {[](O& o) { o.driver.tracker.max_steps = 0; }, "tracking: max_steps must be at least 1"},
           {[](O& o) { o.driver.tracker.local.regions = -1; }, "local shape: regions must be 0 to 200"}});
}

TEST(Limits, OfLearning) {
  using O = SparseViewTraining;
  ExpectLimits<O>(
      {}, {{[](O& o) { o.components = 1; }, ""},
           {[](O& o) { o.components = 256; }, ""},
           {[](O& o) { o.components = 0; }, "avatar: components must be 1 to 256"},
           {[](O& o) { o.components = 257; }, "avatar: components must be 1 to 256"},
           {[](O& o) { o.max_frames = 10; }, ""},
           {[](O& o) { o.max_frames = 9; }, "avatar: max_frames must be at least 10"},
           {[](O& o) { o.calibration_frames = 1; }, ""},
           {[](O& o) { o.calibration_frames = 0; }, "avatar: calibration_frames must be at least 1"}});
  using S = ShapeSpaceOptions;
  ExpectLimits<S>({}, {{[](S& s) { s.components = 1; }, ""},
                       {[](S& s) { s.components = 512; }, ""},
                       {[](S& s) { s.components = 0; }, "shape space: components must be 1 to 512"},
                       {[](S& s) { s.components = 513; }, "shape space: components must be 1 to 512"},
                       {[](S& s) { s.rounds = 1; }, ""},
                       {[](S& s) { s.rounds = 20; }, ""},
                       {[](S& s) { s.rounds = 0; }, "shape space: rounds must be 1 to 20"},
                       {[](S& s) { s.rounds = 21; }, "shape space: rounds must be 1 to 20"}});
}

TEST(Limits, OfTheNumbersOfAnAvatar) {
  using A = SparseViewAvatar;
  const char* const kNotFinite = "shape space: holds a number that is not finite";
  const char* const kSigmas = "shape space: the sigmas must be positive and fall";
  const char* const kAccelerations = "avatar: the accelerations must be positive, one per component";
  const char* const kLeft = "avatar: what the space leaves must be positive, one number per vertex";
  const char* const kEdges = "avatar: lengths of edges and their spreads must be positive and as many";
  const char* const kFollow =
      "avatar: the shares by which edges follow the carrier must be 0 to 1, one per edge";
  const char* const kScales = "avatar: the scales of sigma must be positive";
  const auto nan = static_cast<float>(kNan);
  ExpectLimits<A>(
      SmallAvatar(),
      {{[](A& a) { a = SmallAvatar(3); }, ""},
       {[](A& a) { a.space.vertices = 2; }, "shape space: has fewer than three vertices"},
       {[](A& a) { a.space.mean_mm.push_back(1); }, "shape space: the mean is of another number of vertices"},
       {[](A& a) { a.space.sigma_mm.clear(); }, "shape space: has no components"},
       {[](A& a) { a.space.basis.pop_back(); }, "shape space: basis and sigmas differ in their number"},
       {[=](A& a) { a.space.mean_mm[2] = nan; }, kNotFinite},
       {[=](A& a) { a.space.basis[2] = nan; }, kNotFinite},
       {[=](A& a) { a.space.sigma_mm[0] = nan; }, kNotFinite},
       {[](A& a) { a.space.left_mm = kNan; }, kNotFinite},
       {[](A& a) {
          a.space.sigma_mm = {30, 0};
        },
        kSigmas},
       {[](A& a) {
          a.space.sigma_mm = {12, 12};
        },
        ""},
       {[](A& a) {
          a.space.sigma_mm = {12, 13};
        },
        kSigmas},
       {[](A& a) { a.space.left_mm = 0; }, ""},
       {[](A& a) { a.space.left_mm = -1; }, "shape space: what is left must not be negative"},
       {[](A& a) { a.fps = 0; }, "avatar: fps must be positive"},
       {[](A& a) { a.fps = INFINITY; }, "avatar: fps must be positive"},
       {[](A& a) { a.acceleration.pop_back(); }, kAccelerations},
       {[](A& a) { a.acceleration[1] = 0; }, kAccelerations},
       {[](A& a) { a.left_mm.push_back(1); }, kLeft},
       {[](A& a) { a.left_mm[1] = INFINITY; }, kLeft},
       {[](A& a) { a.edge_mm.pop_back(); }, kEdges},
       {[](A& a) { a.edge_mm[0] = 0; }, kEdges},
       {[](A& a) { a.edge_spread_mm[0] = 0; }, kEdges},
       {[](A& a) { a.edge_follow.pop_back(); }, kFollow},
       {[](A& a) { a.edge_follow[0] = 1; }, ""},
       {[](A& a) { a.edge_follow[0] = 1.1f; }, kFollow},
       {[](A& a) { a.edge_follow[0] = -0.1f; }, kFollow},
       {[](A& a) { a.sigma.of[3][3] = 0; }, kScales},
       {[](A& a) { a.sigma.of[0][1] = INFINITY; }, kScales}});
}

// A graph of three nodes whose prior has two layers.
PixelAvatar SomePixels() {
  PixelAvatar out;
  out.graph.nodes = 3;
  out.prior.unit.assign(12, 0.5f);
  out.prior.layers = {{1, 2, {1, 2}, {3, 4}}, {2, 12, std::vector<float>(24, 1), std::vector<float>(12, 0)}};
  out.net.onnx = "net";
  return out;
}

TEST(Limits, OfTheNumbersOfAnAvatarOfPixels) {
  using A = PixelAvatar;
  const char* const kOther = "avatar of pixels: it has a prior of another graph";
  const char* const kFollow = "prior of the graph: a layer does not follow the one before";
  const char* const kWeights = "prior of the graph: a layer has another number of weights than its size says";
  const char* const kFinite = "prior of the graph: a weight is not finite";
  const auto nan = static_cast<float>(kNan);
  ExpectLimits<A>(
      SomePixels(),
      {{[](A& a) { a.graph.nodes = 1; }, "graph: nodes must be 2 to 1000"},
       {[](A& a) { a.graph.nodes = 4; }, ""},
       {[](A& a) { a.graph.nodes = 2; }, kOther},
       {[](A& a) { a.prior.unit.clear(); }, kOther},
       {[](A& a) { a.prior.unit.push_back(1); }, "prior of the graph: is of 13 numbers, the graph has 12"},
       {[](A& a) { a.prior.layers.clear(); }, "prior of the graph: has no layers"},
       {[](A& a) { a.prior.layers[0].from = 0; }, "prior of the graph: has no layers"},
       {[](A& a) { a.prior.layers[1].from = 3; }, kFollow},
       {[](A& a) { a.prior.layers[1].to = 0; }, kFollow},
       {[](A& a) { a.prior.layers[0].bias.push_back(1); }, kWeights},
       {[](A& a) { a.prior.layers[1].weight.pop_back(); }, kWeights},
       {[=](A& a) { a.prior.layers[1].weight[3] = nan; }, kFinite},
       {[=](A& a) { a.prior.layers[0].bias[0] = nan; }, kFinite},
       {[](A& a) { a.prior.layers.pop_back(); }, "prior of the graph: makes 2 numbers, the graph has 12"},
       {[=](A& a) { a.prior.unit[3] = nan; }, "prior of the graph: a unit is not finite"},
       {[](A& a) { a.fps = 0; }, "avatar of pixels: fps must be positive"},
       {[](A& a) { a.fps = INFINITY; }, "avatar of pixels: fps must be positive"},
       {[](A& a) { a.left_mm = -1; }, "avatar of pixels: left_mm must not be negative"},
       {[](A& a) { a.left_mm = INFINITY; }, "avatar of pixels: left_mm must not be negative"},
       {[](A& a) { a.net.onnx.clear(); }, "avatar of pixels: it has no net"},
       {[](A& a) { a.net.atlas.level = 7; }, "atlas: level must be 0 to 6"}});
}

TEST(Limits, TablesOfAnAvatarOfPixelsAreNamed) {
  const auto why_not = [](const std::function<void(std::vector<AvatarTable>&)>& change) {
    std::vector<AvatarTable> tables = TablesOf(SomePixels());
    change(tables);
    PixelAvatar read;
    return std::string(TakeTables(tables, &read).message());
  };
  using Tables = std::vector<AvatarTable>;
  const std::string graph = "avatar of pixels: the table \"graph\" is missing",
                    unit = "avatar of pixels: the table \"unit\" is missing",
                    sense = "avatar of pixels: the table \"graph\" makes no sense";
  EXPECT_EQ(why_not([](Tables&) {}), "");
  EXPECT_EQ(why_not([](Tables& t) { t[0].values.push_back(1), t[0].columns = 3; }), graph);
  EXPECT_EQ(why_not([](Tables& t) { t[0].values.pop_back(); }), graph);
  EXPECT_EQ(why_not([](Tables& t) { t[0].rows = 0, t[0].values.clear(); }), graph);
  EXPECT_EQ(why_not([](Tables& t) { t[1].name = "units"; }), unit);
  EXPECT_EQ(why_not([](Tables& t) { t[1].rows = 2, t[1].columns = 6; }), unit);
  EXPECT_EQ(why_not([](Tables& t) { t[0].values = {0, 5}; }), sense);
  EXPECT_EQ(why_not([](Tables& t) { t[0].values = {3, 1001}; }), sense);
  EXPECT_EQ(why_not([](Tables& t) { t[0].values = {1, 1000}; }), "");
  PixelAvatar read;
  ASSERT_TRUE(TakeTables(TablesOf(SomePixels()), &read).ok());
  EXPECT_EQ(read.graph.nodes, 3);
  EXPECT_EQ(read.graph.nodes_of_vertex, 5);
  ASSERT_EQ(read.prior.layers.size(), 2u);
  EXPECT_EQ(read.prior.layers[0].from, 1);
  EXPECT_EQ(read.prior.layers[1].to, 12);
}

TEST(Limits, TablesOfAnAvatarAreNamed) {
  const auto why_not = [](const std::string& name, const std::function<void(AvatarTable&)>& change) {
    std::vector<AvatarTable> tables = TablesOf(SmallAvatar());
    for (AvatarTable& table : tables)
      if (table.name == name) change(table);
    SparseViewAvatar read;
    return std::string(TakeTables(tables, &read).message());
  };
  const auto longer = [](AvatarTable& table) {
    ++table.columns, table.values.resize(table.values.size() + table.rows, 1);
  };
  EXPECT_EQ(why_not("", longer), "");
  EXPECT_EQ(why_not("mean_mm", longer), "avatar: the mean has no three numbers for each vertex");
  EXPECT_EQ(why_not("mean_mm", [](AvatarTable& table) { table.rows = 0; }),
            "avatar: the table \"mean_mm\" is 0 x 12, which does not fit the others");
  for (const auto& [name, size] : {std::pair("basis", "2 x 13"),
                                   {"space_left_mm", "1 x 2"},
                                   {"acceleration", "1 x 3"},
                                   {"left_mm", "1 x 5"},
                                   {"edge_spread_mm", "1 x 4"},
                                   {"edge_follow", "1 x 4"},
                                   {"sigma_factors", "4 x 5"}})
    EXPECT_EQ(why_not(name, longer), std::string("avatar: the table \"") + name + "\" is " + size +
                                         ", which does not fit the others");
  for (const char* name : {"mean_mm", "basis", "component_sigma_mm", "space_left_mm", "acceleration",
                           "left_mm", "edge_mm", "edge_spread_mm"}) {
    EXPECT_EQ(why_not(name, [](AvatarTable& table) { table.name = "other"; }),
              std::string("avatar: the table \"") + name + "\" is missing");
    EXPECT_NE(why_not(name, [](AvatarTable& table) { table.values.pop_back(); }), "") << name;
  }
  SparseViewAvatar read;
  ASSERT_TRUE(TakeTables(TablesOf(SmallAvatar()), &read).ok());
  EXPECT_EQ(read.space.left_mm, 0.75);
  EXPECT_EQ(read.space.vertices, 4);
  EXPECT_EQ(read.left_mm, SmallAvatar().left_mm);
  EXPECT_EQ(read.acceleration, SmallAvatar().acceleration);
  EXPECT_EQ(read.edge_spread_mm, SmallAvatar().edge_spread_mm);
}

}  // namespace
}  // namespace weft

// Templates of garments that were built: right ones pass, and wrong ones of any kind do not.
#include "alignment/template_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <random>

#include "alignment/template_build/build_template.h"
#include "simulation/wardrobe.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

struct Built {
  std::string name;
  Board board;
  Template garment;
};

// From a cloud of every cell, as it is put on.
Built BuildOf(const Outfit& outfit, const std::string& name, double max_gap_mm) {
  const Garment& garment = outfit.sewn.garment;
  Built out{name, {name, garment.board_rows, garment.board_cols, garment.cell_mm, 0.75, {}}, {}};
  for (int i = 0; i < garment.board_rows * garment.board_cols; ++i)
    out.board.cells.push_back(
        static_cast<CellColor>((i % garment.board_cols + 3 * (i / garment.board_cols)) % kCellColors));
  Cloud cloud;
  for (size_t v = 0; v < garment.cell_of_vertex.size(); ++v) {
    const VertexNode& cell = garment.cell_of_vertex[v];
    if (cell.row < 0) continue;
    CloudPoint point;
    point.position_mm = outfit.start_mm[v];
    point.node = {cell.row, cell.col, NodeKind::kCenter};
    cloud.points.push_back(point);
  }
  TemplateBuildOptions options;
  options.seams.max_gap_mm = max_gap_mm;
  options.panels.cut_pitches = 4;
  const auto built = BuildTemplate(out.board, {{cloud}, {}, {}}, options);
  EXPECT_TRUE(built.ok()) << name << ": " << built.status();
  if (built.ok()) out.garment = built->garment;
  return out;
}

// Twenty of different garments and fineness; built once.
const std::vector<Built>& Garments() {
  static const auto* const kAll = [] {
    auto* all = new std::vector<Built>;
    for (int i = 0; i < 10; ++i) {
      const double cell_mm = 11 + 0.8 * i;
      const auto shirt = MakeTShirt(cell_mm, {.length = 640.0 + 10 * i});
      const auto skirt = MakeSkirt(cell_mm);
      EXPECT_TRUE(shirt.ok() && skirt.ok());
      all->push_back(BuildOf(*shirt, "shirt", 6.8 * cell_mm));
      all->push_back(BuildOf(*skirt, "skirt", 0));
    }
    return all;
  }();
  return *kAll;
}

TEST(TemplateCheck, RightTemplatesPass) {
  for (const Built& built : Garments()) {
    EXPECT_TRUE(CheckTemplateMap(built.garment).ok())
        << built.name << ": " << CheckTemplateMap(built.garment);
    Template again = built.garment;
    const auto on_board = PutOnBoard(built.board, FaceSideSaid::kNothing, false, &again);
    ASSERT_TRUE(on_board.ok()) << built.name << ": " << on_board.status();
    EXPECT_EQ(on_board->turned.faces, 0);
    EXPECT_EQ(again.rest.faces, built.garment.rest.faces);
    EXPECT_THAT(on_board->size.unchecked, ::testing::IsEmpty());
    EXPECT_NEAR(on_board->size.scales[0].median, 1, kScaleSaid);
    EXPECT_NEAR(on_board->size.scales[0].Worst(), 1, kScaleRefused);
    const EnclosedVolume volume = VolumeWithin(again.rest.vertices_mm, again.rest.faces);
    EXPECT_GT(volume.Roundness(), 0.15) << built.name;
    EXPECT_LT(volume.Openness(), 0.27) << built.name;
  }
}

std::vector<int> BlanksOf(const Template& garment) {
  std::vector<int> blanks;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v)
    if (garment.node_of_vertex[v].row < 0) blanks.push_back(static_cast<int>(v));
  return blanks;
}

// The board says nothing of them, their neighbours do.
TEST(TemplateCheck, VerticesWithoutACellInAnotherOrderAreRefused) {
  int tried = 0;
  for (const Built& built : Garments()) {
    const std::vector<int> blanks = BlanksOf(built.garment);
    if (blanks.size() < 20) continue;
    Template wrong = built.garment;
    std::vector<Eigen::Vector3d>& places = wrong.rest.vertices_mm;
    const std::vector<Eigen::Vector3d> right = places;
    for (size_t i = 0; i < blanks.size(); ++i)
      places[static_cast<size_t>(blanks[i])] = right[static_cast<size_t>(blanks[blanks.size() - 1 - i])];
    EXPECT_THAT(std::string(CheckTemplateMap(wrong).message()),
                HasSubstr("vertices without cells. Mesh and map are not in the same order"))
        << built.name;
    // Two that lie far apart.
    places = right;
    const auto far = std::max_element(blanks.begin(), blanks.end(), [&](int a, int b) {
      const Eigen::Vector3d& from = right[static_cast<size_t>(blanks[0])];
      return (right[static_cast<size_t>(a)] - from).norm() < (right[static_cast<size_t>(b)] - from).norm();
    });
    std::swap(places[static_cast<size_t>(blanks[0])], places[static_cast<size_t>(*far)]);
    EXPECT_FALSE(CheckTemplateMap(wrong).ok()) << built.name;
    ++tried;
  }
  EXPECT_GT(tried, 5);
}

class Random {
 public:
  explicit Random(uint64_t seed) : random_(seed) {}
  int Below(size_t n) { return std::uniform_int_distribution<int>(0, static_cast<int>(n) - 1)(random_); }
  double Within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool With(double chance) { return Within(0, 1) < chance; }
  template <typename T>
  void Shuffle(T begin, T end) {
    std::shuffle(begin, end, random_);
  }

 private:
  std::mt19937_64 random_;
};

int SomeCell(const Template& garment, Random& random) {
  for (;;) {
    const int v = random.Below(garment.node_of_vertex.size());
    if (garment.node_of_vertex[static_cast<size_t>(v)].row >= 0) return v;
  }
}

// The map's line of vertex order[i] goes to vertex i.
void Renumber(const std::vector<int>& order, Template& garment) {
  const std::vector<VertexNode> old = garment.node_of_vertex;
  for (size_t i = 0; i < order.size(); ++i) garment.node_of_vertex[i] = old[static_cast<size_t>(order[i])];
}

std::vector<int> InOrder(const Template& garment) {
  std::vector<int> order(garment.node_of_vertex.size());
  std::iota(order.begin(), order.end(), 0);
  return order;
}

using Change = std::function<void(Template&, Random&)>;
struct Kind {
  const char* name;
  Change change;
};

std::vector<Kind> Renumberings() {
  const auto rotate = [](Template& garment, int by) {
    std::vector<VertexNode>& nodes = garment.node_of_vertex;
    const auto n = static_cast<int>(nodes.size());
    std::rotate(nodes.begin(), nodes.begin() + (by % n + n) % n, nodes.end());
  };
  return {
      {"shifted by a line", [rotate](Template& g, Random& r) { rotate(g, r.With(0.5) ? 1 : -1); }},
      {"shifted", [rotate](Template& g, Random& r) { rotate(g, 2 + r.Below(50)); }},
      {"reversed",
       [](Template& g, Random&) { std::reverse(g.node_of_vertex.begin(), g.node_of_vertex.end()); }},
      {"shuffled",
       [](Template& g, Random& r) { r.Shuffle(g.node_of_vertex.begin(), g.node_of_vertex.end()); }},
      {"two exchanged",
       [](Template& g, Random& r) {
         const int a = SomeCell(g, r);
         int b = a;
         while (b == a) b = SomeCell(g, r);
         std::swap(g.node_of_vertex[static_cast<size_t>(a)], g.node_of_vertex[static_cast<size_t>(b)]);
       }},
      {"two neighbours exchanged",
       [](Template& g, Random& r) {
         for (;;) {
           const Face& face = g.rest.faces[static_cast<size_t>(r.Below(g.rest.faces.size()))];
           auto &a = g.node_of_vertex[static_cast<size_t>(face[0])],
                &b = g.node_of_vertex[static_cast<size_t>(face[1])];
           if (a.row < 0 || b.row < 0) continue;
           std::swap(a, b);
           return;
         }
       }},
      {"some permuted",
       [](Template& g, Random& r) {
         const int n = 10 + r.Below(200), first = r.Below(g.node_of_vertex.size() / 2);
         r.Shuffle(g.node_of_vertex.begin() + first, g.node_of_vertex.begin() + first + n);
       }},
      {"some lines moved",
       [](Template& g, Random& r) {
         const int n = 50 + r.Below(200), first = r.Below(g.node_of_vertex.size() / 2);
         const auto from = g.node_of_vertex.begin() + first;
         std::rotate(from, from + 1 + r.Below(20), from + n);
       }},
      {"a line lost",
       [](Template& g, Random& r) {
         g.node_of_vertex.erase(g.node_of_vertex.begin() + r.Below(g.node_of_vertex.size() / 2));
         g.node_of_vertex.push_back({});
       }},
      {"sorted by place",
       [](Template& g, Random& r) {
         std::vector<int> order = InOrder(g);
         const int axis = r.Below(3);
         std::sort(order.begin(), order.end(), [&](int a, int b) {
           return g.rest.vertices_mm[static_cast<size_t>(a)][axis] <
                  g.rest.vertices_mm[static_cast<size_t>(b)][axis];
         });
         Renumber(order, g);
       }},
      {"in the order of the faces",
       [](Template& g, Random& r) {
         std::vector<Face> faces = g.rest.faces;
         r.Shuffle(faces.begin(), faces.end());
         std::vector<int> order;
         std::vector<bool> seen(g.node_of_vertex.size(), false);
         for (const Face& face : faces)
           for (const int v : face)
             if (!seen[static_cast<size_t>(v)]) seen[static_cast<size_t>(v)] = true, order.push_back(v);
         Renumber(order, g);
       }},
  };
}

void ChangeCells(Template& garment, const std::function<VertexNode(const VertexNode&)>& change) {
  for (VertexNode& node : garment.node_of_vertex)
    if (node.row >= 0) node = change(node);
}

void TurnAll(Template& garment) {
  for (Face& face : garment.rest.faces) std::swap(face[1], face[2]);
}

std::vector<Kind> Mirrorings() {
  const auto either = [](Template& g, Random& r) {  // whatever way faces run
    if (r.With(0.5)) TurnAll(g);
  };
  return {
      {"rows from below",
       [either](Template& g, Random& r) {
         ChangeCells(g, [](const VertexNode& n) { return VertexNode{1000 - n.row, n.col, n.kind}; });
         either(g, r);
       }},
      {"columns from the right",
       [either](Template& g, Random& r) {
         ChangeCells(g, [](const VertexNode& n) { return VertexNode{n.row, 1000 - n.col, n.kind}; });
         either(g, r);
       }},
      {"col row",
       [either](Template& g, Random& r) {
         ChangeCells(g, [](const VertexNode& n) { return VertexNode{n.col, n.row, n.kind}; });
         either(g, r);
       }},
      {"an axis with the other sign",
       [either](Template& g, Random& r) {
         const int axis = r.Below(3);
         for (Eigen::Vector3d& v : g.rest.vertices_mm) v[axis] = -v[axis];
         either(g, r);
       }},
      {"two axes exchanged",
       [either](Template& g, Random& r) {
         const int axis = r.Below(3);
         for (Eigen::Vector3d& v : g.rest.vertices_mm) std::swap(v[axis], v[(axis + 1) % 3]);
         either(g, r);
       }},
  };
}

std::vector<Kind> Scalings() {
  return {
      {"another size",
       [](Template& g, Random& r) {
         const double scale = std::exp(r.Within(std::log(1.06), std::log(1000.0)) * (r.With(0.5) ? 1 : -1));
         for (Eigen::Vector3d& v : g.rest.vertices_mm) v *= scale;
       }},
      {"stretched along an axis",
       [](Template& g, Random& r) {
         const int axis = r.Below(2);  // shirts lie nearly flat: hardly an edge runs along their depth
         const double scale = r.With(0.5) ? r.Within(1.1, 2) : r.Within(0.5, 0.9);
         for (Eigen::Vector3d& v : g.rest.vertices_mm) v[axis] *= scale;
       }},
  };
}

void ExpectRefused(const std::vector<Kind>& kinds, int cases, uint64_t seed) {
  for (int i = 0; i < cases; ++i) {
    const Built& built = Garments()[static_cast<size_t>(i) % Garments().size()];
    const Kind& kind = kinds[static_cast<size_t>(i / 7) % kinds.size()];
    Random random(seed + static_cast<uint64_t>(i));
    Template wrong = built.garment;
    kind.change(wrong, random);
    const auto on_board = PutOnBoard(built.board, FaceSideSaid::kNothing, false, &wrong);
    EXPECT_EQ(on_board.status().code(), absl::StatusCode::kInvalidArgument)
        << "case " << i << ", " << built.name << ", " << kind.name;
  }
}

TEST(TemplateCheck, RenumberedOnesAreRefused) { ExpectRefused(Renumberings(), 110, 1); }
TEST(TemplateCheck, MirroredOnesAreRefused) { ExpectRefused(Mirrorings(), 50, 2); }
TEST(TemplateCheck, OnesOfAnotherSizeAreRefused) { ExpectRefused(Scalings(), 40, 3); }

TEST(TemplateCheck, TurnedFacesAreTurnedBack) {
  for (int i = 0; i < 40; ++i) {
    const Built& built = Garments()[static_cast<size_t>(i) % Garments().size()];
    Random random(100 + static_cast<uint64_t>(i));
    const double share = i % 4 == 0 ? 1 : random.Within(0.001, 1);
    Template turned = built.garment;
    int count = 0;
    for (Face& face : turned.rest.faces)
      if (random.With(share)) std::swap(face[1], face[2]), ++count;
    EXPECT_THAT(std::string(CheckTemplateMap(turned).message()), HasSubstr(absl::StrCat(count, " of ")));
    const auto on_board = PutOnBoard(built.board, FaceSideSaid::kNothing, false, &turned);
    ASSERT_TRUE(on_board.ok()) << i << ": " << on_board.status();
    EXPECT_EQ(on_board->turned.faces, count);
    EXPECT_EQ(turned.rest.faces, built.garment.rest.faces);
  }
}

TEST(TemplateCheck, SizesWithinFivePercentAreSaid) {
  for (int i = 0; i < 40; ++i) {
    const Built& built = Garments()[static_cast<size_t>(i) % Garments().size()];
    Random random(200 + static_cast<uint64_t>(i));
    const auto right = CheckTemplateOnBoard(built.garment, built.board, false);
    ASSERT_TRUE(right.ok());
    // Of the one that deviates already, so that the whole deviation is known.
    const double scale = 1 + random.Within(0.012, 0.045) * (random.With(0.5) ? 1 : -1);
    Template other = built.garment;
    for (Eigen::Vector3d& v : other.rest.vertices_mm) v *= scale / right->scales[0].Worst();
    const auto size = CheckTemplateOnBoard(other, built.board, false);
    ASSERT_TRUE(size.ok()) << i << ": " << size.status();
    EXPECT_THAT(size->off, ::testing::SizeIs(1)) << i << ", scale " << scale;
  }
}

}  // namespace
}  // namespace weft

#include "physics/cloth_contacts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/impact_zones.h"
#include "physics/nearest_points.h"
#include "physics/parallel.h"

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr size_t kChunk = 1024;  // elements that a task looks at; fixes the order of the pairs
constexpr double kMargin = 0.8;  // candidates are listed this much farther than they count, relative

uint64_t BoxKey(int x, int y, int z) {
  const int bias = 1 << 20;
  return static_cast<uint64_t>(x + bias) << 42 | static_cast<uint64_t>(y + bias) << 21 |
         static_cast<uint64_t>(z + bias);
}

// Entries sorted into buckets by a hash of their key; the order within a bucket is that of insertion.
class HashedBoxes {
 public:
  struct Entry {
    uint64_t key;
    int element;
  };

  explicit HashedBoxes(const std::vector<Entry>& entries) : entries_(entries.size()) {
    size_t size = 1;
    while (size < entries.size()) size *= 2;
    mask_ = size - 1;
    start_.assign(size + 1, 0);
    for (const Entry& e : entries) ++start_[BucketOf(e.key) + 1];
    for (size_t b = 0; b < size; ++b) start_[b + 1] += start_[b];
    std::vector<uint32_t> used(start_.begin(), start_.end() - 1);
    for (const Entry& e : entries) entries_[used[BucketOf(e.key)]++] = e;
  }
  size_t BucketOf(uint64_t key) const { return (key * 0x9e3779b97f4a7c15ULL >> 24) & mask_; }
  size_t buckets() const { return mask_ + 1; }
  const Entry* begin(size_t bucket) const { return entries_.data() + start_[bucket]; }
  const Entry* end(size_t bucket) const { return entries_.data() + start_[bucket + 1]; }

 private:
  size_t mask_;
  std::vector<uint32_t> start_;
  std::vector<Entry> entries_;
};

// Points in a hashed grid of cubic boxes.
class PointGrid {
 public:
  PointGrid(const std::vector<Vector3d>& points, double box_mm)
      : box_mm_(box_mm), boxes_(EntriesOf(points)) {}

  // Calls visit(point) for all points in the boxes that the cube of half size `reach` around p touches.
  template <typename Visit>
  void Around(const Vector3d& p, double reach, const Visit& visit) const {
    const Eigen::Vector3i low = BoxOf(p - Vector3d::Constant(reach)),
                          high = BoxOf(p + Vector3d::Constant(reach));
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int z = low.z(); z <= high.z(); ++z) {
          const uint64_t key = BoxKey(x, y, z);
          const size_t bucket = boxes_.BucketOf(key);
          for (const auto* e = boxes_.begin(bucket); e != boxes_.end(bucket); ++e)
            if (e->key == key) visit(e->element);
        }
  }

 private:
  Eigen::Vector3i BoxOf(const Vector3d& p) const { return (p / box_mm_).array().floor().cast<int>(); }
  std::vector<HashedBoxes::Entry> EntriesOf(const std::vector<Vector3d>& points) const {
    std::vector<HashedBoxes::Entry> out;
    out.reserve(points.size());
    for (const Vector3d& p : points) {
      const Eigen::Vector3i box = BoxOf(p);
      out.push_back({BoxKey(box.x(), box.y(), box.z()), static_cast<int>(out.size())});
    }
    return out;
  }

  double box_mm_;
  HashedBoxes boxes_;
};

// Runs `visit(i, out)` over all elements; the chunks' results are joined in order.
template <typename Result, typename Visit>
void Collect(size_t count, const Visit& visit, std::vector<Result>& out) {
  const size_t chunks = (count + kChunk - 1) / kChunk;
  std::vector<std::vector<Result>> found(chunks);
  tbb::parallel_for(size_t{0}, chunks, [&](size_t k) {
    for (size_t i = k * kChunk; i < std::min(count, (k + 1) * kChunk); ++i) visit(i, found[k]);
  });
  for (const std::vector<Result>& part : found) out.insert(out.end(), part.begin(), part.end());
}

using PairPlaces = std::array<Vector3d, 4>;  // of a pair's vertices

NearestPoints NearestOf(bool is_edges, const PairPlaces& x) {
  return is_edges ? NearestOfEdges(x[0], x[1], x[2], x[3]) : NearestOnTriangle(x[0], x[1], x[2], x[3]);
}

// How far the first element is from the second along a direction.
double Separation(bool is_edges, const PairPlaces& x, const Vector3d& normal) {
  const double a = normal.dot(x[0]), b = normal.dot(x[1]), c = normal.dot(x[2]), d = normal.dot(x[3]);
  return is_edges ? std::min(a, b) - std::max(c, d) : a - std::max({b, c, d});
}

// What must remain of a pair's distance after a step. Layers that a body presses together step by step end
// up at the least of them, not at none.
double LeastDistance(double distance, const KeepApartOptions& o) {
  const double least = std::min(0.1 * o.thickness_mm, 0.3 * distance);
  return o.planes_turn ? std::max(least, std::min(0.95 * distance, 0.03 * o.thickness_mm)) : least;
}

// Whether two elements keep `least` at the end of their way and do not meet before. The plane between them
// is found anew in parts of the way, so long elements that lie close to each other may turn together.
// `at`: PairPlaces after a share of the way.
template <typename At>
bool StayApart(bool is_edges, const At& at, double least) {
  if (NearestOf(is_edges, at(1)).distance_mm < least) return false;
  const auto apart_in = [&](int parts) {
    for (int k = 0; k < parts; ++k) {
      const Vector3d normal = NearestOf(is_edges, at(static_cast<double>(k) / parts)).normal;
      if (!(Separation(is_edges, at(static_cast<double>(k + 1) / parts), normal) >= 0.5 * least))
        return false;
    }
    return true;
  };
  return apart_in(4) || apart_in(64);
}

// Displacements beyond the common rigid motion.
struct LimitedMotion {
  std::vector<Vector3d> carried, move;  // where the rigid motion leads, and the way from there
  std::vector<uint8_t> is_limited;      // 1: the way was shortened
};

// Shortens ways that are longer than `longest`; `to` follows.
LimitedMotion Limited(const std::vector<Vector3d>& from, const Eigen::Isometry3d& carry, double longest,
                      std::vector<Vector3d>& to) {
  const size_t n = from.size();
  LimitedMotion out{std::vector<Vector3d>(n), std::vector<Vector3d>(n), std::vector<uint8_t>(n, 0)};
  ForEachIndex(n, [&](size_t v) {
    out.carried[v] = carry * from[v];
    out.move[v] = to[v] - out.carried[v];
    const double length = out.move[v].norm();
    if (length > longest) {
      out.move[v] *= longest / length;
      to[v] = out.carried[v] + out.move[v];
      out.is_limited[v] = 1;
    }
  });
  return out;
}

bool StaysApart(const ContactPair& p, const LimitedMotion& motion, const std::vector<Vector3d>& to,
                const Eigen::Isometry3d& carry, const KeepApartOptions& options) {
  const auto at = [&](double share) {
    PairPlaces out;
    for (int i = 0; i < 4; ++i) out[i] = motion.carried[p.v[i]] + share * motion.move[p.v[i]];
    return out;
  };
  const double least = LeastDistance(p.distance_mm, options);
  const PairPlaces end = {to[p.v[0]], to[p.v[1]], to[p.v[2]], to[p.v[3]]};
  return Separation(p.is_edges, end, carry.linear() * p.normal) >= least ||
         (options.planes_turn && StayApart(p.is_edges, at, least));
}

}  // namespace

ContactFinder::ContactFinder(int vertices, const std::vector<Face>& faces, double reach_mm)
    : faces_(faces), reach_mm_(reach_mm), margin_mm_(kMargin * reach_mm) {
  for (const Face& f : faces)
    for (int k = 0; k < 3; ++k)
      edges_.push_back({std::min(f[k], f[(k + 1) % 3]), std::max(f[k], f[(k + 1) % 3])});
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  std::vector<std::vector<int>> of(vertices);
  for (const auto& [a, b] : edges_) of[a].push_back(b), of[b].push_back(a);
  neighbor_first_ = {0};
  for (std::vector<int>& list : of) {
    std::sort(list.begin(), list.end());
    neighbor_.insert(neighbor_.end(), list.begin(), list.end());
    neighbor_first_.push_back(static_cast<int>(neighbor_.size()));
  }
}

bool ContactFinder::Joined(int a, int b) const {
  return std::binary_search(neighbor_.begin() + neighbor_first_[a],
                            neighbor_.begin() + neighbor_first_[a + 1], b);
}

void ContactFinder::ListVerticesAtFaces(const std::vector<Vector3d>& x, double reach) {
  at_faces_.clear();
  std::vector<double> size(faces_.size());  // half the size of a face
  std::vector<Vector3d> center(faces_.size());
  double mean = 0;
  for (size_t f = 0; f < faces_.size(); ++f) {
    const Vector3d &a = x[faces_[f][0]], &b = x[faces_[f][1]], &c = x[faces_[f][2]];
    const Vector3d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    center[f] = (low + high) / 2;
    size[f] = (high - low).maxCoeff() / 2;
    mean += size[f] / static_cast<double>(faces_.size());
  }
  const PointGrid grid(x, 2 * (mean + reach));
  Collect(
      faces_.size(),
      [&](size_t f, std::vector<Candidate>& found) {
        const Face& t = faces_[f];
        const double far = size[f] + reach;
        grid.Around(center[f], far, [&](int v) {
          if (((x[v] - center[f]).array().abs() > far).any()) return;
          if (v == t[0] || v == t[1] || v == t[2]) return;
          const float distance = NearestOnTriangle(x[v], x[t[0]], x[t[1]], x[t[2]]).distance_mm;
          if (distance < reach) found.push_back({v, static_cast<int>(f), distance});
        });
      },
      at_faces_);
}

void ContactFinder::ListEdgesAtEdges(const std::vector<Vector3d>& x, double reach) {
  at_edges_.clear();
  // Boxes around the edges, half the reach wider; each is listed in every grid box that it touches.
  std::vector<Eigen::Array3f> low(edges_.size()), high(edges_.size());
  double mean = 0;
  for (size_t e = 0; e < edges_.size(); ++e) {
    const Vector3d &a = x[edges_[e][0]], &b = x[edges_[e][1]];
    low[e] = a.cwiseMin(b).cast<float>().array() - static_cast<float>(0.501 * reach);
    high[e] = a.cwiseMax(b).cast<float>().array() + static_cast<float>(0.501 * reach);
    mean += (high[e] - low[e]).maxCoeff() / static_cast<double>(edges_.size());
  }
  const float per_mm = static_cast<float>(1 / mean);
  const auto box_of = [per_mm](const Eigen::Array3f& p) -> Eigen::Array3i {
    return (p * per_mm).floor().cast<int>();
  };
  std::vector<HashedBoxes::Entry> entries;
  entries.reserve(6 * edges_.size());
  for (size_t e = 0; e < edges_.size(); ++e) {
    const Eigen::Array3i first = box_of(low[e]), last = box_of(high[e]);
    for (int i = first.x(); i <= last.x(); ++i)
      for (int j = first.y(); j <= last.y(); ++j)
        for (int k = first.z(); k <= last.z(); ++k) entries.push_back({BoxKey(i, j, k), static_cast<int>(e)});
  }
  const HashedBoxes boxes(entries);
  const auto test = [&](int i, int j, uint64_t key, std::vector<Candidate>& found) {
    if ((low[i] > high[j]).any() || (low[j] > high[i]).any()) return;
    const auto [a, b] = edges_[i];
    const auto [c, d] = edges_[j];
    if (a == c || a == d || b == c || b == d) return;
    // The pair is found in several boxes and taken in the first that both touch.
    const Eigen::Array3i first = box_of(low[i].max(low[j]));
    if (BoxKey(first.x(), first.y(), first.z()) != key) return;
    const float distance = NearestOfEdges(x[a], x[b], x[c], x[d]).distance_mm;
    if (distance < reach) found.push_back({i, j, distance});
  };
  Collect(
      boxes.buckets(),
      [&](size_t bucket, std::vector<Candidate>& found) {
        for (const auto* p = boxes.begin(bucket); p != boxes.end(bucket); ++p)
          for (const auto* q = p + 1; q != boxes.end(bucket); ++q)
            if (p->key == q->key) test(p->element, q->element, p->key, found);
      },
      at_edges_);
}

void ContactFinder::Measure(const std::vector<Vector3d>& x) {
  pairs_.clear();
  const float reach = static_cast<float>(reach_mm_);
  // Elements come nearer by no more than what their vertices have moved, so most need no closer look.
  const float unreached = reach + 1e-3F;
  const auto longest = [&](int a, int b) { return std::max(moved_mm_[a], moved_mm_[b]); };
  Collect(
      at_faces_.size(),
      [&](size_t k, std::vector<ContactPair>& found) {
        const int v = at_faces_[k].a;
        const Face& t = faces_[at_faces_[k].b];
        const float moved = moved_mm_[v] + std::max(longest(t[0], t[1]), moved_mm_[t[2]]);
        if (at_faces_[k].distance_mm - moved > unreached) return;
        const NearestPoints near = NearestOnTriangle(x[v], x[t[0]], x[t[1]], x[t[2]]);
        if (!(near.distance_mm < reach)) return;
        found.push_back({{v, t[0], t[1], t[2]},
                         near.weight,
                         near.normal,
                         near.distance_mm,
                         false,
                         Joined(v, t[0]) || Joined(v, t[1]) || Joined(v, t[2])});
      },
      pairs_);
  Collect(
      at_edges_.size(),
      [&](size_t k, std::vector<ContactPair>& found) {
        const auto [a, b] = edges_[at_edges_[k].a];
        const auto [c, d] = edges_[at_edges_[k].b];
        if (at_edges_[k].distance_mm - longest(a, b) - longest(c, d) > unreached) return;
        const NearestPoints near = NearestOfEdges(x[a], x[b], x[c], x[d]);
        if (!(near.distance_mm < reach)) return;
        found.push_back({{a, b, c, d},
                         near.weight,
                         near.normal,
                         near.distance_mm,
                         true,
                         Joined(a, c) || Joined(a, d) || Joined(b, c) || Joined(b, d)});
      },
      pairs_);
}

const std::vector<ContactPair>& ContactFinder::Find(const std::vector<Vector3d>& x,
                                                    const Eigen::Isometry3d& carry) {
  // Two elements that were farther apart than reach and margin are still out of reach while every vertex is
  // within half the margin of where it was carried.
  bool stale = listed_at_mm_.empty();
  const double limit2 = margin_mm_ * margin_mm_ / 4;
  for (size_t v = 0; v < listed_at_mm_.size(); ++v) {
    listed_at_mm_[v] = carry * listed_at_mm_[v];
    const double moved2 = (x[v] - listed_at_mm_[v]).squaredNorm();
    stale |= !(moved2 < limit2);
    moved_mm_[v] = static_cast<float>(std::sqrt(moved2));
  }
  if (stale) {
    ListVerticesAtFaces(x, reach_mm_ + margin_mm_);
    ListEdgesAtEdges(x, reach_mm_ + margin_mm_);
    listed_at_mm_ = x;
    moved_mm_.assign(x.size(), 0);
  }
  Measure(x);
  return pairs_;
}

KeptApart KeepApart(const std::vector<ContactPair>& pairs, const std::vector<Vector3d>& from,
                    const Eigen::Isometry3d& carry, const KeepApartOptions& options,
                    std::vector<Vector3d>& to) {
  constexpr int kHalvings = 6;  // then a vertex moves with its neighbours only, or not at all
  const size_t n = from.size();
  const double longest = 0.49 * options.reach_mm;
  LimitedMotion motion = Limited(from, carry, longest, to);
  const std::vector<Vector3d>& carried = motion.carried;
  std::vector<Vector3d>& move = motion.move;
  std::vector<uint8_t> halvings = motion.is_limited;  // what was limited counts as held back
  std::vector<uint8_t> crossed(n), crosses(pairs.size());
  const auto is_held = [&](int v) { return halvings[v] > kHalvings; };
  const std::vector<Vector3d> wanted = options.planes_turn ? move : std::vector<Vector3d>();
  ImpactZones zones(n);
  // Pairs that cross although one of their vertices has moved by ever less; whether there are any.
  const auto unite_held = [&] {
    bool any = false;
    for (size_t k = 0; k < pairs.size(); ++k) {
      const std::array<int, 4>& of = pairs[k].v;
      if (!crosses[k] || std::none_of(of.begin(), of.end(), is_held)) continue;
      any = true;
      zones.Unite(of);
      for (const int v : of) halvings[v] = kHalvings + 1;
    }
    if (!any) return false;
    zones.MoveAsOne(carried, wanted, longest, move);
    for (size_t v = 0; v < n; ++v)
      if (zones.Contains(static_cast<int>(v))) to[v] = carried[v] + move[v];
    return true;
  };
  for (bool any = true; any;) {
    std::fill(crossed.begin(), crossed.end(), 0);
    // Flags are only ever set, so the order of the pairs does not matter.
    ForEachIndex(pairs.size(), [&](size_t k) {
      crosses[k] = !zones.Unites(pairs[k].v) && !StaysApart(pairs[k], motion, to, carry, options);
      if (!crosses[k]) return;
      for (const int v : pairs[k].v) __atomic_store_n(&crossed[v], 1, __ATOMIC_RELAXED);
    });
    any = false;
    for (size_t v = 0; v < n; ++v) {
      if (!crossed[v] || move[v].isZero(0) || zones.Contains(static_cast<int>(v))) continue;
      any = true;
      if (++halvings[v] > kHalvings && options.planes_turn) continue;
      move[v] = is_held(static_cast<int>(v)) ? Vector3d::Zero() : Vector3d(0.5 * move[v]);
      to[v] = carried[v] + move[v];
    }
    if (options.planes_turn) any |= unite_held();
  }
  KeptApart out;
  for (size_t v = 0; v < n; ++v) {
    if (halvings[v] > 0) ++out.held_back;
    if (halvings[v] > kHalvings) out.stuck.push_back(static_cast<int>(v));
  }
  return out;
}

}  // namespace weft

#include "alignment/template_build/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

constexpr double kMostSlant = -0.5;    // cosine between both sides, which run against each other
constexpr double kMinApartCells = 10;  // on the board, between sides of one outline

// Share of the gap by which a side may lie behind the other's border; of near seams, which must lie before
// it.
constexpr double kMostBeside = 0.5;
constexpr double kNearFacing = -0.3;
constexpr double kSameCourse = 0.5;  // least cosine between moves along both sides

struct Pair {
  int a, b;  // border points
};
using Run = std::vector<Pair>;  // a along its loop, b against it

// Finds partners and joins them to runs.
class SeamFinder {
 public:
  SeamFinder(const PanelBorders& borders, double cell_mm, const SeamOptions& options,
             double most_beside = kMostBeside)
      : borders_(borders),
        options_(options),
        most_beside_(most_beside),
        cell_mm_(cell_mm),
        max_gap_mm_(options.max_gap_mm > 0 ? options.max_gap_mm : 4 * cell_mm),
        min_apart_mm_(kMinApartCells * cell_mm),
        claimed_(borders.size(), false) {}

  void Claim(int point) { claimed_[point] = true; }
  void SetMaxGap(double gap_mm) { max_gap_mm_ = gap_mm; }
  double max_gap_mm() const { return max_gap_mm_; }

  // The runs that are long enough, edges claimed.
  std::vector<Run> Settle() {
    std::vector<Run> settled;
    std::vector<Run> runs = MatchedRuns();
    std::stable_sort(runs.begin(), runs.end(),
                     [](const Run& x, const Run& y) { return x.size() > y.size(); });
    for (const Run& run : runs) {
      for (Run& part : OpenParts(run)) {
        ClaimEdges(part);
        settled.push_back(std::move(part));
      }
    }
    return settled;
  }

  // Goes on beyond both ends as long as the sides stay together.
  void Prolong(Run* run) {
    ProlongEnd(run, /*ahead=*/true);
    std::reverse(run->begin(), run->end());
    ProlongEnd(run, /*ahead=*/false);
    std::reverse(run->begin(), run->end());
  }

  // Seams of any length that close a band to a ring, like a collar: they begin where two others end on one
  // outline. `runs` are those that are settled and prolonged.
  std::vector<Run> SettleAtEnds(const std::vector<Run>& runs) {
    std::vector<Run> found;
    for (int a = 0; a < borders_.size(); ++a) {
      if (!claimed_[point(a).previous] || claimed_[a]) continue;
      const int b = OtherEnd(a, runs);
      if (b < 0) continue;
      Run run = {{a, b}, {point(a).next, point(b).previous}};
      ClaimEdges(run);
      ProlongEnd(&run, /*ahead=*/true);
      found.push_back(std::move(run));
    }
    return found;
  }

  // Whether claimed edges follow soon on both sides at both ends.
  bool BetweenSeams(const Run& run) const {
    const auto met = [&](int i, bool along) {
      constexpr int kReach = 10;  // points
      for (int k = 0; k < kReach; ++k, i = along ? point(i).next : point(i).previous) {
        if (claimed_[along ? i : point(i).previous]) return true;
      }
      return false;
    };
    return met(run.front().a, false) && met(run.front().b, true) && met(run.back().a, true) &&
           met(run.back().b, false);
  }

  Seam Describe(const Run& run) const;

 private:
  const BorderPoint& point(int i) const { return borders_.points()[i]; }

  bool CanFace(int a, int b) const {
    if (point(a).along.dot(point(b).along) > kMostSlant) return false;
    const Eigen::Vector3d across = borders_.at(b) - borders_.at(a);
    const double slack_mm = most_beside_ * across.norm() + 0.5 * cell_mm_;
    return across.dot(point(a).outward) >= -slack_mm && -across.dot(point(b).outward) >= -slack_mm;
  }

  std::vector<int> Partners() const {
    std::vector<int> partner(borders_.size(), -1);
    std::vector<double> least(borders_.size(), std::numeric_limits<double>::infinity());
    // An end of two claimed edges is sewn on both sides; nothing else can join it.
    const auto closed = [&](int i) { return claimed_[i] && claimed_[point(i).previous]; };
    for (int a = 0; a < borders_.size(); ++a) {
      if (closed(a)) continue;
      for (int b = a + 1; b < borders_.size(); ++b) {
        if (closed(b)) continue;
        if (point(a).loop == point(b).loop && borders_.FlatMm(a, b) < min_apart_mm_) continue;
        // The reference's distance first: it is quick, and twice the gap is never a mean within it.
        if ((borders_.at(a) - borders_.at(b)).squaredNorm() > 4 * max_gap_mm_ * max_gap_mm_) continue;
        const double gap_mm = borders_.SpaceMm(a, b);
        if (gap_mm > max_gap_mm_ || (gap_mm >= least[a] && gap_mm >= least[b]) || !CanFace(a, b)) continue;
        if (gap_mm < least[a]) least[a] = gap_mm, partner[a] = b;
        if (gap_mm < least[b]) least[b] = gap_mm, partner[b] = a;
      }
    }
    return partner;
  }

  // Whether both choose each other, give or take what different densities of points bring.
  bool Mutual(const std::vector<int>& partner, int a) const {
    const int back = partner[a] < 0 ? -1 : partner[partner[a]];
    if (back < 0 || point(back).loop != point(a).loop) return false;
    return std::min(borders_.StepsAhead(a, back), borders_.StepsAhead(back, a)) <= 4;
  }

  // The pair (a, b) goes on from `last`.
  std::optional<Pair> Continue(const Pair& last, int a, int b) const {
    if (point(b).loop != point(last.b).loop) return std::nullopt;
    const int steps = borders_.StepsAhead(last.a, a);
    const int back = borders_.StepsAhead(b, last.b), ahead = borders_.StepsAhead(last.b, b);
    constexpr int kMostSkipped = 15, kJitter = 2;
    if (steps > kMostSkipped) return std::nullopt;
    if (ahead <= kJitter && ahead > 0) return Pair{a, last.b};
    if (std::abs(back - steps) > kJitter + 1 + options_.max_easing * steps) return std::nullopt;
    return Pair{a, b};
  }

  std::vector<Run> MatchedRuns() const {
    const std::vector<int> partner = Partners();
    std::vector<Run> runs;
    for (int first = 0; first < borders_.size();) {
      int end = first;
      while (end < borders_.size() && point(end).loop == point(first).loop) ++end;
      const size_t before = runs.size();
      for (int a = first; a < end; ++a) {
        if (!Mutual(partner, a)) continue;
        std::optional<Pair> next;
        if (runs.size() > before) next = Continue(runs.back().back(), a, partner[a]);
        if (next) {
          runs.back().push_back(*next);
        } else {
          runs.push_back({{a, partner[a]}});
        }
      }
      JoinAcrossStart(before, &runs);
      first = end;
    }
    return runs;
  }

  // The first run of a loop may be the rest of its last one.
  void JoinAcrossStart(size_t before, std::vector<Run>* runs) const {
    if (runs->size() < before + 2) return;
    Run& last = runs->back();
    Run& first = (*runs)[before];
    if (!Continue(last.back(), first.front().a, first.front().b)) return;
    for (const Pair& pair : first) {
      const std::optional<Pair> next = Continue(last.back(), pair.a, pair.b);
      if (next) last.push_back(*next);
    }
    first.clear();
  }

  // Edges of both sides from one pair to the next; an edge bears the name of its first point.
  std::vector<int> EdgesBetween(const Pair& from, const Pair& to) const {
    std::vector<int> edges;
    for (int a = from.a; a != to.a; a = point(a).next) edges.push_back(a);
    for (int b = from.b; b != to.b; b = point(b).previous) edges.push_back(point(b).previous);
    return edges;
  }

  // Parts of the run along which no edge is claimed or met twice.
  std::vector<Run> OpenParts(const Run& run) const {
    std::vector<Run> parts;
    std::vector<bool> taken = claimed_;
    Run part;
    const auto finish = [&] {
      if (static_cast<int>(part.size()) >= options_.min_points && part.front().b != part.back().b) {
        parts.push_back(part);
      }
      part.clear();
    };
    for (const Pair& pair : run) {
      if (!part.empty()) {
        bool met = false;
        for (const int edge : EdgesBetween(part.back(), pair)) {
          met = met || taken[edge];
          taken[edge] = true;
        }
        if (met) finish();
      }
      part.push_back(pair);
    }
    finish();
    return parts;
  }

  void ClaimEdges(const Run& run) {
    for (size_t k = 1; k < run.size(); ++k) {
      for (const int edge : EdgesBetween(run[k - 1], run[k])) claimed_[edge] = true;
    }
  }

  // The nearest point from which an open border leads back beside the one that goes on from a; -1 without.
  int OtherEnd(int a, const std::vector<Run>& runs) const {
    const auto ends_a_run = [&](int b) {
      return std::any_of(runs.begin(), runs.end(), [&](const Run& run) {
        return (run.back().a == a && run.back().b == b) || (run.front().b == a && run.front().a == b);
      });
    };
    const int next = point(a).next;
    const Eigen::Vector3d move = (borders_.at(next) - borders_.at(a)).normalized();
    int best = -1;
    double least_mm = max_gap_mm_;
    for (int b = 0; b < borders_.size(); ++b) {
      const int before = point(b).previous;
      if (!claimed_[b] || claimed_[before] || before == next || b == next) continue;
      if (point(a).loop != point(b).loop || borders_.FlatMm(a, b) < min_apart_mm_) continue;
      const double gap_mm = (borders_.at(a) - borders_.at(b)).norm();
      if (gap_mm > least_mm || (borders_.at(next) - borders_.at(before)).norm() > max_gap_mm_) continue;
      if (move.dot((borders_.at(before) - borders_.at(b)).normalized()) < kSameCourse || ends_a_run(b))
        continue;
      best = b;
      least_mm = gap_mm;
    }
    return best;
  }

  // Moves on from the run's last pair; `ahead`: a along its loop, otherwise against it.
  void ProlongEnd(Run* run, bool ahead) {
    std::vector<double> gaps_mm;
    for (const Pair& pair : *run) gaps_mm.push_back((borders_.at(pair.a) - borders_.at(pair.b)).norm());
    const double limit_mm = std::min(max_gap_mm_, 1.5 * Median(std::move(gaps_mm)) + cell_mm_);
    constexpr size_t kLookBack = 5;
    const auto step = [&](int i, bool along) { return along ? point(i).next : point(i).previous; };
    const auto edge = [&](int i, bool along) { return along ? i : point(i).previous; };
    while (true) {
      const Pair last = run->back(), earlier = (*run)[run->size() > kLookBack ? run->size() - kLookBack : 0];
      const Eigen::Vector3d course =
          (borders_.at(last.a) - borders_.at(earlier.a) + borders_.at(last.b) - borders_.at(earlier.b))
              .normalized();
      const int next_a = step(last.a, ahead), next_b = step(last.b, !ahead);
      const auto free = [&](int i, int next, bool along) {
        const Eigen::Vector3d move = (borders_.at(next) - borders_.at(i)).normalized();
        return !claimed_[edge(i, along)] && move.dot(course) > kSameCourse;
      };
      const bool free_a = free(last.a, next_a, ahead), free_b = free(last.b, next_b, !ahead);
      const bool meet = next_a == last.b;  // both sides end at the tip of a dart
      if (meet) return;
      Pair best{-1, -1};
      double least_mm = limit_mm;
      const auto consider = [&](bool allowed, int a, int b, double favour) {
        const double gap_mm = favour * (borders_.at(a) - borders_.at(b)).norm();
        if (allowed && gap_mm <= least_mm && a != b) best = {a, b}, least_mm = gap_mm;
      };
      consider(free_a && free_b && next_a != next_b, next_a, next_b, 0.8);
      consider(free_a, next_a, last.b, 1);
      consider(free_b, last.a, next_b, 1);
      if (best.a < 0) return;
      if (best.a != last.a) claimed_[edge(last.a, ahead)] = true;
      if (best.b != last.b) claimed_[edge(last.b, !ahead)] = true;
      run->push_back(best);
    }
  }

  const PanelBorders& borders_;
  const SeamOptions& options_;
  const double most_beside_;
  const double cell_mm_;
  double max_gap_mm_, min_apart_mm_;
  std::vector<bool> claimed_;  // [points], the edge from there to the next point
};

Seam SeamFinder::Describe(const Run& run) const {
  Seam seam;
  seam.panel_a = borders_.panel(run.front().a), seam.panel_b = borders_.panel(run.front().b);
  std::vector<double> gaps_mm;
  for (const Pair& pair : run) gaps_mm.push_back(borders_.SpaceMm(pair.a, pair.b));
  double length_mm = 0;
  seam.side_a.push_back(point(run.front().a).vertex);
  for (int a = run.front().a; a != run.back().a; a = point(a).next) {
    length_mm += borders_.FlatMm(a, point(a).next);
    seam.side_a.push_back(point(point(a).next).vertex);
  }
  seam.side_b.push_back(point(run.front().b).vertex);
  for (int b = run.front().b; b != run.back().b; b = point(b).previous) {
    length_mm += borders_.FlatMm(b, point(b).previous);
    seam.side_b.push_back(point(point(b).previous).vertex);
  }
  seam.length_mm = length_mm / 2;
  seam.max_gap_mm = *std::max_element(gaps_mm.begin(), gaps_mm.end());
  seam.gap_mm = Median(std::move(gaps_mm));
  return seam;
}

std::vector<Seam> Described(const SeamFinder& finder, const std::vector<Run>& runs) {
  std::vector<Seam> seams;
  for (const Run& run : runs) seams.push_back(finder.Describe(run));
  std::sort(seams.begin(), seams.end(),
            [](const Seam& x, const Seam& y) { return x.side_a.front() < y.side_a.front(); });
  return seams;
}

}  // namespace

absl::Status SeamOptions::Validate() const {
  if (!(max_gap_mm >= 0)) return absl::InvalidArgumentError("max_gap_mm must be 0 or more");
  if (min_points < 3) return absl::InvalidArgumentError("min_points must be 3 or more");
  if (!(max_easing >= 0)) return absl::InvalidArgumentError("max_easing must be 0 or more");
  return absl::OkStatus();
}

std::vector<Seam> FindSeams(const PanelBorders& borders, double cell_mm, const SeamOptions& options) {
  SeamFinder finder(borders, cell_mm, options);
  std::vector<Run> runs = finder.Settle();
  for (Run& run : runs) finder.Prolong(&run);
  for (Run& run : finder.SettleAtEnds(runs)) runs.push_back(std::move(run));
  return Described(finder, runs);
}

std::vector<Seam> FindNearSeams(const PanelBorders& borders, const std::vector<Seam>& seams, double cell_mm,
                                double factor, const SeamOptions& options) {
  SeamFinder finder(borders, cell_mm, options, kNearFacing);
  finder.SetMaxGap(factor * finder.max_gap_mm());
  std::vector<int> point_of_vertex;
  for (int i = 0; i < borders.size(); ++i) {
    const size_t vertex = borders.points()[i].vertex;
    if (point_of_vertex.size() <= vertex) point_of_vertex.resize(vertex + 1, -1);
    point_of_vertex[vertex] = i;
  }
  for (const Seam& seam : seams) {
    for (size_t k = 0; k + 1 < seam.side_a.size(); ++k) finder.Claim(point_of_vertex[seam.side_a[k]]);
    for (size_t k = 1; k < seam.side_b.size(); ++k) finder.Claim(point_of_vertex[seam.side_b[k]]);
  }
  SeamFinder before = finder;
  std::vector<Run> runs = finder.Settle();
  std::vector<Run> wide, others;
  for (Run& run : runs) (before.BetweenSeams(run) ? wide : others).push_back(std::move(run));
  for (Run& run : wide) finder.Prolong(&run);
  std::vector<Seam> found = Described(finder, others);
  for (Seam& seam : Described(finder, wide)) {
    seam.wide = true;
    found.push_back(std::move(seam));
  }
  return found;
}

}  // namespace weft

#include "triangulation/exchange_search.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "triangulation/consensus.h"
#include "triangulation/node_index.h"
#include "triangulation/sight.h"

namespace weft {
namespace {

constexpr size_t kMostCameras = 40;
constexpr size_t kNodes = 150;

// Shares of the rays that meet. Of the right rig 0.9 and more do, of another one below 0.1. One camera that
// is right more adds a fifth of the rays of five.
constexpr double kHelps = 0.1;
constexpr double kFound = 0.6;
constexpr double kLeastExchangeGain = 0.3;

// An exchange that is nearly as good is as likely.
constexpr double kAsGood = 0.9;

class Search {
 public:
  Search(const Rig& rig, const std::vector<ViewObservations>& views, const TriangulationOptions& options,
         CameraPart part)
      : rig_(rig), options_(options), part_(part), sights_(rig.cameras.size()), places_(rig.cameras.size()) {
    std::iota(places_.begin(), places_.end(), 0);
    Choose(views);
  }

  ExchangeSearch Run() {
    ExchangeSearch out;
    const double before = Share(places_);
    double share = before;
    bool is_clear = true;
    for (size_t step = 0; step + 1 < places_.size() && share < kAlmostAll; ++step) {
      const Step best = BestExchange();
      if (best.share < share + kHelps) break;
      std::swap(places_[best.first], places_[best.second]);
      share = best.share;
      is_clear = best.second_share < kAsGood * best.share;
    }
    out.found = is_clear && share >= kFound && share >= before + kLeastExchangeGain;
    if (!out.found) std::iota(places_.begin(), places_.end(), 0);
    out.part = part_;
    out.of_camera = Count();
    return out;
  }

 private:
  static constexpr double kAlmostAll = 0.9;

  struct Ray {
    int camera = 0;
    Observation seen;
  };
  struct Step {
    size_t first = 0, second = 0;
    double share = 0, second_share = 0;
  };

  // Nodes that three or more cameras see, spread evenly, with the first ray of each.
  void Choose(const std::vector<ViewObservations>& views) {
    const NodeIndex index = GroupByNode(views);
    std::vector<std::vector<Ray>> all;
    for (const SeenNode& node : index.nodes) {
      std::vector<Ray> rays;
      for (size_t e = node.first; e < node.last; ++e) {
        const int camera = views[index.entries[e].view].camera;
        if (rays.empty() || rays.back().camera != camera)
          rays.push_back({camera, views[index.entries[e].view].observations[index.entries[e].observation]});
      }
      if (rays.size() >= 3) all.push_back(std::move(rays));
    }
    const size_t step = std::max<size_t>(1, all.size() / kNodes);
    for (size_t i = 0; i < all.size(); i += step) nodes_.push_back(std::move(all[i]));
    for (size_t n = 0; n < nodes_.size(); ++n)
      for (const Ray& ray : nodes_[n]) seen_[ray.camera].push_back(ray.seen);
  }

  // All chosen observations of a camera, in the order of the nodes, as a model with a part of another sees
  // them.
  struct ReadWith {
    CameraModel model;
    std::vector<UndistortedPoint> points;
  };
  const ReadWith& Read(int camera, int place) {
    const auto [entry, added] = read_.try_emplace({camera, place});
    ReadWith& read = entry->second;
    if (added) {
      read.model = WithPart(rig_.cameras[camera], rig_.cameras[place], part_);
      read.points = UndistortAll(read.model, seen_[camera]);
    }
    return read;
  }

  // `of_ray(node, rays, inliers)` for each node.
  template <typename OfNode>
  void ForEach(const std::vector<int>& places, const OfNode& of_node) {
    std::vector<size_t> next(rig_.cameras.size(), 0);
    for (const std::vector<Ray>& rays : nodes_) {
      sights_.clear();
      for (const Ray& ray : rays) {
        const ReadWith& read = Read(ray.camera, places[ray.camera]);
        const UndistortedPoint& point = read.points[next[ray.camera]++];
        if (point.valid) sights_.push_back(MakeSight(read.model, ray.camera, point, ray.seen.sigma_px));
      }
      of_node(rays, FindConsensus(sights_, options_.consensus, options_.consensus.seed).inliers);
    }
  }

  double Share(const std::vector<int>& places) {
    size_t met = 0, all = 0;
    ForEach(places, [&](const std::vector<Ray>& rays, const std::vector<int>& inliers) {
      met += inliers.size(), all += rays.size();
    });
    return all > 0 ? static_cast<double>(met) / static_cast<double>(all) : 0;
  }

  Step BestExchange() {
    Step best;
    for (size_t i = 0; i < places_.size(); ++i) {
      for (size_t j = i + 1; j < places_.size(); ++j) {
        if (seen_[static_cast<int>(i)].empty() || seen_[static_cast<int>(j)].empty()) continue;
        std::vector<int> exchanged = places_;
        std::swap(exchanged[i], exchanged[j]);
        const double share = Share(exchanged);
        if (share > best.share) {
          best = {i, j, share, best.share};
        } else {
          best.second_share = std::max(best.second_share, share);
        }
      }
    }
    return best;
  }

  std::vector<SearchedCamera> Count() {
    std::vector<SearchedCamera> out(places_.size());
    for (size_t c = 0; c < out.size(); ++c) out[c].place = places_[c];
    ForEach(places_, [&](const std::vector<Ray>& rays, const std::vector<int>& inliers) {
      for (const Ray& ray : rays) ++out[ray.camera].nodes;
      for (const int i : inliers) ++out[sights_[i].camera].meeting;
    });
    for (size_t c = 0; c < out.size(); ++c)
      if (out[c].place != static_cast<int>(c)) out[c].meeting = 0;
    return out;
  }

  const Rig& rig_;
  const TriangulationOptions& options_;
  CameraPart part_;
  std::vector<std::vector<Ray>> nodes_;
  std::map<int, std::vector<Observation>> seen_;  // by camera, in the order of the nodes
  std::map<std::pair<int, int>, ReadWith> read_;  // by camera and place
  std::vector<Sight> sights_;
  std::vector<int> places_;  // of each camera, whose model it has
};

}  // namespace

ExchangeSearch SearchExchanges(const Rig& rig, const std::vector<ViewObservations>& views,
                               const TriangulationOptions& options) {
  if (rig.cameras.size() > kMostCameras) return {};
  ExchangeSearch found = Search(rig, views, options, CameraPart::kPlaceAndLens).Run();
  if (found.found) return found;
  const ExchangeSearch of_places = Search(rig, views, options, CameraPart::kPlace).Run();
  return of_places.found ? of_places : found;
}

}  // namespace weft

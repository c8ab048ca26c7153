#include "alignment/fold_lines.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "alignment/point_noise.h"

namespace weft {
namespace {

constexpr int kToEachSide = 2;     // vertices of a line
constexpr int kLeastOfLine = 3;    // of its five vertices that are measured
constexpr double kStraight = 0.8;  // least cosine between edges of a line
// Significance of the best line's mean, in units of what noise gives one line in the mean. By noise alone 5 %
// of the vertices of flat cloth have more; tests/alignment/fold_lines_test.cpp counts them.
constexpr double kNoiseOfBestLine = 2.4;

class FoldLines {
 public:
  FoldLines(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
            const AlignOptions& options, const std::vector<Eigen::Vector3d>& position_mm)
      : graph_(model.graph()), rest_mm_(model.rest().vertices_mm), of_vertex_(graph_.vertices) {
    for (const VertexTarget& t : targets) {
      if (!HasKnownNoise(t)) continue;
      Offset& offset = of_vertex_[t.vertex];
      offset.known = true;
      offset.information = NoiseInformation(t, options.detection);
      offset.weighted = offset.information * (position_mm[t.vertex] - t.position_mm);
      offset.of_noise = OffsetVarianceShare(t, options);
    }
  }

  // By how much the vertex was held off its point as others on a line with it were, mm.
  Eigen::Vector3d HeldOff(int vertex) const {
    double most = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int i = graph_.first[vertex]; i < graph_.first[vertex + 1]; ++i) {
      const int there = graph_.neighbor[i];
      const int back = Straight(vertex, rest_mm_[vertex] - rest_mm_[there]);
      if (back > there) continue;  // the same line, from its other side
      Line line;
      line.Add(of_vertex_[vertex]);
      AddSide(vertex, there, &line);
      if (back >= 0) AddSide(vertex, back, &line);
      if (line.measured < kLeastOfLine) continue;
      const Eigen::Vector3d of_line = line.information.inverse() * line.weighted;
      const double significance = of_line.dot(line.weighted);
      if (significance > most) most = significance, mean = of_line;
    }
    const double by_noise = 3 * kNoiseOfBestLine * of_vertex_[vertex].of_noise;
    return most > by_noise ? Eigen::Vector3d((1 - by_noise / most) * mean) : Eigen::Vector3d::Zero();
  }

 private:
  // Of a vertex from its point.
  struct Offset {
    bool known = false;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // of the noise, 1 / mm^2
    Eigen::Vector3d weighted = Eigen::Vector3d::Zero();     // information times offset, 1 / mm
    double of_noise = 0;
  };
  struct Line {
    int measured = 0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
    void Add(const Offset& offset) {
      measured += offset.known ? 1 : 0;
      information += offset.information;
      weighted += offset.weighted;
    }
  };

  // The neighbour that lies in this direction; -1 where none does.
  int Straight(int vertex, const Eigen::Vector3d& direction) const {
    int best = -1;
    double most = kStraight * kStraight * direction.squaredNorm();
    for (int i = graph_.first[vertex]; i < graph_.first[vertex + 1]; ++i) {
      const Eigen::Vector3d edge = rest_mm_[graph_.neighbor[i]] - rest_mm_[vertex];
      const double along = edge.dot(direction), square = edge.squaredNorm();
      if (along <= 0 || along * along <= most * square) continue;
      most = along * along / square, best = graph_.neighbor[i];
    }
    return best;
  }

  void AddSide(int vertex, int next, Line* line) const {
    line->Add(of_vertex_[next]);
    for (int k = 1; k < kToEachSide; ++k) {
      const int after = Straight(next, rest_mm_[next] - rest_mm_[vertex]);
      if (after < 0) return;
      vertex = std::exchange(next, after);
      line->Add(of_vertex_[next]);
    }
  }

  const MeshGraph& graph_;
  const std::vector<Eigen::Vector3d>& rest_mm_;
  std::vector<Offset> of_vertex_;
};

}  // namespace

void RestoreFolds(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                  const AlignOptions& options, std::vector<Eigen::Vector3d>* position_mm) {
  if (options.noise_sigmas == 0) return;
  const FoldLines lines(model, targets, options, *position_mm);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, targets.size(), 256), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      if (HasKnownNoise(targets[i])) (*position_mm)[targets[i].vertex] -= lines.HeldOff(targets[i].vertex);
    }
  });
}

}  // namespace weft

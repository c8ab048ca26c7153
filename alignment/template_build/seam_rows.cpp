#include "alignment/template_build/seam_rows.h"

#include <algorithm>
#include <map>

#include "alignment/template_build/zipper.h"
#include "base/median.h"

namespace weft {

void RestoreWidths(const std::vector<LiftedPanels>& clouds, LiftedPanels* reference,
                   std::vector<Seam>* seams) {
  for (size_t v = 0; v < reference->seen.size(); ++v) {
    if (reference->seen[v]) reference->position_mm[v] = clouds[0].position_mm[v];
  }
  for (Seam& seam : *seams) {
    std::map<int, double> least_mm;  // of each vertex of side_a: edges across run aslant, too
    for (const MeasuredGap& gap : MeasureGaps({seam}, reference->position_mm, clouds)) {
      const auto [at, first] = least_mm.emplace(gap.a, gap.length_mm);
      at->second = std::min(at->second, gap.length_mm);
    }
    if (least_mm.empty()) continue;
    std::vector<double> widths_mm;
    for (const auto& [vertex, width_mm] : least_mm) widths_mm.push_back(width_mm);
    seam.gap_mm = Median(widths_mm);
    seam.max_gap_mm = *std::max_element(widths_mm.begin(), widths_mm.end());
  }
}

std::vector<Face> ZipWithRows(const PanelBorders& borders, double cell_mm, std::vector<Seam>* seams,
                              LiftedPanels* reference) {
  std::vector<Face> faces;
  std::vector<Eigen::Vector3d>& position_mm = reference->position_mm;
  std::vector<Eigen::Vector3d> outward(position_mm.size(), Eigen::Vector3d::Zero());
  for (const BorderPoint& point : borders.points()) outward[point.vertex] = point.outward;
  const auto add_strip = [&](const std::vector<int>& side_a, const std::vector<int>& side_b) {
    Seam half;
    half.side_a = side_a, half.side_b = side_b;
    const std::vector<Face> strip = ZipSeam(half, position_mm);
    faces.insert(faces.end(), strip.begin(), strip.end());
  };
  for (Seam& seam : *seams) {
    for (const Eigen::Vector3d& place : SeamMiddle(seam, position_mm, outward, cell_mm)) {
      seam.middle.push_back(static_cast<int>(position_mm.size()));
      position_mm.push_back(place);
    }
    add_strip(seam.side_a, seam.middle);
    add_strip(seam.middle, seam.side_b);
  }
  reference->seen.resize(position_mm.size(), false);
  return faces;
}

std::vector<MeasuredGap> MeasureGaps(const std::vector<Seam>& seams,
                                     const std::vector<Eigen::Vector3d>& reference_mm,
                                     const std::vector<LiftedPanels>& clouds) {
  std::vector<MeasuredGap> measured;
  for (const Seam& seam : seams) {
    for (const auto& [a, b] : EdgesAcross(seam, reference_mm)) {
      double sum_mm = 0;
      int shown = 0;
      for (const LiftedPanels& cloud : clouds) {
        if (!cloud.seen[a] || !cloud.seen[b]) continue;
        sum_mm += (cloud.position_mm[b] - cloud.position_mm[a]).norm();
        ++shown;
      }
      if (shown > 0) measured.push_back({a, b, sum_mm / shown});
    }
  }
  return measured;
}

absl::StatusOr<std::vector<Face>> FillWhereSeamsMeet(const std::vector<int>& loop,
                                                     const std::vector<Face>& faces, double cell_mm,
                                                     LiftedPanels* reference, std::vector<int>* beside) {
  constexpr size_t kLeastVertices = 6;
  constexpr double kReachCells = 3;
  std::vector<Eigen::Vector3d>& position_mm = reference->position_mm;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int v : loop) middle += position_mm[v] / static_cast<double>(loop.size());
  const bool compact = std::all_of(loop.begin(), loop.end(), [&](int v) {
    return (position_mm[v] - middle).norm() < kReachCells * cell_mm;
  });
  if (!compact || loop.size() < kLeastVertices) return FillHole(loop, position_mm, faces);
  std::vector<Face> fan;
  const int center = static_cast<int>(position_mm.size());
  for (size_t k = 0; k < loop.size(); ++k) fan.push_back({loop[(k + 1) % loop.size()], loop[k], center});
  position_mm.push_back(middle);
  reference->seen.push_back(false);
  beside->push_back(loop[0]);
  return fan;
}

void AddSeamTexture(const std::vector<int>& beside, GarmentParts* parts) {
  std::vector<Eigen::Vector2d>& texture_mm = parts->texture_mm;
  for (const Seam& seam : parts->seams) {
    const size_t last = seam.side_a.size() - 1, rows = seam.middle.size() - 1;
    for (size_t k = 0; k <= rows; ++k) texture_mm.push_back(texture_mm[seam.side_a[last * k / rows]]);
  }
  for (const int v : beside) texture_mm.push_back(texture_mm[v]);
}

}  // namespace weft

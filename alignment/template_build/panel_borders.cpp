#include "alignment/template_build/panel_borders.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace weft {
namespace {

constexpr int kSmoothing = 3;  // points each way
constexpr int kShownWithin = 3;

std::vector<Eigen::Vector3d> Normals(const std::vector<Face>& faces,
                                     const std::vector<Eigen::Vector3d>& position_mm) {
  std::vector<Eigen::Vector3d> normal(position_mm.size(), Eigen::Vector3d::Zero());
  for (const auto& [a, b, c] : faces) {
    const Eigen::Vector3d area = (position_mm[b] - position_mm[a]).cross(position_mm[c] - position_mm[a]);
    normal[a] += area, normal[b] += area, normal[c] += area;
  }
  return normal;
}

}  // namespace

PanelBorders::PanelBorders(const PanelSheet& sheet, const std::vector<LiftedPanels>& lifts)
    : position_mm_(lifts.size()), shown_(lifts.size()) {
  for (size_t loop = 0; loop < sheet.loops.size(); ++loop) {
    const int first = size(), count = static_cast<int>(sheet.loops[loop].size());
    for (int i = 0; i < count; ++i) {
      const int vertex = sheet.loops[loop][i];
      points_.push_back(
          {vertex, static_cast<int>(loop), first + (i + 1) % count, first + (i + count - 1) % count});
      panel_.push_back(sheet.panel_of_vertex[vertex]);
      flat_mm_.push_back(sheet.flat.vertices_mm[vertex]);
    }
    loop_size_.push_back(count);
  }
  for (size_t l = 0; l < lifts.size(); ++l) {
    for (int i = 0; i < size(); ++i) {
      position_mm_[l].push_back(lifts[l].position_mm[points_[i].vertex]);
      bool shown = lifts[l].seen[points_[i].vertex];
      for (int k = 0, ahead = i, behind = i; k < kShownWithin; ++k) {
        ahead = points_[ahead].next, behind = points_[behind].previous;
        shown = shown || lifts[l].seen[points_[ahead].vertex] || lifts[l].seen[points_[behind].vertex];
      }
      shown_[l].push_back(shown && lifts[l].panel_placed[panel_[i]]);
    }
  }
  const std::vector<Eigen::Vector3d> normals = Normals(sheet.flat.faces, lifts[0].position_mm);
  for (int i = 0; i < size(); ++i) {
    int ahead = i, behind = i;
    Eigen::Vector3d normal = normals[points_[i].vertex];
    for (int k = 0; k < kSmoothing; ++k) {
      ahead = points_[ahead].next, behind = points_[behind].previous;
      normal += normals[points_[ahead].vertex] + normals[points_[behind].vertex];
    }
    points_[i].along = (at(ahead) - at(behind)).normalized();
    points_[i].outward = points_[i].along.cross(normal).normalized();
  }
}

double PanelBorders::SpaceMm(int a, int b) const {
  double shown_mm = 0, all_mm = 0;
  int shown = 0;
  for (size_t l = 0; l < position_mm_.size(); ++l) {
    const double distance_mm = (position_mm_[l][a] - position_mm_[l][b]).norm();
    all_mm += distance_mm;
    if (shown_[l][a] == 0 || shown_[l][b] == 0) continue;
    shown_mm += distance_mm;
    ++shown;
  }
  return shown > 0 ? shown_mm / shown : all_mm / static_cast<double>(position_mm_.size());
}

int PanelBorders::StepsAhead(int a, int b) const {
  const int count = loop_size_[points_[a].loop];
  return ((b - a) % count + count) % count;
}

}  // namespace weft

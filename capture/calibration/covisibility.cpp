#include "capture/calibration/covisibility.h"

#include <algorithm>
#include <map>
#include <utility>

namespace weft {

Covisibility CountSharedViews(const CalibrationViews& views) {
  const size_t count = views.cameras.size();
  Covisibility out;
  out.shared.assign(count, std::vector<int>(count, 0));
  std::map<std::pair<int, int>, std::vector<int>> seen_by;  // (frame, board) to cameras
  for (const BoardView& view : views.boards) seen_by[{view.frame, view.board}].push_back(view.camera);
  for (const auto& [moment, cameras] : seen_by) {
    for (const int a : cameras) {
      for (const int b : cameras) ++out.shared[a][b];
    }
  }
  std::vector<bool> reached(count, false);
  for (size_t first = 0; first < count; ++first) {
    if (reached[first]) continue;
    std::vector<int> group = {static_cast<int>(first)};
    reached[first] = true;
    for (size_t i = 0; i < group.size(); ++i) {
      for (size_t next = 0; next < count; ++next) {
        if (reached[next] || out.shared[group[i]][next] == 0) continue;
        reached[next] = true;
        group.push_back(static_cast<int>(next));
      }
    }
    std::sort(group.begin(), group.end());
    out.groups.push_back(group);
  }
  std::stable_sort(out.groups.begin(), out.groups.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return out;
}

std::vector<int> SharedViews(const CalibrationViews& views) {
  std::map<std::pair<int, int>, int> cameras_of;  // (frame, board)
  for (const BoardView& view : views.boards) ++cameras_of[{view.frame, view.board}];
  std::vector<int> out(views.cameras.size(), 0);
  for (const BoardView& view : views.boards) out[view.camera] += cameras_of[{view.frame, view.board}] > 1;
  return out;
}

}  // namespace weft

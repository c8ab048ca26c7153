#include "triangulation/ray_groups.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr int kMaxNodeIndex = 4096;  // of a row or column, Board::Validate

constexpr int kColumnBits = 9, kRowBits = 13;
static_assert(kMaxNodeIndex / kNodeLanes < 1 << kColumnBits && kMaxNodeIndex < 1 << kRowBits);
uint32_t GroupOf(const BoardNode& node) {
  return (static_cast<uint32_t>(node.kind) << kRowBits | static_cast<uint32_t>(node.row)) << kColumnBits |
         static_cast<uint32_t>(node.col) / kNodeLanes;
}
BoardNode FirstNodeOf(uint32_t group) {
  return {static_cast<int>(group >> kColumnBits & ((1u << kRowBits) - 1)),
          static_cast<int>(group & ((1u << kColumnBits) - 1)) * kNodeLanes,
          static_cast<NodeKind>(group >> (kColumnBits + kRowBits))};
}

std::string NodeName(const BoardNode& node) {
  return absl::StrCat(node.kind == NodeKind::kCenter ? "center" : "corner", " (", node.row, ", ", node.col,
                      ")");
}

bool IsValid(const Observation& o) {
  return o.node.kind <= NodeKind::kCorner && static_cast<uint32_t>(o.node.row) <= kMaxNodeIndex &&
         static_cast<uint32_t>(o.node.col) <= kMaxNodeIndex && std::isfinite(o.x_px) &&
         std::isfinite(o.y_px) && o.sigma_px > 0 && std::isfinite(o.sigma_px);
}

absl::Status ErrorOf(const CameraModel& camera, const Observation& o) {
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(
        absl::StrCat("observation of ", NodeName(o.node), " by camera ", camera.id, ": ", why));
  };
  if (o.node.kind != NodeKind::kCenter && o.node.kind != NodeKind::kCorner) return bad("kind is unknown");
  if (o.node.row < 0 || o.node.row > kMaxNodeIndex || o.node.col < 0 || o.node.col > kMaxNodeIndex) {
    return bad(absl::StrCat("row and column must lie in 0 to ", kMaxNodeIndex));
  }
  if (!std::isfinite(o.x_px) || !std::isfinite(o.y_px)) return bad("x_px or y_px is not finite");
  return bad("sigma_px must be a positive number");
}

// The largest squared distance from the axis up to which the lens model is one-to-one, looked for in small
// steps; a little on the safe side.
double SafeSquare(const std::array<double, 8>& d) {
  constexpr int kSteps = 512;
  constexpr double kEndRad = 1.55;  // off the axis
  double safe = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = std::tan(kEndRad * i / kSteps), r2 = r * r;
    const double numerator = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double denominator = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
    const double radial = numerator / denominator;
    const double slope =
        (d[0] + r2 * (2 * d[1] + r2 * 3 * d[4])) - radial * (d[5] + r2 * (2 * d[6] + r2 * 3 * d[7]));
    if (!(denominator > 0) || !(radial + 2 * r2 * slope / denominator > 0)) break;
    safe = r2;
  }
  return safe;
}

template <typename T>
RayCameraNumbers<T> NumbersOf(const CameraModel& camera) {
  RayCameraNumbers<T> out;
  for (int i = 0; i < 9; ++i) out.rotation[i] = static_cast<T>(camera.rotation(i / 3, i % 3));
  for (int i = 0; i < 8; ++i) out.distortion[i] = static_cast<T>(camera.distortion[i]);
  out.fx_px = static_cast<T>(camera.fx_px);
  out.fy_px = static_cast<T>(camera.fy_px);
  return out;
}

RayCamera MakeRayCamera(const CameraModel& camera, double calibration_sigma_px) {
  RayCamera out{};
  out.exact = NumbersOf<double>(camera);
  out.rough = NumbersOf<float>(camera);
  out.cx_px = camera.cx_px, out.cy_px = camera.cy_px;
  const Eigen::Vector3d origin = camera.CenterWorld();
  for (int i = 0; i < 3; ++i) {
    out.translation_mm[i] = camera.translation_mm[i];
    out.origin_mm[i] = origin[i];
  }
  out.calibration_px2 = static_cast<float>(calibration_sigma_px * calibration_sigma_px);
  out.rational = camera.distortion[5] != 0 || camera.distortion[6] != 0 || camera.distortion[7] != 0;
  out.safe_square = static_cast<float>(SafeSquare(camera.distortion));
  return out;
}

void Set(const Observation& o, uint32_t lane, RayRow* row) {
  row->pixel_px[0][lane] = o.x_px;
  row->pixel_px[1][lane] = o.y_px;
  row->sigma_px[lane] = o.sigma_px;
}

}  // namespace

absl::StatusOr<RayGroups> RayGroups::Build(const Rig& rig, const std::vector<ViewObservations>& views,
                                           const TriangulationOptions& options) {
  const std::vector<double>& left = options.refinement.camera_sigma_px;
  if (!left.empty() && left.size() != rig.cameras.size()) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.refinement.camera_sigma_px has ",
                                                   left.size(), " entries, the rig has ", rig.cameras.size(),
                                                   " cameras"));
  }
  RayGroups groups(views);
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    groups.cameras_.push_back(MakeRayCamera(
        rig.cameras[c], std::hypot(options.refinement.calibration_sigma_px, left.empty() ? 0 : left[c])));
  }
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(rig.cameras.size())) {
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     rig.cameras.size(), " cameras, numbered from 0"));
    }
  }
  std::vector<std::vector<Run>> runs(views.size());
  std::vector<const Observation*> wrong(views.size(), nullptr);
  tbb::parallel_for(size_t{0}, views.size(),
                    [&](size_t v) { wrong[v] = FindRuns(views[v], static_cast<uint32_t>(v), &runs[v]); });
  for (size_t v = 0; v < views.size(); ++v)
    if (wrong[v] != nullptr) return ErrorOf(rig.cameras[views[v].camera], *wrong[v]);
  groups.Sort(runs);
  return groups;
}

// Returns the first observation that is wrong, if there is one.
const Observation* RayGroups::FindRuns(const ViewObservations& view, uint32_t number,
                                       std::vector<Run>* runs) {
  constexpr size_t kUsualRun = 8;
  runs->reserve(view.observations.size() / kUsualRun);
  uint32_t last = ~0u;
  for (const Observation& o : view.observations) {
    if (!IsValid(o)) return &o;
    const uint32_t group = GroupOf(o.node);
    if (group != last) {
      const uint32_t first = static_cast<uint32_t>(&o - view.observations.data());
      runs->push_back({group, number, first, 0});
    }
    ++runs->back().count;
    last = group;
  }
  return nullptr;
}

// Counting sort: views in the order of their cameras, so the runs of a group come out ordered by camera.
void RayGroups::Sort(const std::vector<std::vector<Run>>& runs) {
  std::vector<uint32_t> by_camera(views_->size());
  std::iota(by_camera.begin(), by_camera.end(), 0);
  std::stable_sort(by_camera.begin(), by_camera.end(),
                   [&](uint32_t a, uint32_t b) { return (*views_)[a].camera < (*views_)[b].camera; });
  int rows = 0, cols = 0;
  for (const auto& of_view : runs) {
    for (const Run& run : of_view) {
      const BoardNode node = FirstNodeOf(run.group);
      rows = std::max(rows, node.row + 1);
      cols = std::max(cols, node.col / kNodeLanes + 1);
    }
  }
  const auto place = [&](const Run& run) {
    const BoardNode node = FirstNodeOf(run.group);
    return (static_cast<size_t>(node.kind) * rows + node.row) * cols + node.col / kNodeLanes;
  };
  std::vector<uint32_t> next(2 * static_cast<size_t>(rows) * cols, 0);
  for (const auto& of_view : runs)
    for (const Run& run : of_view) ++next[place(run)];
  start_.push_back(0);
  for (uint32_t& count : next) {
    const uint32_t end = start_.back() + count;
    count = start_.back();
    if (end > start_.back()) start_.push_back(end);
  }
  runs_.resize(start_.back());
  for (const uint32_t view : by_camera)
    for (const Run& run : runs[view]) runs_[next[place(run)]++] = run;
}

void RayGroups::Fill(size_t group, RayGroup* out) const {
  const uint32_t first = start_[group], last = start_[group + 1];
  out->first_node = FirstNodeOf(runs_[first].group);
  out->count = 0;
  for (uint32_t r = first; r < last; ++r) {
    // Many views are more streams than a processor foresees.
    constexpr uint32_t kAhead = 6;
    if (r + kAhead < runs_.size()) Prefetch(runs_[r + kAhead]);
    Add(runs_[r], out);
  }
  out->CountRays();
  BestRayKernels().undistort(cameras_.data(), out->count, out->rows.data());
}

void RayGroups::Prefetch(const Run& run) const {
  const Observation* observations = (*views_)[run.view].observations.data() + run.first;
  const char* first = reinterpret_cast<const char*>(observations);
  const char* last = reinterpret_cast<const char*>(observations + run.count);
  constexpr int kCacheLine = 64;
  for (; first < last; first += kCacheLine) __builtin_prefetch(first);
}

void RayGroups::Add(const Run& run, RayGroup* out) const {
  const ViewObservations& view = (*views_)[run.view];
  // The rows that the camera has already, by another run or view.
  int base = out->count;
  while (base > 0 && out->rows[base - 1].camera == view.camera) --base;
  if (base == out->count) out->AddRow(view.camera, false);
  RayRow* row = &out->rows[base];
  const Observation* const end = view.observations.data() + run.first + run.count;
  for (const Observation* o = end - run.count; o < end; ++o) {
    const uint32_t lane = static_cast<uint32_t>(o->node.col) % kNodeLanes;
    if (row->sigma_px[lane] > 0) {
      int again = base + 1;
      while (again < out->count && out->rows[again].sigma_px[lane] > 0) ++again;
      if (again == out->count) out->AddRow(view.camera, true);
      Set(*o, lane, &out->rows[again]);
      row = &out->rows[base];
    } else {
      Set(*o, lane, row);
    }
  }
}

void RayGroup::AddRow(int camera, bool repeated) {
  if (count == static_cast<int>(rows.size())) rows.resize(count + 1);
  RayRow& row = rows[count++];
  std::fill(row.sigma_px, row.sigma_px + kNodeLanes, 0.0f);
  row.camera = camera;
  row.repeated = repeated;
}

void RayGroup::CountRays() {
  repeats = false;
  std::fill(rays, rays + kNodeLanes, 0);
  std::fill(cameras, cameras + kNodeLanes, 0);
  for (int i = 0; i < count; ++i) {
    repeats |= rows[i].repeated;
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      const int seen = rows[i].sigma_px[lane] > 0;
      rays[lane] += seen;
      cameras[lane] += rows[i].repeated ? 0 : seen;
    }
  }
}

int RayGroup::RowOfRay(int lane, int i) const {
  if (rays[lane] == count) return i;
  int row = 0;
  while (rows[row].sigma_px[lane] == 0 || i-- > 0) ++row;
  return row;
}

}  // namespace weft

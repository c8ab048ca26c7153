#include "triangulation/ray_groups.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

static_assert(kBytesAhead == kNodeLanes * sizeof(Observation));
constexpr int kMaxNodeIndex = 4096;  // of a row or column, Board::Validate

constexpr int kColumnBits = 9, kRowBits = 13;
static_assert(kMaxNodeIndex / kNodeLanes < 1 << kColumnBits && kMaxNodeIndex < 1 << kRowBits);
constexpr uint32_t kNoGroup = ~0u;
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

RayCamera MakeRayCamera(const CameraModel& camera, double calibration_sigma_px) {
  RayCamera out{};
  for (int i = 0; i < 9; ++i) {
    out.rotation[i] = camera.rotation(i / 3, i % 3);
    out.rough.rotation[i] = static_cast<float>(out.rotation[i]);
  }
  for (int i = 0; i < 8; ++i) out.rough.distortion[i] = static_cast<float>(camera.distortion[i]);
  out.rough.fx_px = static_cast<float>(camera.fx_px);
  out.rough.fy_px = static_cast<float>(camera.fy_px);
  out.inverse_focal_px[0] = 1 / camera.fx_px, out.inverse_focal_px[1] = 1 / camera.fy_px;
  out.center_px[0] = camera.cx_px, out.center_px[1] = camera.cy_px;
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

// The row of a camera that saw all nodes of a group, from as many observations; false where they are not
// valid, or not one of each node in order.
bool SetAll(const RayCamera& camera, const Observation* seen, RayRow* row) {
  return seen->node.col % kNodeLanes == 0 && IsValid(seen[0]) && IsValid(seen[kNodeLanes - 1]) &&
         BestRayKernels().read(camera, seen, row);
}

// As `read` does it.
void Set(const RayCamera& camera, const Observation& o, uint32_t lane, RayRow* row) {
  const double pixel_px[2] = {o.x_px, o.y_px};
  for (int k = 0; k < 2; ++k) {
    const double exact = (pixel_px[k] - camera.center_px[k]) * camera.inverse_focal_px[k];
    row->pixel[k][lane] = static_cast<float>(exact);
    row->to_ray[k][lane] = static_cast<float>(exact - row->pixel[k][lane]);
  }
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
  RayGroups groups;
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    groups.cameras_.push_back(MakeRayCamera(
        rig.cameras[c], std::hypot(options.refinement.calibration_sigma_px, left.empty() ? 0 : left[c])));
  }
  size_t observations = 0;
  const ViewObservations* largest = nullptr;
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(rig.cameras.size())) {
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     rig.cameras.size(), " cameras, numbered from 0"));
    }
    groups.views_.push_back(&view);
    observations += view.observations.size();
    if (largest == nullptr || view.observations.size() > largest->observations.size()) largest = &view;
  }
  std::stable_sort(groups.views_.begin(), groups.views_.end(),
                   [](const auto* a, const auto* b) { return a->camera < b->camera; });
  // The largest view tells where there is work.
  constexpr size_t kObservationsPerPart = 1 << 18;
  const size_t parts = observations / kObservationsPerPart + 1;
  groups.first_group_ = {0, kNoGroup};
  for (size_t p = 1; p < parts; ++p)
    groups.first_group_.push_back(
        GroupOf(largest->observations[largest->observations.size() * p / parts].node));
  std::sort(groups.first_group_.begin(), groups.first_group_.end());
  for (size_t p = 0; p <= parts; ++p) {
    for (const ViewObservations* view : groups.views_) {
      const Observation* const begin = view->observations.data();
      const Observation* const end = begin + view->observations.size();
      const auto is_before = [&](const Observation& o) { return GroupOf(o.node) < groups.first_group_[p]; };
      groups.begins_.push_back(p == parts ? end : std::partition_point(begin, end, is_before));
    }
  }
  return groups;
}

RayGroupReader::RayGroupReader(const RayGroups& groups, size_t part)
    : cameras_(groups.cameras_), end_group_(groups.first_group_[part + 1]) {
  const uint32_t first_group = groups.first_group_[part];
  next_.resize(groups.views_.size());
  const size_t views = groups.views_.size();
  for (size_t v = 0; v < views; ++v) {
    const Observation* const* const begin = &groups.begins_[part * views + v];
    cursors_.push_back({begin[0], begin[views], groups.views_[v]->camera});
    in_order_ &= begin[0] <= begin[views];
    if (in_order_)
      most_observations_ = std::max(most_observations_, static_cast<size_t>(begin[views] - begin[0]));
    LookAhead(v, first_group);
  }
}

// Sets the group that a cursor is at, which must be one of this part and none before `least`.
void RayGroupReader::LookAhead(size_t cursor, uint32_t least) {
  const Cursor& c = cursors_[cursor];
  next_[cursor] = c.at < c.end ? GroupOf(c.at->node) : kNoGroup;
  if (c.at >= c.end || (next_[cursor] >= least && next_[cursor] < end_group_)) return;
  in_order_ = false;
  next_[cursor] = kNoGroup;
}

bool RayGroupReader::Next(RayGroup* out) {
  uint32_t group = kNoGroup;
  for (const uint32_t next : next_) group = std::min(group, next);
  if (group == kNoGroup) return false;
  out->first_node = FirstNodeOf(group);
  out->count = 0;
  for (size_t v = 0; v < cursors_.size(); ++v) {
    if (next_[v] != group) continue;
    Add(v, out);
    out->rows[out->count - 1].ahead = cursors_[v].at;
  }
  out->CountRays();
  BestRayKernels().undistort(cameras_.data(), out->count, out->rows.data());
  return true;
}

// The observations that the cursor's view has of its group.
void RayGroupReader::Add(size_t cursor, RayGroup* out) {
  Cursor& c = cursors_[cursor];
  const RayCamera& camera = cameras_[c.camera];
  const uint32_t group = next_[cursor];
  // The rows that the camera has already, by another view.
  int base = out->count;
  while (base > 0 && out->rows[base - 1].camera == c.camera) --base;
  if (base == out->count) {
    out->AddRow(c.camera, false);
    if (c.end - c.at >= kNodeLanes && SetAll(camera, c.at, &out->rows[base])) {
      c.at += kNodeLanes;
      // A node that was seen twice comes next.
      if (c.at == c.end || GroupOf(c.at->node) != group) return LookAhead(cursor, group + 1);
    } else {
      std::fill_n(out->rows[base].sigma_px, kNodeLanes, 0.0f);
    }
  }
  RayRow* row = &out->rows[base];
  for (; c.at < c.end && GroupOf(c.at->node) == group; ++c.at) {
    in_order_ &= IsValid(*c.at);
    const uint32_t lane = static_cast<uint32_t>(c.at->node.col) % kNodeLanes;
    if (row->sigma_px[lane] > 0) {
      int again = base + 1;
      while (again < out->count && out->rows[again].sigma_px[lane] > 0) ++again;
      if (again == out->count) {
        out->AddRow(c.camera, true);
        std::fill_n(out->rows[again].sigma_px, kNodeLanes, 0.0f);
      }
      Set(camera, *c.at, lane, &out->rows[again]);
      row = &out->rows[base];
    } else {
      Set(camera, *c.at, lane, row);
    }
  }
  LookAhead(cursor, group + 1);
}

absl::StatusOr<std::vector<ViewObservations>> InOrderOfGroups(const Rig& rig,
                                                              const std::vector<ViewObservations>& views) {
  for (const ViewObservations& view : views)
    for (const Observation& o : view.observations)
      if (!IsValid(o)) return ErrorOf(rig.cameras[view.camera], o);
  std::vector<ViewObservations> sorted = views;
  tbb::parallel_for(size_t{0}, sorted.size(), [&](size_t v) {
    std::stable_sort(
        sorted[v].observations.begin(), sorted[v].observations.end(),
        [](const Observation& a, const Observation& b) { return GroupOf(a.node) < GroupOf(b.node); });
  });
  return sorted;
}

void RayGroup::AddRow(int camera, bool repeated) {
  if (count == static_cast<int>(rows.size())) rows.resize(count + 1);
  RayRow& row = rows[count++];
  row.camera = camera;
  row.repeated = repeated;
  row.ahead = nullptr;
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
  if (std::any_of(rays, rays + kNodeLanes, [&](int n) { return n != count; })) ListRows();
}

void RayGroup::ListRows() {
  if (rows_of_rays.size() < rows.size() * kNodeLanes) rows_of_rays.resize(rows.size() * kNodeLanes);
  int listed[kNodeLanes] = {};
  for (int i = 0; i < count; ++i) {
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      rows_of_rays[listed[lane] * kNodeLanes + lane] =
          i;  // written over by the next row where it lacks the node
      listed[lane] += rows[i].sigma_px[lane] > 0;
    }
  }
}

}  // namespace weft

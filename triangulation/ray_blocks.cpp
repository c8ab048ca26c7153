#include "triangulation/ray_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "triangulation/sight.h"

namespace weft {
namespace {

constexpr int kMaxNodeIndex = 4096;  // of a row or column, Board::Validate
// Few enough for the rays of a block to stay in the second-level cache, many enough to fill the lanes of a
// view.
constexpr int kBlockBits = 6;
constexpr uint32_t kMaxBlocks = 1 << 15;

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
  constexpr double kEnd = 4;  // 63 degrees off the axis
  for (int i = 1; i <= kSteps; ++i) {
    const double r2 = kEnd * i / kSteps;
    const double numerator = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double denominator = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
    const double radial = numerator / denominator;
    const double slope =
        (d[0] + r2 * (2 * d[1] + r2 * 3 * d[4])) - radial * (d[5] + r2 * (2 * d[6] + r2 * 3 * d[7]));
    if (!(denominator > 0) || !(radial + 2 * r2 * slope / denominator > 0.05)) return kEnd * (i - 1) / kSteps;
  }
  return kEnd;
}

RayCamera MakeRayCamera(const CameraModel& camera, double calibration_sigma_px) {
  RayCamera out{};
  out.fx_px = camera.fx_px, out.fy_px = camera.fy_px;
  out.cx_px = camera.cx_px, out.cy_px = camera.cy_px;
  std::copy(camera.distortion.begin(), camera.distortion.end(), out.distortion);
  const Eigen::Vector3d origin = camera.CenterWorld();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.rotation[3 * i + j] = camera.rotation(i, j);
    out.origin_mm[i] = origin[i];
    out.axis[i] = static_cast<float>(camera.rotation(2, i));
  }
  out.calibration_px2 = static_cast<float>(calibration_sigma_px * calibration_sigma_px);
  out.safe_square = SafeSquare(camera.distortion);
  return out;
}

// The ray of a pixel that the kernel does not vouch for; false where there is none.
bool PlainRay(const CameraModel& camera, const Observation& o, RayRecord* ray) {
  const UndistortedPoint point = UndistortAll(camera, std::span(&o, 1)).front();
  if (!point.valid) return false;
  const Sight sight = MakeSight(camera, 0, point, o.sigma_px);
  const Eigen::Vector3d along = sight.direction / sight.axis.dot(sight.direction);
  for (int k = 0; k < 3; ++k) ray->along[k] = along[k];
  for (int k = 0; k < 6; ++k)
    ray->pixel_from_offset[k] = static_cast<float>(sight.pixel_from_offset(k / 3, k % 3));
  return true;
}

}  // namespace

absl::StatusOr<RayBlocks> RayBlocks::Build(const Rig& rig, const std::vector<ViewObservations>& views,
                                           const TriangulationOptions& options) {
  const std::vector<double>& left = options.refinement.camera_sigma_px;
  if (!left.empty() && left.size() != rig.cameras.size()) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.refinement.camera_sigma_px has ",
                                                   left.size(), " entries, the rig has ", rig.cameras.size(),
                                                   " cameras"));
  }
  RayBlocks blocks(rig, views);
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    blocks.cameras_.push_back(MakeRayCamera(
        rig.cameras[c], std::hypot(options.refinement.calibration_sigma_px, left.empty() ? 0 : left[c])));
  }
  blocks.index_.resize(views.size());
  std::vector<const Observation*> wrong(views.size(), nullptr);
  std::vector<uint32_t> rows(views.size()), cols(views.size());
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(rig.cameras.size())) {
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     rig.cameras.size(), " cameras, numbered from 0"));
    }
  }
  // One reading of the observations checks them and keeps their nodes in short.
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) {
    std::vector<uint32_t>& slots = blocks.index_[v].slots;
    slots.reserve(views[v].observations.size());
    for (const Observation& o : views[v].observations) {
      if (!IsValid(o)) {
        wrong[v] = &o;
        return;
      }
      rows[v] = std::max(rows[v], static_cast<uint32_t>(o.node.row) + 1);
      cols[v] = std::max(cols[v], static_cast<uint32_t>(o.node.col) + 1);
      slots.push_back(static_cast<uint32_t>(o.node.kind) << 26 | static_cast<uint32_t>(o.node.row) << 13 |
                      static_cast<uint32_t>(o.node.col));
    }
  });
  for (size_t v = 0; v < views.size(); ++v) {
    if (wrong[v] != nullptr) return ErrorOf(rig.cameras[views[v].camera], *wrong[v]);
    blocks.rows_ = std::max(blocks.rows_, rows[v]);
    blocks.cols_ = std::max(blocks.cols_, cols[v]);
  }
  const uint32_t slots = 2 * blocks.rows_ * blocks.cols_;
  blocks.block_bits_ = kBlockBits;
  while (slots >> blocks.block_bits_ > kMaxBlocks) ++blocks.block_bits_;
  blocks.blocks_ = (slots + (1u << blocks.block_bits_) - 1) >> blocks.block_bits_;
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) { blocks.IndexView(v); });
  blocks.by_camera_.resize(views.size());
  std::iota(blocks.by_camera_.begin(), blocks.by_camera_.end(), 0);
  std::stable_sort(blocks.by_camera_.begin(), blocks.by_camera_.end(),
                   [&](size_t a, size_t b) { return views[a].camera < views[b].camera; });
  return blocks;
}

void RayBlocks::IndexView(size_t view) {
  ViewIndex& index = index_[view];
  index.start.assign(blocks_ + 1, 0);
  uint32_t last = 0;
  bool in_order = true;
  for (uint32_t& slot : index.slots) {
    slot = ((slot >> 26) * rows_ + (slot >> 13 & 0x1fff)) * cols_ + (slot & 0x1fff);
    const uint32_t block = slot >> block_bits_;
    ++index.start[block + 1];
    in_order &= block >= last;
    last = block;
  }
  for (size_t b = 0; b < blocks_; ++b) index.start[b + 1] += index.start[b];
  if (in_order) return;
  index.order.resize(index.slots.size());
  std::vector<uint32_t> next = index.start;
  for (uint32_t i = 0; i < index.slots.size(); ++i) index.order[next[index.slots[i] >> block_bits_]++] = i;
}

void RayBlocks::Fill(size_t block, RayBlock* out) const {
  const uint32_t block_slots = 1u << block_bits_;
  const uint32_t first_slot = static_cast<uint32_t>(block) << block_bits_;
  std::vector<int32_t> rays(block_slots, 0);
  for (const ViewIndex& index : index_) {
    for (uint32_t i = index.start[block]; i < index.start[block + 1]; ++i)
      ++rays[index.slots[index.order.empty() ? i : index.order[i]] - first_slot];
  }
  out->nodes.clear();
  int records = 0;
  std::vector<int32_t> node_of_slot(block_slots, -1);
  for (uint32_t s = 0; s < block_slots; ++s) {
    if (rays[s] == 0) continue;
    const uint32_t slot = first_slot + s;
    node_of_slot[s] = static_cast<int32_t>(out->nodes.size());
    const BoardNode node{static_cast<int>(slot / cols_ % rows_), static_cast<int>(slot % cols_),
                         static_cast<NodeKind>(slot / cols_ / rows_)};
    out->nodes.push_back({node, records, 0});
    records += (rays[s] + kRayLanes - 1) / kRayLanes * kRayLanes;
  }
  if (static_cast<int>(out->rays.size()) < records) out->rays.resize(records);
  for (size_t i = 0; i < by_camera_.size(); ++i) {
    if (i + 1 < by_camera_.size()) Prefetch(by_camera_[i + 1], block);
    AddRays(by_camera_[i], block, node_of_slot, out);
  }
  for (const NodeRays& node : out->nodes) {
    // Any ray will do.
    for (int i = node.count; i % kRayLanes != 0; ++i) out->rays[node.first + i] = out->rays[node.first];
  }
}

// The observations of many views are more streams than a processor foresees.
void RayBlocks::Prefetch(size_t view, size_t block) const {
  const ViewIndex& index = index_[view];
  if (!index.order.empty() || index.start[block] == index.start[block + 1]) return;
  const std::vector<Observation>& observations = (*views_)[view].observations;
  const char* first = reinterpret_cast<const char*>(observations.data() + index.start[block]);
  const char* last = reinterpret_cast<const char*>(observations.data() + index.start[block + 1]);
  constexpr int kCacheLine = 64;
  for (; first < last; first += kCacheLine) __builtin_prefetch(first);
}

void RayBlocks::AddRays(size_t view, size_t block, const std::vector<int32_t>& node_of_slot,
                        RayBlock* out) const {
  const ViewIndex& index = index_[view];
  const std::vector<Observation>& observations = (*views_)[view].observations;
  const int camera = (*views_)[view].camera;
  RayColumns& columns = out->columns;
  const uint32_t slot_mask = (1u << block_bits_) - 1;
  const auto place_of = [&](uint32_t i) { return index.order.empty() ? i : index.order[i]; };
  for (uint32_t first = index.start[block]; first < index.start[block + 1]; first += RayColumns::kCount) {
    const int count = std::min<int>(RayColumns::kCount, index.start[block + 1] - first);
    for (int i = 0; i < count; ++i) {
      const uint32_t place = place_of(first + i);
      const Observation& o = observations[place];
      columns.x_px[i] = o.x_px;
      columns.y_px[i] = o.y_px;
      columns.sigma_px[i] = o.sigma_px;
      NodeRays& node = out->nodes[node_of_slot[index.slots[place] & slot_mask]];
      columns.record[i] = &out->rays[node.first + node.count++];
    }
    for (int i = count; i % kRayLanes != 0; ++i) {
      columns.x_px[i] = columns.x_px[0];
      columns.y_px[i] = columns.y_px[0];
      columns.sigma_px[i] = columns.sigma_px[0];
    }
    BestRayKernels().unproject(cameras_.data(), camera, count, &columns);
    // From the last one on, so that records that go move none that is still to be looked at.
    for (int i = count - 1; i >= 0; --i) {
      const uint32_t place = place_of(first + i);
      if (columns.valid[i] || PlainRay(rig_->cameras[camera], observations[place], columns.record[i]))
        continue;
      NodeRays& node = out->nodes[node_of_slot[index.slots[place] & slot_mask]];
      RayRecord* end = &out->rays[node.first + node.count--];
      std::copy(columns.record[i] + 1, end, columns.record[i]);
    }
  }
}

}  // namespace weft

#include "alignment/ray_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {

struct RayScene::Handles {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Handles() = default;
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;
  ~Handles() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

namespace {

constexpr float kMiddle = 0.5f;  // time of the middle of the exposure

absl::Status CheckMesh(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                       const std::vector<Eigen::Vector3d>& path_mm) {
  const int count = static_cast<int>(vertices_mm.size());
  for (size_t f = 0; f < faces.size(); ++f)
    for (const int v : faces[f])
      if (v < 0 || v >= count)
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, " names vertex ", v, " of a mesh with ", count, " vertices"));
  if (!path_mm.empty() && path_mm.size() != vertices_mm.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("motion of ", path_mm.size(), " vertices for a mesh with ", count));
  }
  for (int v = 0; v < count; ++v)
    if (!vertices_mm[v].allFinite() || (!path_mm.empty() && !path_mm[v].allFinite()))
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " is not finite"));
  return absl::OkStatus();
}

// Vertices at a share of the exposure before (negative) or after its middle. False without memory.
bool SetPositions(RTCGeometry geometry, unsigned step, const std::vector<Eigen::Vector3d>& vertices_mm,
                  const std::vector<Eigen::Vector3d>& path_mm, double share) {
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices_mm.size()));
  if (!positions) return vertices_mm.empty();
  for (size_t v = 0; v < vertices_mm.size(); ++v) {
    const Eigen::Vector3d place =
        path_mm.empty() ? vertices_mm[v] : Eigen::Vector3d(vertices_mm[v] + share * path_mm[v]);
    for (int i = 0; i < 3; ++i) positions[3 * v + i] = static_cast<float>(place[i]);
  }
  return true;
}

bool SetFaces(RTCGeometry geometry, const std::vector<Face>& faces) {
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), faces.size()));
  if (!indices) return faces.empty();
  for (size_t f = 0; f < faces.size(); ++f)
    for (int i = 0; i < 3; ++i) indices[3 * f + i] = static_cast<unsigned>(faces[f][i]);
  return true;
}

}  // namespace

absl::StatusOr<RayScene> RayScene::Build(const std::vector<Eigen::Vector3d>& vertices_mm,
                                         const std::vector<Face>& faces,
                                         const std::vector<Eigen::Vector3d>& path_mm) {
  if (absl::Status status = CheckMesh(vertices_mm, faces, path_mm); !status.ok()) return status;
  auto handles = std::make_shared<Handles>();
  handles->device = rtcNewDevice(nullptr);
  if (!handles->device)
    return absl::InternalError(absl::StrCat("Embree cannot start, error ", rtcGetDeviceError(nullptr)));
  handles->scene = rtcNewScene(handles->device);
  // Robust: rays through a shared edge do not slip between its two faces.
  rtcSetSceneFlags(handles->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(handles->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  bool complete = true;
  if (path_mm.empty()) {
    complete = SetPositions(geometry, 0, vertices_mm, path_mm, 0);
  } else {
    rtcSetGeometryTimeStepCount(geometry, 2);
    for (unsigned step = 0; step < 2; ++step)
      complete = complete && SetPositions(geometry, step, vertices_mm, path_mm, step - 0.5);
  }
  if (!complete || !SetFaces(geometry, faces)) {
    rtcReleaseGeometry(geometry);
    return absl::ResourceExhaustedError("Embree has no memory for the mesh");
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(handles->scene, geometry);
  rtcReleaseGeometry(geometry);
  // On one thread, so that the tree, and with it the face that a ray through an edge reports, never varies.
  tbb::task_arena(1).execute([&] { rtcJoinCommitScene(handles->scene); });
  if (const RTCError error = rtcGetDeviceError(handles->device); error != RTC_ERROR_NONE)
    return absl::InternalError(absl::StrCat("Embree cannot build the scene, error ", error));
  RayScene out;
  out.handles_ = std::move(handles);
  return out;
}

RayHit RayScene::Cast(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit r;
  std::memset(&r, 0, sizeof(r));
  r.ray.org_x = origin_mm.x(), r.ray.org_y = origin_mm.y(), r.ray.org_z = origin_mm.z();
  r.ray.dir_x = direction.x(), r.ray.dir_y = direction.y(), r.ray.dir_z = direction.z();
  r.ray.tfar = std::numeric_limits<float>::infinity();
  r.ray.time = kMiddle;
  r.ray.mask = 0xffffffffU;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(handles_->scene, &context, &r);
  RayHit out;
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return out;
  out.face = static_cast<int>(r.hit.primID);
  out.distance_mm = r.ray.tfar;
  out.weight_b = r.hit.u, out.weight_c = r.hit.v;
  out.from_outside = direction.dot(Eigen::Vector3f(r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z)) < 0;
  return out;
}

void RayScene::CastPacket(const Eigen::Vector3f& origin_mm, const Packet& packet,
                          std::array<RayHit, kPacket>* hits) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[kPacket];
  RTCRayHit16 r;
  for (int i = 0; i < kPacket; ++i) {
    const Eigen::Vector3f& d = packet.direction[i];
    valid[i] = std::isnan(d.x()) ? 0 : -1;
    r.ray.org_x[i] = origin_mm.x(), r.ray.org_y[i] = origin_mm.y(), r.ray.org_z[i] = origin_mm.z();
    r.ray.dir_x[i] = d.x(), r.ray.dir_y[i] = d.y(), r.ray.dir_z[i] = d.z();
    r.ray.tnear[i] = 0, r.ray.time[i] = packet.time[i];
    r.ray.tfar[i] = std::numeric_limits<float>::infinity();
    r.ray.mask[i] = 0xffffffffU, r.ray.id[i] = 0, r.ray.flags[i] = 0;
    r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect16(valid, handles_->scene, &context, &r);
  for (int i = 0; i < kPacket; ++i) {
    RayHit& out = (*hits)[i];
    out = RayHit();
    if (!valid[i] || r.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    out.face = static_cast<int>(r.hit.primID[i]);
    out.distance_mm = r.ray.tfar[i];
    out.weight_b = r.hit.u[i], out.weight_c = r.hit.v[i];
    const Eigen::Vector3f normal(r.hit.Ng_x[i], r.hit.Ng_y[i], r.hit.Ng_z[i]);
    out.from_outside = packet.direction[i].dot(normal) < 0;
  }
}

bool RayScene::Occluded(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction, float near_mm,
                        float far_mm) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay r;
  std::memset(&r, 0, sizeof(r));
  r.org_x = origin_mm.x(), r.org_y = origin_mm.y(), r.org_z = origin_mm.z();
  r.dir_x = direction.x(), r.dir_y = direction.y(), r.dir_z = direction.z();
  r.tnear = near_mm, r.tfar = far_mm;
  r.time = kMiddle;
  r.mask = 0xffffffffU;
  rtcOccluded1(handles_->scene, &context, &r);
  return r.tfar < 0;
}

bool RayScene::InSight(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm,
                       double clearance_mm) const {
  const Eigen::Vector3d way = to_mm - from_mm;
  const double length = way.norm();
  if (length <= clearance_mm) return true;
  // From the far end, where single precision is finest close to the surface.
  const Eigen::Vector3f back = (-way / length).cast<float>();
  return !Occluded(to_mm.cast<float>(), back, static_cast<float>(clearance_mm), static_cast<float>(length));
}

}  // namespace weft

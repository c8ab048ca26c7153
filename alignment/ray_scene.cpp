#include "alignment/ray_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <new>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

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

absl::Status CheckMesh(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces) {
  const int count = static_cast<int>(vertices_mm.size());
  for (size_t f = 0; f < faces.size(); ++f)
    for (const int v : faces[f])
      if (v < 0 || v >= count)
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, " names vertex ", v, " of a mesh with ", count, " vertices"));
  for (int v = 0; v < count; ++v)
    if (!vertices_mm[v].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " is not finite"));
  return absl::OkStatus();
}

// False without memory.
bool SetPositions(RTCGeometry geometry, const std::vector<Eigen::Vector3d>& vertices_mm) {
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices_mm.size()));
  if (!positions) return vertices_mm.empty();
  for (size_t v = 0; v < vertices_mm.size(); ++v)
    for (int i = 0; i < 3; ++i) positions[3 * v + i] = static_cast<float>(vertices_mm[v][i]);
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
                                         const std::vector<Face>& faces) {
  WEFT_RETURN_IF_ERROR(CheckMesh(vertices_mm, faces));
  auto handles = std::make_shared<Handles>();
  handles->device = rtcNewDevice(nullptr);
  if (!handles->device) {
    const RTCError error = rtcGetDeviceError(nullptr);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();  // as any other allocation
    return absl::InternalError(absl::StrCat("Embree cannot start, error ", error));
  }
  handles->scene = rtcNewScene(handles->device);
  // Robust: rays through a shared edge do not slip between its two faces.
  rtcSetSceneFlags(handles->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(handles->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!SetPositions(geometry, vertices_mm) || !SetFaces(geometry, faces)) {
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

bool RayScene::Occluded(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction, float near_mm,
                        float far_mm) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay r;
  std::memset(&r, 0, sizeof(r));
  r.org_x = origin_mm.x(), r.org_y = origin_mm.y(), r.org_z = origin_mm.z();
  r.dir_x = direction.x(), r.dir_y = direction.y(), r.dir_z = direction.z();
  r.tnear = near_mm, r.tfar = far_mm;
  r.mask = 0xffffffffU;
  rtcOccluded1(handles_->scene, &context, &r);
  return r.tfar < 0;
}

uint32_t RayScene::Occluded(const Packet& packet) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) int valid[kPacket];
  RTCRay16 r;
  std::memset(&r, 0, sizeof(r));
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = i < packet.count ? -1 : 0;
    if (i >= packet.count) continue;
    const Eigen::Vector3f &o = packet.origin_mm[i], &d = packet.direction[i];
    r.org_x[i] = o.x(), r.org_y[i] = o.y(), r.org_z[i] = o.z();
    r.dir_x[i] = d.x(), r.dir_y[i] = d.y(), r.dir_z[i] = d.z();
    r.tnear[i] = packet.near_mm[i], r.tfar[i] = packet.far_mm[i];
    r.mask[i] = 0xffffffffU;
  }
  rtcOccluded16(valid, handles_->scene, &context, &r);
  uint32_t out = 0;
  for (int i = 0; i < packet.count; ++i)
    if (r.tfar[i] < 0) out |= 1U << i;
  return out;
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

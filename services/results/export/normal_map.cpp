#include "services/results/export/normal_map.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// glTF 2.0, 3.9.3: blue is above one half. Steeper normals lean as far as that.
constexpr double kLeastBlue = 1.0 / 127;
const Eigen::Vector4f kFlat(0, 0, 1, 1);

Eigen::Vector3d Normalized(const Eigen::Vector3d& vector) {
  return vector.norm() > 0 ? Eigen::Vector3d(vector.normalized()) : vector;
}

Eigen::Vector3d InPlaneOf(const Eigen::Vector3d& normal, const Eigen::Vector3d& vector) {
  return Normalized(vector - normal.dot(vector) * normal);
}

template <typename Value>
Value Blend(const Texel& texel, const Value& a, const Value& b, const Value& c) {
  const double weight_b = texel.weight_b, weight_c = texel.weight_c;
  return (1 - weight_b - weight_c) * a + weight_b * b + weight_c * c;
}

}  // namespace

absl::StatusOr<NormalMap> NormalMap::Make(int size_px, std::vector<Face> faces, const MeshTexture& texture,
                                          ReducedMesh base) {
  constexpr char kOption[] = "--normal-map";
  if (base.vertices.size() >= texture.of_vertex.size() && !texture.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--max-vertices: the mesh has ", texture.of_vertex.size(),
        " vertices, so that the coarser one lacks nothing that a normal map could hold; choose fewer"));
  }
  WEFT_ASSIGN_OR_RETURN(std::vector<Texel> whole, RasterizeTexture(size_px, faces, texture, kOption));
  WEFT_ASSIGN_OR_RETURN(std::vector<Texel> coarse,
                        RasterizeTexture(size_px, base.faces, base.texture, kOption));
  NormalMap map;
  map.size_px_ = size_px;
  map.faces_ = std::move(faces);
  map.base_split_ = SplitAtSeams(base.vertices.size(), base.faces, base.texture);
  map.base_ = std::move(base);
  map.whole_texels_ = std::move(whole);
  map.base_texels_ = std::move(coarse);
  return map;
}

// A vertex' tangent is the mean over its corners of the direction of u in the face, turned into the plane of
// the vertex' normal and weighted by the corner's angle in that plane.
std::vector<NormalMap::TangentFrame> NormalMap::TangentFrames(
    const std::vector<Eigen::Vector3d>& vertices) const {
  std::vector<Eigen::Vector3d> of_base;
  for (const int vertex : base_.vertices) of_base.push_back(vertices[vertex]);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(of_base, base_.faces);
  std::vector<TangentFrame> frames(base_split_.origin.size());
  std::vector<double> sides(frames.size());
  for (size_t v = 0; v < frames.size(); ++v)
    frames[v] = {normals[base_split_.origin[v]], Eigen::Vector3d::Zero(), 1};
  for (const Face& face : base_split_.faces) {
    const auto position = [&](int k) { return of_base[base_split_.origin[face[k % 3]]]; };
    const auto uv = [&](int k) { return base_split_.uv[face[k % 3]].cast<double>(); };
    const Eigen::Vector2d uv_b = uv(1) - uv(0), uv_c = uv(2) - uv(0);
    const double area = uv_b.x() * uv_c.y() - uv_b.y() * uv_c.x();
    if (!(std::abs(area) > 0)) continue;
    const double side = area > 0 ? 1 : -1;
    const Eigen::Vector3d along_u =
        side * (uv_c.y() * (position(1) - position(0)) - uv_b.y() * (position(2) - position(0)));
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& normal = frames[face[k]].normal;
      const Eigen::Vector3d next = InPlaneOf(normal, position(k + 1) - position(k));
      const Eigen::Vector3d previous = InPlaneOf(normal, position(k + 2) - position(k));
      const double angle = std::acos(std::clamp(next.dot(previous), -1.0, 1.0));
      frames[face[k]].tangent += angle * InPlaneOf(normal, along_u);
      sides[face[k]] += side;
    }
  }
  for (size_t v = 0; v < frames.size(); ++v) {
    frames[v].tangent = Normalized(frames[v].tangent);
    frames[v].side = sides[v] < 0 ? -1 : 1;
  }
  return frames;
}

std::vector<Eigen::Vector4f> NormalMap::Tangents(const std::vector<Eigen::Vector3d>& vertices) const {
  std::vector<Eigen::Vector4f> tangents;
  for (const TangentFrame& frame : TangentFrames(vertices)) {
    // Vertices whose faces have no area on the print show none of the map.
    const Eigen::Vector3d tangent =
        frame.tangent.norm() > 0 ? frame.tangent : Eigen::Vector3d(frame.normal.unitOrthogonal());
    tangents.emplace_back() << tangent.cast<float>(), static_cast<float>(frame.side);
  }
  return tangents;
}

std::vector<uint8_t> NormalMap::Bake(const std::vector<Eigen::Vector3d>& vertices) const {
  const std::vector<Eigen::Vector3d> normals = VertexNormals(vertices, faces_);
  const std::vector<TangentFrame> frames = TangentFrames(vertices);
  std::vector<Eigen::Vector4f> values(base_texels_.size(), Eigen::Vector4f::Zero());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, values.size(), 4096), [&](const auto& range) {
    for (size_t t = range.begin(); t < range.end(); ++t) {
      const Texel &whole = whole_texels_[t], &base = base_texels_[t];
      if (whole.face < 0 || base.face < 0) continue;
      const auto [a, b, c] = faces_[whole.face];
      const Eigen::Vector3d normal = Blend(whole, normals[a], normals[b], normals[c]);
      const auto [d, e, f] = base_split_.faces[base.face];
      Eigen::Matrix3d surface_from_tangent;  // not of length 1: readers interpolate in the same way
      surface_from_tangent.col(0) = Blend(base, frames[d].tangent, frames[e].tangent, frames[f].tangent);
      surface_from_tangent.col(2) = Blend(base, frames[d].normal, frames[e].normal, frames[f].normal);
      surface_from_tangent.col(1) =
          frames[d].side * surface_from_tangent.col(2).cross(surface_from_tangent.col(0));
      if (!(std::abs(surface_from_tangent.determinant()) > 1e-6)) continue;
      Eigen::Vector3d in_tangent = Normalized(surface_from_tangent.inverse() * normal);
      in_tangent.z() = std::max(in_tangent.z(), kLeastBlue);
      values[t].head<3>() = Normalized(in_tangent).cast<float>();
      values[t].w() = 1;
    }
  });
  AddGutter(size_px_, values);
  std::vector<uint8_t> rgb;
  rgb.reserve(3 * values.size());
  for (const Eigen::Vector4f& value : values) {
    const Eigen::Vector3f normal = (value.w() > 0 ? value : kFlat).head<3>();
    for (const float component : normal)
      rgb.push_back(static_cast<uint8_t>(std::lround(127.5F * (1 + std::clamp(component, -1.0F, 1.0F)))));
  }
  return rgb;
}

}  // namespace weft

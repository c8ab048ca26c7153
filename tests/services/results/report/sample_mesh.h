// A made-up mesh for the tests of reports.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "services/formats/files/mesh_file.h"

namespace weft {

// A wavy sheet of 24 x 24 vertices of which the right quarter was not seen.
inline absl::Status WriteSampleMesh(const std::string& path) {
  constexpr int kSide = 24;
  RegisteredMesh mesh;
  std::vector<Face> faces;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      mesh.vertices_mm.emplace_back(10.0 * j, 10.0 * i, 12 * std::sin(0.5 * j));
      mesh.state.push_back(j < 18 ? VertexState::kObserved : VertexState::kInferred);
      mesh.sigma_mm.push_back(j < 18 ? 0.1f : 4.0f);
      mesh.views.push_back(j < 18 ? 5 : 0);
      if (i + 1 == kSide || j + 1 == kSide) continue;
      const int v = i * kSide + j;
      faces.push_back({v, v + kSide, v + 1});
      faces.push_back({v + 1, v + kSide, v + kSide + 1});
    }
  }
  return WriteRegisteredMesh(path, mesh, faces);
}

}  // namespace weft

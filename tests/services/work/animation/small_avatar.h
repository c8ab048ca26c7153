// An avatar of a few vertices, made of numbers alone.
#pragma once

#include <cmath>

#include "animation/avatar/sparse_view_avatar.h"

namespace weft {

// A row of `vertices`, which moves along y in one component and along z in the other.
inline SparseViewAvatar SmallAvatar(int vertices = 4) {
  SparseViewAvatar avatar;
  avatar.template_hash = "0123456789abcdef";
  avatar.board_hash = "fedcba9876543210";
  avatar.fps = 25;
  avatar.training_frames = 40, avatar.held_out_frames = 4;
  avatar.training.components = 2;
  avatar.held_out_check = {12, 0.625, 0.9375};
  avatar.space.vertices = vertices;
  const auto share = static_cast<float>(1 / std::sqrt(vertices));
  for (int v = 0; v < vertices; ++v)
    for (const float x :
         {10.0f * (static_cast<float>(v) - 0.5f * static_cast<float>(vertices - 1)), 0.0f, 0.0f})
      avatar.space.mean_mm.push_back(x);
  for (const int axis : {1, 2})
    for (int v = 0; v < vertices; ++v)
      for (int k = 0; k < 3; ++k) avatar.space.basis.push_back(k == axis ? share : 0.0f);
  avatar.space.sigma_mm = {30, 12.5f};
  avatar.space.left_mm = 0.75;
  avatar.acceleration = {0.1f, 0.2f};
  for (int e = 0; e + 1 < vertices; ++e)
    avatar.edge_mm.push_back(10), avatar.edge_follow.push_back(0), avatar.edge_spread_mm.push_back(0.25f);
  avatar.left_mm.assign(static_cast<size_t>(vertices), 0.5f);
  for (auto& of_rays : avatar.sigma.of) of_rays.fill(1.5f);
  return avatar;
}

}  // namespace weft

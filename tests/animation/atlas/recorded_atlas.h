// What a recorded result tells of an atlas.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "animation/atlas/atlas.h"
#include "tests/animation/recorded.h"

namespace weft {

// Its size, the kinds of its texels, an image that was gathered, and what vertices take back from it.
inline void AddAtlas(const std::string& name, const Atlas& atlas, AtlasImage image, Recorded& recorded) {
  std::vector<int> kinds;
  for (const TexelKind kind : atlas.kinds()) kinds.push_back(static_cast<int>(kind));
  recorded.Add(name + " width", atlas.width());
  recorded.Add(name + " height", atlas.height());
  recorded.Add(name + " kinds", kinds);
  recorded.Add(name + " image", image.values);
  recorded.Add(name + " back", atlas.Scatter(std::move(image)));
}

}  // namespace weft

// Takes without pictures on disk, of any motion.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "alignment/template.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/frames_file.h"

namespace weft {

// At 50 frames a second; `mesh_at` gives the vertices of a frame. The path again.
inline std::string WriteMovingTake(const std::string& path, const Template& garment, int frames,
                                   const std::function<std::vector<Eigen::Vector3d>(int frame)>& mesh_at) {
  std::filesystem::create_directories(path + "/truth");
  EXPECT_TRUE(WriteTemplate(path + "/template", garment).ok());
  const FramesHead head{garment.ContentHash(), static_cast<uint32_t>(garment.rest.vertices_mm.size()), 50,
                        false};
  std::ofstream file(path + "/truth/frames.bin", std::ios::binary);
  file << EncodeFramesHead(head);
  for (int k = 0; k < frames; ++k) file << EncodeClothFrame(head, {20'000'000 * k, mesh_at(k), {}});
  return path;
}

}  // namespace weft

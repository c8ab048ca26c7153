// Videos for tests, made by ffmpeg: grey pictures whose pixels all have the frame's value.
#pragma once

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"
#include "weft/v1/video.pb.h"

namespace weft {

inline constexpr int kMadeWidth_px = 32, kMadeHeight_px = 16;

inline void Shell(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

// Frames of these values at `rate`; `options`: of ffmpeg, before the file. Lossless with the default codec.
inline void MakeVideo(const std::string& path, const std::vector<int>& values, const std::string& rate,
                      const std::string& options = "-c:v ffv1") {
  std::string raw;
  for (const int value : values) raw.append(kMadeWidth_px * kMadeHeight_px, static_cast<char>(value));
  WriteBytes(path + ".raw", raw);
  Shell("ffmpeg -v error -y -f rawvideo -pixel_format gray -video_size 32x16 -framerate " + rate + " -i '" +
        path + ".raw' " + options + " '" + path + "'");
}

inline std::vector<int> Values(int first, int count) {
  std::vector<int> values;
  for (int i = 0; i < count; ++i) values.push_back(first + i);
  return values;
}

// As it prints, so that a difference can be read.
inline std::string FactsText(const std::string& text) {
  v1::VideoFacts facts;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &facts)) << text;
  return facts.DebugString();
}

}  // namespace weft

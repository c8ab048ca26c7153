// Small takes of PatternFrames.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "services/studio/recording/recorder.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/pattern_frames.h"

namespace weft {

// Options for takes of a few kilobytes.
inline RecorderOptions SmallRecorder() {
  RecorderOptions options;
  options.low_disk_bytes = 0;
  options.take.stream.preallocate_bytes = 0;
  return options;
}

inline void RecordSets(const std::string& folder, const std::vector<std::string>& cameras,
                       const std::vector<RawFrameSet>& sets) {
  RecorderOptions options = SmallRecorder();
  v1::Take take = NewTake("test");
  options.take.take = TakeNumber(take);
  const auto recorder = Recorder::Start(folder, cameras, options);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  ASSERT_TRUE(WriteTakeFile(folder, take).ok());
  for (const RawFrameSet& set : sets) ASSERT_TRUE((*recorder)->OfferAndWait(set));
  ASSERT_TRUE((*recorder)->Stop().ok());
}

// Sets 5 to 8; set 6 lacks the last camera.
inline void RecordPattern(const std::string& folder, PatternFrames& cameras) {
  std::vector<RawFrameSet> sets;
  for (uint64_t number = 5; number < 9; ++number) sets.push_back(cameras.Set(number));
  sets[1].frames.pop_back();
  sets[1].missing.push_back({cameras.camera_ids().back(), "3 packets lost"});
  RecordSets(folder, cameras.camera_ids(), sets);
}

}  // namespace weft

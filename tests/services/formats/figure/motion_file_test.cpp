#include "services/formats/figure/motion_file.h"

#include <gtest/gtest.h>

#include "figure/motion_generator.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

Motion Walk() { return *MakeMotion({MotionKind::kWalk, 1, 30, 7}); }

TEST(MotionFile, KeepsPosesToTheFloat) {
  const Motion motion = Walk();
  const TempFolder folder;
  ASSERT_TRUE(WriteMotion(folder / "walk.motion", motion).ok());
  const absl::StatusOr<Motion> read = ReadMotion(folder / "walk.motion");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->fps, 30);
  ASSERT_EQ(read->poses.size(), motion.poses.size());
  for (size_t k = 0; k < motion.poses.size(); ++k) {
    EXPECT_LT((read->poses[k].root_mm - motion.poses[k].root_mm).norm(), 1e-4);
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_LT((read->poses[k].rotation[j].coeffs() - motion.poses[k].rotation[j].coeffs()).norm(), 1e-6);
  }
  EXPECT_EQ(MotionHash(motion).size(), 16u);
}

TEST(MotionFile, SaysWhatIsWrongWithAFile) {
  const std::string good = EncodeMotion(Walk());
  const auto message = [](const std::string& bytes) {
    const absl::StatusOr<Motion> motion = DecodeMotion(bytes, "walk.motion");
    EXPECT_EQ(motion.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(motion.status().message());
  };
  EXPECT_NE(message("solid cube").find("walk.motion: is not a motion; it does not begin with"),
            std::string::npos);
  for (const char* bvh : {"HIERARCHY\nROOT Hips", "\xef\xbb\xbfhierarchy\r\n"})
    EXPECT_NE(message(bvh).find("walk.motion: is not a motion but BVH; import it with `weft motion import"),
              std::string::npos);
  EXPECT_NE(message(good.substr(0, 20)).find("ends within its head"), std::string::npos);
  EXPECT_NE(message(good.substr(0, good.size() - 1)).find("truncated"), std::string::npos);
  std::string damaged = good;
  damaged[200] = static_cast<char>(damaged[200] ^ 1);
  EXPECT_NE(message(damaged).find("checksum"), std::string::npos);
  std::string other = good;
  other[9] = static_cast<char>(other[9] ^ 1);
  EXPECT_NE(message(other).find("another skeleton"), std::string::npos);
  EXPECT_EQ(ReadMotion("/nowhere/walk.motion").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft

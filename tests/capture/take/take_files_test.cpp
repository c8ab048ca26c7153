#include "capture/take/take_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

TEST(TakeFiles, NameTheCamerasByTheirStreams) {
  const TempFolder folder;
  for (const char* name : {"cam10.stream", "cam2.stream", "cam2.index", "notes.txt"})
    WriteBytes(folder / ("streams/" + std::string(name)), "");
  EXPECT_TRUE(IsRecordedTake(folder.path()));
  const auto cameras = CamerasOfTake(folder.path());
  ASSERT_TRUE(cameras.ok()) << cameras.status();
  EXPECT_THAT(*cameras, ElementsAre("cam2", "cam10"));
  EXPECT_EQ(StreamFile(StreamFolder(folder.path()), "cam2"), folder / "streams/cam2.stream");
  EXPECT_EQ(IndexFile(StreamFolder(folder.path()), "cam2"), folder / "streams/cam2.index");
}

TEST(TakeFiles, SayWhyThereIsNoTake) {
  const TempFolder folder;
  EXPECT_EQ(CamerasOfTake(folder / "missing").status().message(), (folder / "missing") + ": no such folder");
  WriteBytes(folder / "images/0001/c00.png", "");
  EXPECT_FALSE(IsRecordedTake(folder / "images"));
  EXPECT_EQ(CamerasOfTake(folder / "images").status().code(), absl::StatusCode::kNotFound);
  WriteBytes(folder / "bare/streams/cam1.index", "");
  EXPECT_EQ(CamerasOfTake(folder / "bare").status().message(),
            (folder / "bare") + "/streams: holds no stream");
}

}  // namespace
}  // namespace weft

#include "services/results/export/export_stream.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

class ExportStreamTest : public ::testing::Test {
 protected:
  ExportStreamTest() : folder_(::testing::TempDir() + "/export_stream_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~ExportStreamTest() override { std::filesystem::remove_all(folder_); }

  const std::string folder_;
  const std::string path_ = folder_ + "/file";
};

TEST_F(ExportStreamTest, GoesOnWhereItWasCut) {
  const std::string large(3 << 20, 'x');
  {
    auto stream = ExportStream::Open(path_, 0);
    ASSERT_TRUE(stream.ok()) << stream.status();
    stream->Append("head");
    stream->Append(large);
    stream->Append("lost");
    EXPECT_EQ(stream->size(), large.size() + 8);
    ASSERT_TRUE(stream->Sync().ok());
  }
  auto stream = ExportStream::Open(path_, large.size() + 4);
  ASSERT_TRUE(stream.ok()) << stream.status();
  const float value = 1;
  stream->AppendValues(&value, 1);
  stream->Overwrite(0, "HEAD");
  ASSERT_TRUE(stream->Sync().ok());
  EXPECT_EQ(*ReadWholeFile(path_), "HEAD" + large + std::string("\0\0\x80\x3f", 4));
}

TEST_F(ExportStreamTest, RefusesAFileThatIsTooShort) {
  ASSERT_TRUE(WriteFileAtomically(path_, "abc").ok());
  const auto stream = ExportStream::Open(path_, 4);
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(stream.status().message(), ::testing::HasSubstr(path_));
}

TEST_F(ExportStreamTest, KeepsTheFirstError) {
  auto stream = ExportStream::Open("/dev/full", 0);
  ASSERT_TRUE(stream.ok()) << stream.status();
  stream->Append("x");
  EXPECT_EQ(stream->Sync().code(), absl::StatusCode::kResourceExhausted);
  stream->Append("y");
  EXPECT_EQ(stream->status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace weft

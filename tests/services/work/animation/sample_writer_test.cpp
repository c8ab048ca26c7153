#include "services/work/animation/sample_writer.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(WriteSamples, RunsStandInTheirOrderAfterTheHead) {
  const TempFolder folder;
  std::vector<double> shares;
  const absl::Status status = WriteSamples(
      folder / "samples.bin", "head", 5, 2,
      [](size_t run, std::string* samples) {
        samples->append(run + 1, static_cast<char>('a' + run));
        return absl::OkStatus();
      },
      [&](double share) { shares.push_back(share); });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(ReadBytes(folder / "samples.bin"), "headabbcccddddeeeee");
  EXPECT_EQ(shares, (std::vector<double>{0.4, 0.8, 1}));
}

TEST(WriteSamples, LeavesNothingWhereARunFails) {
  const TempFolder folder;
  const absl::Status status =
      WriteSamples(folder / "samples.bin", "head", 3, 1,
                   [](size_t run, std::string*) {
                     return run == 1 ? absl::CancelledError("was stopped") : absl::OkStatus();
                   },
                   {});
  EXPECT_TRUE(absl::IsCancelled(status));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(WriteSamples, NamesAFileThatCanNotBeWritten) {
  const absl::Status status = WriteSamples("/nowhere/samples.bin", "head", 0, 1,
                                           [](size_t, std::string*) { return absl::OkStatus(); }, {});
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_NE(status.message().find("/nowhere/samples.bin"), std::string_view::npos);
}

}  // namespace
}  // namespace weft

#include "services/server/catalogue/job_records.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::UnorderedElementsAre;

class JobRecordsTest : public ::testing::Test {
 protected:
  static v1::JobUpdate Record(const std::string& id) {
    v1::Job job;
    job.set_id(id);
    job.add_warnings("c\xff.png");
    v1::FrameInfo info;
    info.set_frame("0007");
    return RecordOf(job, {info, {}});
  }

  const TempFolder folder_;
  const JobRecords records_{folder_ / "catalogue.sqlite"};
};

TEST_F(JobRecordsTest, AreReadAsTheyWereWritten) {
  EXPECT_TRUE(records_.JobIds().empty());
  ASSERT_TRUE(records_.Write(Record("a")).ok());
  ASSERT_TRUE(records_.Write(Record("b")).ok());
  WriteBytes(records_.PathOf("c.tmp.1.1"), "of a writer that was killed");
  EXPECT_THAT(records_.JobIds(), UnorderedElementsAre("a", "b"));
  const auto read = records_.Read("b");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->job().id(), "b");
  EXPECT_EQ(read->job().warnings(0), "c\\xff.png");
  ASSERT_EQ(read->frames_size(), 2);
  EXPECT_EQ(read->frames(0).frame(), "0007");
  ASSERT_TRUE(records_.Remove("b").ok());
  ASSERT_TRUE(records_.Remove("b").ok());
  EXPECT_EQ(records_.Read("b").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobRecordsTest, TellDamage) {
  ASSERT_TRUE(records_.Write(Record("a")).ok());
  const std::string whole = ReadBytes(records_.PathOf("a"));
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] ^= 1;
    WriteBytes(records_.PathOf("a"), damaged);
    EXPECT_EQ(records_.Read("a").status().code(), absl::StatusCode::kDataLoss) << at;
  }
  WriteBytes(records_.PathOf("a"), whole.substr(0, 5));
  EXPECT_EQ(records_.Read("a").status().code(), absl::StatusCode::kDataLoss);
  WriteBytes(records_.PathOf("other"), whole);
  EXPECT_EQ(records_.Read("other").status().code(), absl::StatusCode::kDataLoss) << "it is of job a";
}

}  // namespace
}  // namespace weft

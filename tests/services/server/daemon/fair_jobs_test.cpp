// How callers share places in the queue of jobs, and its workers; and lists in pages.
#include <algorithm>

#include "tests/services/server/daemon/callers_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FairJobsTest : public CallersTest {
 protected:
  std::string SubmittedBy(const std::string& file, const std::vector<std::string>& frames,
                          const std::string& out, int priority = 0) {
    v1::SubmitJobRequest request = MakeRequest(frames, out);
    request.set_priority(priority);
    v1::Job job;
    const grpc::Status status = SubmitAs(file, request, &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return job.id();
  }
  // The names of `outs` in the order in which their jobs began, once all have ended.
  std::vector<std::string> OrderOf(const std::map<std::string, std::string>& id_of_out) {
    std::vector<std::pair<int64_t, std::string>> began;
    for (const auto& [out, id] : id_of_out) began.emplace_back(WaitForEnd(id).started_unix_ns(), out);
    std::sort(began.begin(), began.end());
    std::vector<std::string> order;
    for (const auto& [time, out] : began) order.push_back(out);
    return order;
  }
  static int PlaceIn(const std::vector<std::string>& order, const std::string& out) {
    return static_cast<int>(std::find(order.begin(), order.end(), out) - order.begin());
  }
};

TEST_F(FairJobsTest, CallersTakeTurnsAtTheWorkers) {
  StartDaemon();
  std::map<std::string, std::string> ids;
  for (const char* out : {"greedy1", "greedy2", "greedy3", "greedy4"})
    ids[out] = SubmittedBy("ben", {"slow"}, out);
  for (const char* out : {"modest1", "modest2"}) ids[out] = SubmittedBy("anna", {"slow"}, out);
  // By the time that each was served, which differs a little.
  const std::vector<std::string> order = OrderOf(ids);
  EXPECT_EQ(order[0], "greedy1");
  EXPECT_EQ(order[1], "modest1");
  EXPECT_LE(PlaceIn(order, "modest2"), 3);
}

TEST_F(FairJobsTest, PriorityGoesBeforeTurnsAndClientsHaveNoHighOne) {
  StartDaemon();
  std::map<std::string, std::string> ids;
  ids["first"] = SubmittedBy("anna", {"slow"}, "first");
  ids["pushy"] = SubmittedBy("ben", {"slow"}, "pushy", 100);
  ids["pushy2"] = SubmittedBy("ben", {"slow"}, "pushy2", 10);
  ids["later"] = SubmittedBy("ben", {"slow"}, "later", -1);
  ids["last"] = SubmittedBy("anna", {"slow"}, "last", -50);
  ids["second"] = SubmittedBy("anna", {"slow"}, "second");
  ids["urgent"] = SubmittedBy("stage", {"slow"}, "urgent", 50);
  const v1::Job pushy = *client_->Get(ids["pushy"]);
  EXPECT_EQ(pushy.priority(), 10);
  EXPECT_THAT(std::vector<std::string>(pushy.warnings().begin(), pushy.warnings().end()),
              ::testing::Contains(HasSubstr("priority 100 became 10")));
  const std::vector<std::string> order = OrderOf(ids);
  EXPECT_THAT(std::vector<std::string>(order.begin(), order.begin() + 3),
              ElementsAre("first", "urgent", "pushy"));
  EXPECT_LE(PlaceIn(order, "second"), 4);
  EXPECT_LT(PlaceIn(order, "pushy2"), PlaceIn(order, "later"));
  EXPECT_EQ(order.back(), "last");
}

TEST_F(FairJobsTest, OneCallerLeavesPlacesAndOperatorsHaveMore) {
  options_.caller_limits.jobs = 5;
  StartDaemon();
  v1::Job job;
  for (int i = 0; i < 5; ++i)
    SubmittedBy(i % 2 == 0 ? "anna" : "anna-too", {"hang"}, "of_anna" + std::to_string(i));
  const grpc::Status refused = SubmitAs("anna", MakeRequest({"a"}, "one_more"), &job);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("has 5 unfinished jobs, the most of one caller"));
  SubmittedBy("ben", {"hang"}, "of_ben");
  SubmittedBy("stage", {"hang"}, "of_stage");
  const std::vector<v1::Job> jobs = client_->List(100).value();
  for (const v1::Job& each : jobs) EXPECT_TRUE(CancelAs("stage", each.id()).ok());
}

TEST_F(FairJobsTest, ListsComeInPages) {
  StartDaemon();
  std::vector<std::string> ids;  // newest first
  for (int i = 0; i < 5; ++i)
    ids.insert(ids.begin(), SubmittedBy("anna", {"a", "b", "c"}, "out" + std::to_string(i)));
  for (const std::string& id : ids) WaitForEnd(id);
  const auto stub = JobsOf("anna");
  v1::ListJobsRequest request;
  request.set_limit(2);
  std::vector<std::string> listed;
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListJobsResponse page;
    ASSERT_TRUE(stub->ListJobs(&context, request, &page).ok());
    for (const v1::Job& job : page.jobs()) listed.push_back(job.id());
    request.set_page_token(page.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, ids);
  EXPECT_EQ(pages, 3);
  request.set_page_token("no-such-job");
  {
    grpc::ClientContext context;
    v1::ListJobsResponse page;
    EXPECT_EQ(stub->ListJobs(&context, request, &page).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  v1::ListFramesRequest frames;
  frames.set_job_id(ids[0]);
  frames.set_limit(2);
  v1::ListFramesResponse first, second;
  grpc::ClientContext one, two;
  ASSERT_TRUE(stub->ListFrames(&one, frames, &first).ok());
  frames.set_page_token(first.next_page_token());
  ASSERT_TRUE(stub->ListFrames(&two, frames, &second).ok());
  ASSERT_EQ(first.frames_size(), 2);
  ASSERT_EQ(second.frames_size(), 1);
  EXPECT_EQ(second.frames(0).frame(), "c");
  EXPECT_EQ(second.next_page_token(), "");
  // Our own client puts pages together.
  EXPECT_EQ(client_->List(1000)->size(), 5U);
}

}  // namespace
}  // namespace weft

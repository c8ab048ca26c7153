// What the service Jobs answers beside the queue: pages, kinds of work, and words for people.
#include "services/server/daemon/work/job_service.h"

#include <grpcpp/grpcpp.h>

#include "services/work/spec/kind_info.h"
#include "tests/services/server/daemon/callers_fixture.h"

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JobServiceTest : public CallersTest {
 protected:
  // What a call of the test's user is answered, beside its status.
  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::Jobs::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    v1::Jobs::Stub stub(client_->channel());
    grpc::ClientContext context;
    return (stub.*method)(&context, request, response);
  }
};

TEST_F(JobServiceTest, PagesAreNamedByTheOnesBefore) {
  WriteBytes(folder_ / "state/results/bare/note", "of a job that nobody knows");
  StartDaemon();
  const std::string first = Submit({"a", "b", "c"}, "one"), second = Submit({"a"}, "two");
  WaitForEnd(first);
  WaitForEnd(second);
  v1::ListFramesRequest frames;
  frames.set_job_id(first);
  frames.set_page_token("1");
  v1::ListFramesResponse some;
  ASSERT_TRUE(Call(&v1::Jobs::Stub::ListFrames, frames, &some).ok());
  ASSERT_EQ(some.frames_size(), 2);
  EXPECT_EQ(some.frames(0).frame(), "b");
  EXPECT_EQ(some.next_page_token(), "");
  frames.clear_page_token();
  frames.set_limit(3);
  ASSERT_TRUE(Call(&v1::Jobs::Stub::ListFrames, frames, &some).ok());
  EXPECT_EQ(some.frames_size(), 3);
  EXPECT_EQ(some.next_page_token(), "") << "there is no fourth";
  frames.set_page_token("x");
  EXPECT_EQ(Call(&v1::Jobs::Stub::ListFrames, frames, &some).error_message(),
            "page_token: is none; give next_page_token of the page before");
  frames.clear_page_token();
  frames.set_limit(-1);
  EXPECT_EQ(Call(&v1::Jobs::Stub::ListFrames, frames, &some).error_message(),
            "limit: -1 is negative; give 0 for all");
  frames.set_job_id("");
  EXPECT_EQ(Call(&v1::Jobs::Stub::ListFrames, frames, &some).error_message(), "job_id: must not be empty");
  v1::ListJobsRequest jobs;
  jobs.set_limit(1);
  v1::ListJobsResponse page;
  ASSERT_TRUE(Call(&v1::Jobs::Stub::ListJobs, jobs, &page).ok());
  ASSERT_EQ(page.jobs_size(), 1);
  EXPECT_EQ(page.jobs(0).id(), second);
  EXPECT_EQ(page.next_page_token(), second);
  EXPECT_THAT(page.warnings(),
              ElementsAre(HasSubstr("holds results of jobs that are not in the list: bare")));
  jobs.set_page_token(page.next_page_token());
  ASSERT_TRUE(Call(&v1::Jobs::Stub::ListJobs, jobs, &page).ok());
  EXPECT_EQ(page.jobs(0).id(), first);
  EXPECT_EQ(page.next_page_token(), "");
  EXPECT_THAT(page.warnings(), IsEmpty()) << "on the first page alone";
  jobs.set_page_token("gone");
  EXPECT_EQ(Call(&v1::Jobs::Stub::ListJobs, jobs, &page).error_message(),
            "page_token: names a job that is gone; begin with the first page");
}

TEST_F(JobServiceTest, NamesAllKindsOfWork) {
  StartDaemon();
  v1::ListWorkKindsResponse response;
  ASSERT_TRUE(Call(&v1::Jobs::Stub::ListWorkKinds, v1::ListWorkKindsRequest(), &response).ok());
  std::vector<std::string> names;
  for (const v1::WorkKindInfo& kind : response.kinds()) names.push_back(kind.name());
  EXPECT_EQ(names.size(), AllKindInfos().size());
  for (const char* name : {"register", "drive", "evaluate", "take trim"}) EXPECT_THAT(names, Contains(name));
}

TEST_F(JobServiceTest, SaysWhatBecameOfAPriorityAndOfAFrame) {
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  request.set_priority(100);
  v1::Job job;
  ASSERT_TRUE(SubmitAs("anna", request, &job).ok());
  EXPECT_EQ(job.priority(), 10);
  EXPECT_THAT(job.warnings(),
              Contains("priority 100 became 10: higher ones are for operators, who may raise it"));
  WaitForEnd(job.id());
  EXPECT_EQ(client_->Fetch(job.id(), "b", v1::RESULT_KIND_MESH, folder_ / "mesh.ply").message(),
            absl::StrCat("job ", job.id(), " has no frame \"b\""));
  v1::SetJobPriorityRequest priority;
  priority.set_job_id(job.id());
  priority.set_priority(101);
  EXPECT_EQ(Call(&v1::Jobs::Stub::SetJobPriority, priority, &job).error_message(),
            "priority: 101 is out of range; give -100 to 100");
}

}  // namespace
}  // namespace weft

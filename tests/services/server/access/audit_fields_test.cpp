#include "services/server/access/audit_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "weft/v1/jobs.pb.h"
#include "weft/v1/sessions.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {
namespace {

using ::testing::Pair;
using ::testing::UnorderedElementsAre;

TEST(AuditFields, TellWhatARequestIsAbout) {
  v1::SubmitJobRequest request;
  request.mutable_spec()->set_dump("/takes/a");
  request.mutable_spec()->mutable_driving()->add_cameras("left");
  request.mutable_spec()->mutable_driving()->add_cameras("right");
  request.set_priority(-3);
  v1::AuditEntry entry;
  DescribeRequest(request, entry);
  EXPECT_THAT(entry.about(),
              UnorderedElementsAre(Pair("spec.dump", "/takes/a"), Pair("spec.driving.cameras.0", "left"),
                                   Pair("spec.driving.cameras.1", "right"), Pair("priority", "-3")));
}

TEST(AuditFields, LeaveSecretsOut) {
  v1::StartTakeRequest request;
  request.set_lease("kept to oneself");
  v1::AuditEntry entry;
  DescribeRequest(request, entry);
  EXPECT_TRUE(entry.about().empty());
}

TEST(AuditFields, AreCutEscapedAndFew) {
  v1::SubmitJobRequest request;
  request.set_out_probe(std::string(300, 'x'));
  request.mutable_spec()->set_rig("a\nb");
  for (int i = 0; i < 9; ++i) request.mutable_spec()->mutable_driving()->add_cameras("c");
  v1::AuditEntry entry;
  DescribeRequest(request, entry);
  EXPECT_EQ(entry.about().at("out_probe"), std::string(200, 'x'));
  EXPECT_EQ(entry.about().at("spec.rig"), "a\\x0ab");
  EXPECT_TRUE(entry.about().contains("spec.driving.cameras.3"));
  EXPECT_FALSE(entry.about().contains("spec.driving.cameras.4"));
}

TEST(AuditFields, OfAnAnswerAreItsIds) {
  v1::Job job;
  job.set_id("20260101-1");
  job.set_message("waits");
  v1::AuditEntry entry;
  DescribeAnswer(job, entry);
  EXPECT_THAT(entry.about(), UnorderedElementsAre(Pair("id", "20260101-1")));
}

}  // namespace
}  // namespace weft

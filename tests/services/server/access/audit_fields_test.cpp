#include "services/server/access/audit_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <google/protobuf/struct.pb.h>

#include <string>

#include "weft/v1/jobs.pb.h"
#include "weft/v1/library_item.pb.h"
#include "weft/v1/retention.pb.h"
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

TEST(AuditFields, AreOfAllKindsThatPeopleRead) {
  v1::RetentionRules rules;
  rules.set_keep_takes_days(1.5);
  v1::RecordedTake take;
  take.set_recorder_lives(true);
  v1::LibraryItem item;
  item.set_kind(v1::ITEM_KIND_RIG);
  item.set_bytes(7);  // numbers of 64 bits are times and sizes
  v1::AuditEntry entry;
  for (const google::protobuf::Message* message : {static_cast<const google::protobuf::Message*>(&rules),
                                                   static_cast<const google::protobuf::Message*>(&take),
                                                   static_cast<const google::protobuf::Message*>(&item)})
    DescribeRequest(*message, entry);
  EXPECT_THAT(entry.about(),
              UnorderedElementsAre(Pair("keep_takes_days", "1.5"), Pair("recorder_lives", "true"),
                                   Pair("kind", "ITEM_KIND_RIG")));
}

TEST(AuditFields, AreFourMessagesDeepAndSixteen) {
  google::protobuf::Struct inner, outer;
  (*inner.mutable_fields())["b"].set_string_value("too deep");
  *(*outer.mutable_fields())["a"].mutable_struct_value() = inner;
  v1::AuditEntry entry;
  DescribeRequest(outer, entry);
  EXPECT_THAT(entry.about(), UnorderedElementsAre(Pair("fields.0.key", "a"),
                                                  Pair("fields.0.value.struct_value.fields.0.key", "b")));
  v1::JobUpdate many;
  for (int i = 0; i < 4; ++i) {
    v1::FrameInfo& info = *many.add_frames();
    info.set_frame("f"), info.set_reason("r"), info.set_attempts(1), info.set_state(v1::FRAME_STATE_DONE);
  }
  many.mutable_job()->set_id("j");
  v1::AuditEntry full;
  DescribeRequest(many, full);
  EXPECT_EQ(full.about_size(), 16);
}

TEST(AuditFields, OfAnAnswerAreAllItsIds) {
  v1::RecordedTake take;
  take.set_id("t");
  take.set_folder("/takes/t");
  take.set_session_id("s\n");
  take.set_live_job_id(std::string(201, 'j'));
  v1::AuditEntry entry;
  DescribeAnswer(take, entry);
  EXPECT_THAT(entry.about(), UnorderedElementsAre(Pair("id", "t"), Pair("session_id", "s\\x0a"),
                                                  Pair("live_job_id", std::string(200, 'j'))));
}

}  // namespace
}  // namespace weft

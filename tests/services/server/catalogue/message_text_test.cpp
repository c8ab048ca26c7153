#include "services/server/catalogue/message_text.h"

#include <gtest/gtest.h>

#include "weft/v1/job.pb.h"

namespace weft {
namespace {

TEST(MessageText, IsEscapedWhereItIsNotUtf8) {
  v1::Job job;
  job.set_id("a");
  job.set_message("Jacke \xfc");
  job.mutable_spec()->set_dump("/takes/\xff");
  job.add_warnings("gut");
  job.add_warnings("\xc3\xa4 \xc3");
  EscapeTexts(job);
  EXPECT_EQ(job.id(), "a");
  EXPECT_EQ(job.message(), "Jacke \\xfc");
  EXPECT_EQ(job.spec().dump(), "/takes/\\xff");
  EXPECT_EQ(job.warnings(0), "gut");
  // A letter of UTF-8 stays; the half of one does not.
  EXPECT_EQ(job.warnings(1), "\xc3\xa4 \\xc3");
}

// Bytes by hand, since protobuf writes no such text: field 1 of Job, "id".
TEST(MessageText, IsReadWhereProtobufReadsNone) {
  v1::Job known;
  known.set_id("xy");
  std::string bytes = known.SerializeAsString();
  ASSERT_EQ(bytes.substr(bytes.size() - 2), "xy");
  bytes.back() = '\xff';
  v1::Job job;
  ASSERT_TRUE(ParseWithEscapes(bytes, job));
  EXPECT_EQ(job.id(), "x\\xff");
}

TEST(MessageText, IsReadInMessagesOfMessages) {
  v1::Job known;
  known.mutable_spec()->set_dump("xy");
  std::string bytes = known.SerializeAsString();
  ASSERT_EQ(bytes.substr(bytes.size() - 2), "xy");
  bytes.back() = '\xff';
  v1::Job job;
  ASSERT_TRUE(ParseWithEscapes(bytes, job));
  EXPECT_EQ(job.spec().dump(), "x\\xff");
}

TEST(MessageText, OfWhatIsNoMessageIsNone) {
  v1::Job job;
  EXPECT_FALSE(ParseWithEscapes("\x0a\x7fshort", job));
  EXPECT_TRUE(ParseWithEscapes("", job));
}

}  // namespace
}  // namespace weft

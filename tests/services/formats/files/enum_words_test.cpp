#include "services/formats/files/enum_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "weft/v1/job.pb.h"
#include "weft/v1/sessions.pb.h"

namespace weft {
namespace {

TEST(EnumWord, IsTheNameWithoutWhatAllBeginWith) {
  EXPECT_STREQ(EnumWord(v1::JOB_STATE_QUEUED, "unknown"), "queued");
  EXPECT_STREQ(EnumWord(v1::JOB_STATE_CANCELLED, "unknown"), "cancelled");
  EXPECT_STREQ(EnumWord(v1::CAPTURE_SESSION_STATE_TAKEN_OVER, "closed"), "taken over");
}

TEST(EnumWord, IsAnotherOfWhatTheSchemaDoesNotName) {
  EXPECT_STREQ(EnumWord(v1::JOB_STATE_UNSPECIFIED, "unknown"), "unknown");
  EXPECT_STREQ(EnumWord(static_cast<v1::JobState>(99), "unknown"), "unknown");
}

}  // namespace
}  // namespace weft

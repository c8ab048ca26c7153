// What one caller may ask for, on a clock that stands until it is moved.
#include "services/server/access/call_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class CallLimitsTest : public ::testing::Test {
 protected:
  static CallerLimits Few() {
    CallerLimits limits;
    limits.calls_per_s = 10;
    limits.burst = 20;
    limits.unary = 3;
    limits.streams = 2;
    limits.uploads = 1;
    return limits;
  }
  // Admitted, begun and ended.
  absl::Status Call(const std::string& caller) {
    absl::Status status = limits_.Admit(caller, CallKind::kUnary);
    if (!status.ok()) return status;
    limits_.Begin(caller, CallKind::kUnary);
    limits_.End(caller, CallKind::kUnary);
    return status;
  }
  int AdmittedOf(const std::string& caller, int calls) {
    int admitted = 0;
    for (int i = 0; i < calls; ++i) admitted += Call(caller).ok() ? 1 : 0;
    return admitted;
  }

  CallLimits::Time now_{seconds(1000)};
  CallLimits limits_{Few(), [this] { return now_; }};
};

TEST_F(CallLimitsTest, AreABurstAndThenARate) {
  EXPECT_EQ(AdmittedOf("anna", 100), 20);
  now_ += seconds(1);
  EXPECT_EQ(AdmittedOf("anna", 100), 10);
  now_ += std::chrono::hours(1);
  EXPECT_EQ(AdmittedOf("anna", 100), 20);
}

TEST_F(CallLimitsTest, SayWhenToComeAgainAndKeepTheWord) {
  AdmittedOf("anna", 20);
  for (int i = 0; i < 50; ++i) {
    const absl::Status refused = Call("anna");
    ASSERT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
    const auto pause = RetryAfter(std::string(refused.message()));
    ASSERT_TRUE(pause.has_value()) << refused;
    now_ += *pause;
    EXPECT_TRUE(Call("anna").ok());
  }
}

TEST_F(CallLimitsTest, AreEveryCallersOwn) {
  EXPECT_EQ(AdmittedOf("anna", 100), 20);
  EXPECT_EQ(AdmittedOf("bert", 100), 20);
}

TEST_F(CallLimitsTest, HoldForCallsAtOnceByKind) {
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kStream).ok());
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kStream).ok());
  // Neither has begun.
  const absl::Status third = limits_.Admit("anna", CallKind::kStream);
  EXPECT_EQ(third.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(third.message()), ::testing::HasSubstr("anna has 2 streams open"));
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUnary).ok());
  limits_.Begin("anna", CallKind::kStream);
  EXPECT_FALSE(limits_.Admit("anna", CallKind::kStream).ok());
  limits_.End("anna", CallKind::kStream);
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kStream).ok());
}

TEST_F(CallLimitsTest, ForgetCallsThatNeverBegin) {
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
  now_ += seconds(9);
  EXPECT_FALSE(limits_.Admit("anna", CallKind::kUpload).ok());
  now_ += seconds(2);
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
}

TEST_F(CallLimitsTest, KeepCallsThatRunForLong) {
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
  limits_.Begin("anna", CallKind::kUpload);
  now_ += std::chrono::hours(10);
  EXPECT_FALSE(limits_.Admit("anna", CallKind::kUpload).ok());
  EXPECT_EQ(limits_.Running(CallKind::kUpload), 1);
}

TEST(CallLimitsOfAllTest, ManyCallersLeaveRoomForTheNextAndForOperators) {
  CallerLimits few;
  few.unary = 6;
  few.all_unary = 20;
  few.reserved_unary = 4;
  CallLimits limits(few);
  const auto open = [&](const std::string& caller, v1::Role role = v1::ROLE_CLIENT) {
    int admitted = 0;
    while (admitted < 100 && limits.Admit(caller, CallKind::kUnary, role).ok()) {
      limits.Begin(caller, CallKind::kUnary);
      ++admitted;
    }
    return admitted;
  };
  EXPECT_EQ(open("a"), 5);  // half of the 11 that stay free
  for (const char* next : {"b", "c", "d", "e"}) EXPECT_GE(open(next), 1) << next;
  for (int i = 0; i < 30; ++i) open("more" + std::to_string(i));
  EXPECT_EQ(limits.Running(CallKind::kUnary), 16);
  EXPECT_EQ(open("new"), 0);
  EXPECT_GE(open("stage", v1::ROLE_OPERATOR), 1);
  // The operator's has a place of the reserve.
  for (int i = 0; i < 2; ++i) limits.End("a", CallKind::kUnary);
  EXPECT_EQ(open("new"), 1);
}

TEST_F(CallLimitsTest, ChargeRefusalsWithoutKeepingThemOpen) {
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(limits_.Charge("anna").ok());
  EXPECT_FALSE(limits_.Charge("anna").ok());
  now_ += seconds(1);
  EXPECT_EQ(AdmittedOf("anna", 3), 3);
}

TEST_F(CallLimitsTest, SayWhatIsOpen) {
  const auto refused = [this](CallKind kind) {
    absl::Status status;
    while (status.ok()) status = limits_.Admit("anna", kind);
    return status;
  };
  EXPECT_EQ(refused(CallKind::kUnary),
            absl::ResourceExhaustedError("anna has 3 calls open, the most at once; retry after 100 ms"));
  EXPECT_EQ(refused(CallKind::kStream),
            absl::ResourceExhaustedError("anna has 2 streams open, the most at once; retry after 1000 ms"));
  EXPECT_EQ(refused(CallKind::kUpload),
            absl::ResourceExhaustedError("anna has 1 uploads open, the most at once; retry after 1000 ms"));
  for (int i = 0; i < 20; ++i) (void)limits_.Charge("bert");
  now_ += milliseconds(40);
  EXPECT_EQ(limits_.Charge("bert"),
            absl::ResourceExhaustedError("bert makes more than 10 calls per second; retry after 60 ms"));
}

TEST_F(CallLimitsTest, ForgetNobodyWhoHasSomethingOpen) {
  ASSERT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
  limits_.Begin("anna", CallKind::kUpload);
  AdmittedOf("bert", 20);
  now_ += seconds(61);
  EXPECT_TRUE(limits_.Charge("carl").ok());  // looks who may be forgotten
  EXPECT_FALSE(limits_.Admit("anna", CallKind::kUpload).ok());
  limits_.End("anna", CallKind::kUpload);
  EXPECT_EQ(limits_.Running(CallKind::kUpload), 0);
  EXPECT_TRUE(limits_.Admit("anna", CallKind::kUpload).ok());
}

TEST(CallLimitsOfAllTest, SayWhomTheRestIsFor) {
  CallerLimits few;
  few.streams = 6, few.all_streams = 8, few.reserved_streams = 2, few.burst = 100;
  CallLimits limits(few);
  EXPECT_TRUE(limits.Admit("a", CallKind::kStream).ok());
  EXPECT_TRUE(limits.Admit("a", CallKind::kStream).ok());
  EXPECT_EQ(
      limits.Admit("a", CallKind::kStream),
      absl::ResourceExhaustedError("a has 2 streams open, and all callers together 2 of 8: the rest is for "
                                   "others; retry after 1000 ms"));
  for (const char* name : {"b", "c", "d", "e"})
    EXPECT_TRUE(limits.Admit(name, CallKind::kStream).ok()) << name;
  EXPECT_EQ(
      limits.Admit("f", CallKind::kStream),
      absl::ResourceExhaustedError("f has 0 streams open, and all callers together 6 of 8: the rest is for "
                                   "operators; retry after 1000 ms"));
  EXPECT_TRUE(limits.Admit("stage", CallKind::kStream, v1::ROLE_OPERATOR).ok());
}

TEST(CallerLimitsTest, AreForAStudio) {
  const CallerLimits limits;
  EXPECT_EQ(limits.Of(CallKind::kUnary), 24);
  EXPECT_EQ(limits.Of(CallKind::kStream), 300);
  EXPECT_EQ(limits.Of(CallKind::kUpload), 8);
}

}  // namespace
}  // namespace weft

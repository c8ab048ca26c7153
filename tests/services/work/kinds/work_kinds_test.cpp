#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::RegistrationSpec Registering() {
  v1::RegistrationSpec spec;
  spec.set_dump("/takes/t");
  spec.set_rig("/inputs/rig.json");
  spec.set_board("/inputs/board.json");
  spec.set_garment("/inputs/shirt");
  spec.set_out("/results/t");
  return spec;
}

v1::RegistrationSpec WithAvatar() {
  v1::RegistrationSpec spec = Registering();
  spec.mutable_driving()->set_avatar("/inputs/shirt.avatar");
  return spec;
}

TEST(KindOf, IsThatOfTheJob) {
  EXPECT_EQ(KindOf(Registering()).name(), "register");
  EXPECT_EQ(KindOf(WithAvatar()).name(), "drive");
  v1::RegistrationSpec without_avatar = Registering();
  without_avatar.mutable_driving();
  EXPECT_EQ(KindOf(without_avatar).name(), "drive");
}

TEST(WorkKind, FramesOfAnAvatarFollowEachOther) {
  EXPECT_EQ(KindOf(Registering()).order(), WorkKind::Order::kApart);
  EXPECT_EQ(KindOf(WithAvatar()).order(), WorkKind::Order::kInSequence);
  EXPECT_FALSE(KindOf(WithAvatar()).is_refined_later());
}

TEST(WorkKind, FindsFaultsOfItsOwnFields) {
  EXPECT_FALSE(KindOf(Registering()).FaultOf(Registering()));
  EXPECT_FALSE(KindOf(WithAvatar()).FaultOf(WithAvatar()));
  const auto field_of = [](const v1::RegistrationSpec& spec) {
    const auto fault = KindOf(spec).FaultOf(spec);
    return fault ? fault->field : "";
  };
  v1::RegistrationSpec spec = WithAvatar();
  for (const double fps : {-1.0, std::nan(""), double{INFINITY}}) {
    spec = WithAvatar();
    spec.mutable_driving()->set_fps(fps);
    EXPECT_EQ(field_of(spec), "spec.driving.fps") << fps;
  }
  spec = WithAvatar();
  spec.set_live_every(1);
  EXPECT_EQ(field_of(spec), "");
  spec.set_live_every(2);
  EXPECT_EQ(field_of(spec), "spec.live_every");
  for (const bool scans : {true, false}) {
    spec = WithAvatar();
    (scans ? spec.mutable_options()->mutable_scans() : spec.mutable_options()->mutable_starts())
        ->assign("/s");
    EXPECT_EQ(field_of(spec), "spec.options");
  }
  spec = WithAvatar();
  for (int i = 0; i < 1000; ++i) spec.mutable_driving()->add_cameras("c");
  EXPECT_EQ(field_of(spec), "");
  spec.mutable_driving()->add_cameras("c");
  EXPECT_EQ(field_of(spec), "spec.driving.cameras");
}

TEST(WorkKind, DrivingTakesOptionsOfDecodingAlone) {
  v1::RegistrationOptions asked;
  const auto registering = KindOf(Registering()).Effective(asked),
             driving = KindOf(WithAvatar()).Effective(asked);
  ASSERT_TRUE(registering.ok() && driving.ok());
  EXPECT_TRUE(registering->pipeline().has_alignment());
  EXPECT_FALSE(driving->pipeline().has_alignment());
  EXPECT_TRUE(driving->pipeline().has_decode());
  asked.set_preset("fastest");
  EXPECT_EQ(KindOf(WithAvatar()).Effective(asked).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ListInputs, NamesWhatIsMissing) {
  for (v1::RegistrationSpec spec : {Registering(), WithAvatar()}) {
    EXPECT_EQ(ListInputs(spec).status().code(), absl::StatusCode::kNotFound);
    EXPECT_THAT(std::string(ListInputs(spec).status().message()), HasSubstr("/inputs/rig.json"));
    spec.clear_board();
    EXPECT_THAT(std::string(ListInputs(spec).status().message()), HasSubstr("spec.board is empty"));
  }
  v1::RegistrationSpec without_avatar = Registering();
  without_avatar.mutable_driving();
  EXPECT_THAT(std::string(ListInputs(without_avatar).status().message()),
              HasSubstr("spec.driving.avatar is empty: name the avatar"));
}

TEST(WorkKind, SaysWhatItsFramesAre) {
  const WorkKind& registering = KindOf(Registering());
  EXPECT_TRUE(registering.is_refined_later());
  EXPECT_TRUE(registering.has_coverage());
  EXPECT_EQ(registering.done_word(), "registered");
  const WorkKind& driving = KindOf(WithAvatar());
  EXPECT_FALSE(driving.has_coverage());
  EXPECT_EQ(driving.done_word(), "driven");
}

TEST(WorkKind, UnknownOnesDoNothing) {
  v1::Job job;
  job.mutable_spec()->mutable_work()->set_kind("kn\tit");
  const WorkKind& kind = KindOf(job.spec());
  EXPECT_EQ(kind.done_word(), "done");
  EXPECT_EQ(kind.order(), WorkKind::Order::kInSequence);
  EXPECT_FALSE(kind.is_refined_later());
  EXPECT_FALSE(kind.has_coverage());
  v1::RegistrationOptions asked;
  asked.set_preset("fastest");
  ASSERT_TRUE(kind.Effective(asked).ok());
  EXPECT_EQ(kind.Effective(asked)->preset(), "fastest");
  const absl::Status why =
      absl::UnimplementedError("spec.work.kind: \"kn\\x09it\" is none that this version of Weft does");
  EXPECT_EQ(kind.Load(job.spec(), WorkKind::LoadFor::kTask).status(), why);
  EXPECT_EQ(kind.FindIncomplete(job, {}).status(), why);
  const auto fault = kind.FaultOf(job.spec());
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->why, "\"kn\\x09it\" is none that a daemon runs");
}

}  // namespace
}  // namespace weft

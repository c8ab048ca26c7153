#include "services/work/kinds/take_kinds.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace weft {
namespace {

std::string FieldAtFault(const v1::RegistrationSpec& spec) {
  const auto fault = DriveKind().FaultOf(spec);
  return fault ? fault->field : "";
}

TEST(DriveKind, FaultsNameTheField) {
  v1::RegistrationSpec spec;
  spec.mutable_driving()->set_avatar("/avatars/shirt");
  EXPECT_EQ(FieldAtFault(spec), "");
  spec.set_live_every(2);
  EXPECT_EQ(FieldAtFault(spec), "spec.live_every");
  spec.set_live_every(1);
  spec.mutable_options()->set_scans("/scans");
  EXPECT_EQ(FieldAtFault(spec), "spec.options");
  spec.mutable_driving()->set_fps(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(FieldAtFault(spec), "spec.driving.fps");
}

std::string FaultText(const v1::RegistrationSpec& spec) {
  const auto fault = DriveKind().FaultOf(spec);
  return fault ? fault->field + " " + fault->why + "; " + fault->remedy : "";
}

TEST(DriveKind, FaultsSayWhatToDo) {
  v1::RegistrationSpec spec;
  spec.mutable_driving()->set_avatar("/avatars/shirt");
  for (int i = 0; i < 1001; ++i) spec.mutable_driving()->add_cameras("c");
  EXPECT_EQ(FaultText(spec), "spec.driving.cameras names 1001 cameras; at most 1000 are allowed");
  spec.mutable_driving()->clear_cameras();
  spec.mutable_driving()->set_fps(-1);
  EXPECT_EQ(FaultText(spec), "spec.driving.fps is no number of frames per second; give 0 for the avatar's");
  spec.mutable_driving()->set_fps(0);
  EXPECT_EQ(FaultText(spec), "");
  spec.mutable_driving()->set_fps(1e-3);
  spec.set_live_every(3);
  EXPECT_EQ(FaultText(spec),
            "spec.live_every is 3 with spec.driving; give 1: every frame is driven from the one before");
  spec.set_live_every(0);
  spec.mutable_options()->set_starts("/starts");
  EXPECT_EQ(FaultText(spec), "spec.options names scans or starts; an avatar needs neither; leave them out");
}

}  // namespace
}  // namespace weft

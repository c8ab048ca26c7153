#include "services/work/kinds/take_kinds.h"

#include <gtest/gtest.h>

#include <limits>

namespace weft {
namespace {

std::string FieldAtFault(const v1::RegistrationSpec& spec) {
  const auto fault = DriveKind().FaultOf(spec);
  return fault ? fault->field : "";
}

TEST(DriveKind, FaultsNameTheField) {
  v1::RegistrationSpec spec;
  EXPECT_EQ(FieldAtFault(spec), "spec.driving.avatar");
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

}  // namespace
}  // namespace weft

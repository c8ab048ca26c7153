#include "services/work/animation/drive_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulation/studio_rig.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(CamerasNamed, KeepsTheOrderOfTheRig) {
  StudioRigOptions options;
  options.cameras = 4;
  const Rig rig = *MakeStudioRig("studio", options);
  const auto two = CamerasNamed(rig, {"c03", "c01"}, "rig.json");
  ASSERT_TRUE(two.ok()) << two.status();
  ASSERT_EQ(two->cameras.size(), 2u);
  EXPECT_EQ(two->cameras[0].id, "c01");
  EXPECT_EQ(two->cameras[1].id, "c03");
  EXPECT_EQ(CamerasNamed(rig, {}, "rig.json")->cameras.size(), 4u);
  EXPECT_THAT(std::string(CamerasNamed(rig, {"c01", "front"}, "rig.json").status().message()),
              AllOf(HasSubstr("rig.json has no camera \"front\""), HasSubstr("c00, c01, c02, c03")));
  EXPECT_THAT(std::string(CamerasNamed(rig, {"c01", "c01"}, "rig.json").status().message()),
              HasSubstr("twice"));
}

TEST(LoadDriveInputs, NamesWhatIsEmpty) {
  v1::RegistrationSpec spec;
  spec.set_dump("take");
  EXPECT_THAT(std::string(LoadDriveInputs(spec).status().message()), HasSubstr("spec.rig is empty"));
}

}  // namespace
}  // namespace weft

// weft rig plan.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_format.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "simulation/cloth.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "weft/v1/rig_plan.pb.h"

namespace weft {
namespace {

// A tube in a ring of cameras.
TEST(CommandRigPlan, ChoosesCamerasAndTellsWhatTheyCover) {
  unsetenv("WEFT_SERVER");
  const TempFolder folder;
  const absl::StatusOr<Cloth> cloth = BuildCloth({.rows = 10, .cols = 20, .cell_mm = 10});
  ASSERT_TRUE(cloth.ok());
  const auto garment =
      ImportTemplate("tube", cloth->rest, cloth->cell_of_vertex, *GenerateBoard(10, 20, 10, 1));
  ASSERT_TRUE(garment.ok()) << garment.status();
  ASSERT_TRUE(WriteTemplate(folder / "template", *garment).ok());
  ASSERT_TRUE(WriteRig(folder / "rig.json", *MakeStudioRig("ring", {.cameras = 10})).ok());
  const auto plan = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"plan", "--rig", folder / "rig.json", "--template", folder / "template",
                               "--out", folder / "plan"});
    return RunAloud(AddRigPlanCommand, more);
  };
  const AloudRun json = plan({"--cameras", "8", "--json"});
  ASSERT_TRUE(json.status.ok()) << json.status;
  const auto told = FromJson<v1::RigPlan>(json.out);
  const AloudRun run = plan({"--cameras", "8", "--threads", "1"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(ReadRig(folder / "plan/rig.json")->cameras.size(), 8u);
  const auto& chosen = told.steps(7);
  EXPECT_EQ(
      run.out,
      VerdictText(told.verdict()) +
          absl::StrFormat("covered  %.1f %% by the chosen cameras, %.1f %% by all; %.1f views a cell, sigma "
                          "%.3f mm\nrig      %s/rig.json\nreport   %s/report.html\n",
                          100 * chosen.coverage(), 100 * told.steps().rbegin()->coverage(),
                          chosen.mean_views(), chosen.median_sigma_mm(), folder / "plan", folder / "plan"));
  EXPECT_EQ(ReadRig(folder / "plan/rig.json")->ContentHash(), told.rig_hash());
  EXPECT_EQ(plan({"--rig", folder / "none"}).status.code(), absl::StatusCode::kInvalidArgument);
  const AloudRun none = RunAloud(AddRigPlanCommand, {"plan", "--rig", folder / "none", "--template",
                                                     folder / "template", "--out", folder / "other"});
  EXPECT_EQ(none.status.code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace weft

// weft dataset meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "figure/body.h"
#include "figure/joint_angles.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/frames_file.h"
#include "services/tools/cli/commands.h"
#include "tests/animation/waving_tube.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/work/animation/moving_take.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandDatasetMeshes : public ::testing::Test {
 protected:
  CommandRun Meshes(const std::string& take, std::vector<std::string> more = {},
                    bool is_quiet = false) const {
    more.insert(more.begin(), {"dataset", "meshes", take, "--out", out_});
    return RunCommand(AddDatasetCommand, std::move(more), is_quiet);
  }
  std::string Tube(int frames) const {
    return WriteMovingTake(folder_ / "tube", garment_, frames, [](int k) { return WavingTube::At(k, 0); });
  }
  // Of a person who stands, with the body of this hash.
  std::string Worn(const std::string& body_hash) const {
    const std::string path = folder_ / "worn";
    std::filesystem::create_directories(path + "/truth");
    EXPECT_TRUE(WriteTemplate(path + "/template", garment_).ok());
    WriteBytes(path + "/recipe.txt", "shirt-drive seed 1 body " + body_hash + " rest\n");
    const FramesHead head{garment_.ContentHash(), static_cast<uint32_t>(garment_.rest.vertices_mm.size()), 50,
                          true};
    std::ofstream file(path + "/truth/frames.bin", std::ios::binary);
    file << EncodeFramesHead(head);
    for (int k = 0; k < 2; ++k)
      file << EncodeClothFrame(head, {20'000'000 * k, WavingTube::At(k, 0), PoseOf(NaturalAngles())});
    return path;
  }
  // Of the mesh file of a frame.
  std::vector<Eigen::Vector3d> Vertices(const std::string& file) const {
    const auto mesh = ReadMesh(out_ + "/" + file);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? mesh->vertices_mm : std::vector<Eigen::Vector3d>();
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "out";
  const Template garment_ = WavingTube::Garment();
};

TEST_F(CommandDatasetMeshes, ClothIsWrittenInTheAxesAndTheUnitAskedFor) {
  const std::string take = Tube(3);
  const CommandRun run = Meshes(take, {"--up", "z", "--unit", "cm"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            out_ +
                ": the cloth of 3 frames, cm, z up, 50 frames/s\n"
                "Its person's pose is not known: takes of `weft simulate --motion FILE --no-pictures` and "
                "of data sets keep it.\n");
  // The world has y down. With z up, its y is -z.
  const Eigen::Vector3d truth = WavingTube::At(2, 0)[5], written = Vertices("cloth/0002.ply")[5];
  EXPECT_NEAR(written.z(), -0.1 * truth.y(), 1e-3);
  EXPECT_NEAR(written.norm(), 0.1 * truth.norm(), 1e-3);
  EXPECT_FALSE(std::filesystem::exists(out_ + "/body"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/cloth/0003.ply"));

  const CommandRun metres = Meshes(take, {}, true);
  EXPECT_EQ(metres.out, out_ + ": the cloth of 3 frames, m, y up, 50 frames/s\n");
  EXPECT_NEAR(Vertices("cloth/0002.ply")[5].y(), -0.001 * truth.y(), 1e-5);
}

TEST_F(CommandDatasetMeshes, ThePersonIsWrittenBesideTheCloth) {
  const CommandRun run = Meshes(Worn(BodyHash(BodyShape())), {"--unit", "mm"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": the cloth of 2 frames, and the body, mm, y up, 50 frames/s\n");
  const auto truth = Body(PoseOf(NaturalAngles()), BodyShape()).MeshVertices();
  const auto body = Vertices("body/0001.ply");
  ASSERT_EQ(body.size(), truth.size());
  EXPECT_NEAR(body[7].y(), -truth[7].y(), 0.01);
  EXPECT_EQ(ReadMesh(out_ + "/body/0000.ply")->faces, Body::MeshFaces());
  EXPECT_TRUE(std::filesystem::exists(out_ + "/cloth/0001.ply"));
}

TEST_F(CommandDatasetMeshes, APersonOfOtherSizesIsGivenByFile) {
  BodyShape tall;
  tall.stature = 1.1;
  ASSERT_TRUE(WriteBody(folder_ / "tall.body", {"tall", tall}).ok());
  const std::string take = Worn(BodyHash(tall));
  const CommandRun average = Meshes(take);
  EXPECT_EQ(average.status, absl::FailedPreconditionError(
                                take + ": its person has the body " + BodyHash(tall) +
                                ", not the average one; give with --body the file that `weft simulate` "
                                "was given"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/body"));
  ASSERT_TRUE(Meshes(take, {"--body", folder_ / "tall.body", "--unit", "mm"}).status.ok());
  EXPECT_NEAR(Vertices("body/0000.ply")[7].y(), -Body(PoseOf(NaturalAngles()), tall).MeshVertices()[7].y(),
              0.01);
  const CommandRun other = Meshes(Worn("0123456789abcdef"), {"--body", folder_ / "tall.body"});
  EXPECT_THAT(other.message(), HasSubstr("has the body 0123456789abcdef, not " + (folder_ / "tall.body") +
                                         ", " + BodyHash(tall) + ";"));
}

TEST_F(CommandDatasetMeshes, WhatIsNoTakeIsNamed) {
  const CommandRun run = Meshes(folder_ / "none");
  EXPECT_FALSE(run.status.ok());
  EXPECT_THAT(run.message(), HasSubstr(folder_ / "none"));
  EXPECT_THAT(Meshes(Tube(1), {"--up", "x"}).message(), HasSubstr("\"x\" is none of y, z"));
}

}  // namespace
}  // namespace weft

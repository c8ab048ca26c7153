#include "services/synthetic/take_writer.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <map>

#include "capture/image_folder_dump.h"
#include "services/files/board_file.h"
#include "services/files/mesh_file.h"
#include "services/files/rig_file.h"
#include "services/files/template_file.h"
#include "services/synthetic/truth_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

SyntheticTake Tiny(uint64_t seed, int frames, int cameras) {
  SyntheticTakeOptions options = *SyntheticPreset("tiny", seed);
  options.motion.frames = frames;
  options.motion.step_s = 1.0 / 1000;  // stretches a little more, takes a tenth of the time
  options.rig.cameras = cameras;
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(options);
  EXPECT_TRUE(take.ok()) << take.status();
  return *std::move(take);
}

// Content of every file below a folder, by relative path.
std::map<std::string, std::string> FilesBelow(const std::string& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      out[fs::relative(entry.path(), folder).string()] = ReadBytes(entry.path().string());
  return out;
}

TEST(TakeWriter, FolderIsADumpWithEverythingThatRegistrationNeeds) {
  const TempFolder folder;
  const SyntheticTake take = Tiny(1, 2, 3);
  const std::string out = folder / "take";
  std::atomic<int> views = 0;
  const auto summary = WriteSyntheticTake(take, out, [&views] { ++views; });
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(views, 6);
  EXPECT_EQ(summary->cells, 24 * 48);
  EXPECT_GT(summary->median_pitch_px, 5);

  const auto rig = ReadRig(out + "/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->ContentHash(), take.rig().ContentHash());
  const auto board = ReadBoard(out + "/board.json");
  ASSERT_TRUE(board.ok()) << board.status();
  EXPECT_TRUE(board->FindClashes(1).empty());
  const auto garment = ReadTemplate(out + "/template");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_TRUE(CheckTemplateFitsBoard(*garment, *board).ok());

  const auto dump = ImageFolderDump::Open(out, *rig);
  ASSERT_TRUE(dump.ok()) << dump.status();
  EXPECT_EQ((*dump)->frame_names(), (std::vector<std::string>{"0000", "0001"}));
  EXPECT_TRUE((*dump)->warnings().empty());
  const auto set = (*dump)->Read(1);
  ASSERT_TRUE(set.ok()) << set.status();
  ASSERT_EQ(set->frames.size(), 3u);
  const auto scene = take.SceneAt(1);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(*set->frames[2].pixels, *take.Render(*scene, 1, 2)->pixels);
}

TEST(TakeWriter, TruthReadsBackAsItWas) {
  const TempFolder folder;
  const SyntheticTake take = Tiny(1, 1, 2);
  const std::string out = folder / "take";
  ASSERT_TRUE(WriteSyntheticTake(take, out).ok());
  const auto frames = ListTruthFrames(out + "/truth");
  ASSERT_TRUE(frames.ok()) << frames.status();
  EXPECT_EQ(*frames, std::vector<std::string>{"0000"});
  const auto truth = ReadFrameTruth(out + "/truth/0000");
  ASSERT_TRUE(truth.ok()) << truth.status();
  EXPECT_EQ(truth->mesh.vertices_mm, take.MeshAt(0).vertices_mm);
  EXPECT_EQ(truth->mesh.faces, take.MeshAt(0).faces);
  const auto scene = take.SceneAt(0);
  ASSERT_TRUE(scene.ok());
  ASSERT_EQ(truth->views.size(), 2u);
  const ViewTruth expected = take.Truth(*scene, 1);
  EXPECT_EQ(truth->views[1].camera_id, expected.camera_id);
  ASSERT_EQ(truth->views[1].nodes.size(), expected.nodes.size());
  for (size_t i = 0; i < expected.nodes.size(); ++i) {
    const NodeTruth &read = truth->views[1].nodes[i], &wrote = expected.nodes[i];
    EXPECT_EQ(read.node, wrote.node);
    EXPECT_LT((read.pixel_px - wrote.pixel_px).norm(), 1e-4);
    EXPECT_EQ(read.vertex, wrote.vertex);
    EXPECT_EQ(read.visible, wrote.visible);
    EXPECT_EQ(read.scoreable, wrote.scoreable);
  }
}

TEST(TakeWriter, SameFilesAtAnyThreadCountAndOthersForAnotherSeed) {
  const TempFolder folder;
  const auto write = [&](const std::string& name, uint64_t seed, int threads) {
    tbb::task_arena arena(threads);
    arena.execute([&] {
      const auto summary = WriteSyntheticTake(Tiny(seed, 1, 2), folder / name);
      EXPECT_TRUE(summary.ok()) << summary.status();
    });
    return FilesBelow(folder / name);
  };
  const auto one = write("one", 1, 1);
  EXPECT_EQ(one.size(), 2u + 1 + 2 + 3 + 3);  // pictures, rig, board, template, truth
  EXPECT_TRUE(one == write("two", 1, 2));
  const auto other = write("other", 2, 2);
  for (const char* name : {"0000/c00.png", "rig.json", "board.png", "truth/0000/mesh.ply"})
    EXPECT_NE(one.at(name), other.at(name)) << name;
}

TEST(TakeWriter, LeavesAFullFolderAlone) {
  const TempFolder folder;
  WriteBytes(folder / "take/mine.txt", "mine");
  const auto summary = WriteSyntheticTake(Tiny(1, 1, 1), folder / "take");
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(FilesBelow(folder.path()).size(), 1u);
}

TEST(TakeWriter, LeavesNothingBehindWhenItIsStopped) {
  const TempFolder folder;
  std::stop_source stop;
  const auto summary = WriteSyntheticTake(
      Tiny(1, 2, 2), folder / "take", [&stop] { stop.request_stop(); }, stop.get_token());
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kCancelled) << summary.status();
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(TakeWriter, LeavesNothingBehindWhenItFails) {
  const TempFolder folder;
  WriteBytes(folder / "file", "not a folder");
  EXPECT_FALSE(WriteSyntheticTake(Tiny(1, 1, 1), folder / "file/take").ok());
  EXPECT_EQ(FilesBelow(folder.path()).size(), 1u);
}

TEST(SyntheticPreset, UnknownNamesAreAnsweredWithTheKnownOnes) {
  const auto preset = SyntheticPreset("huge", 1);
  EXPECT_EQ(preset.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(preset.status().message().find("tiny, quickstart"), std::string::npos);
}

TEST(TruthFile, BrokenLinesAreNamed) {
  const std::string header = "kind,row,col,x_px,y_px,pitch_px,facing_deg,visible,scoreable,vertex\n";
  EXPECT_TRUE(ParseViewTruth(header + "center,1,2,3.5,4.5,6,20,1,1,7\n", "c", "t.csv").ok());
  for (const auto& [line, expected] :
       std::map<std::string, std::string>{{"center,1,2,3.5,4.5,6,20,1,1\n", "9 columns"},
                                          {"middle,1,2,3.5,4.5,6,20,1,1,7\n", "kind"},
                                          {"center,1,2,nan,4.5,6,20,1,1,7\n", "x_px"},
                                          {"center,1,2,3.5,4.5,inf,20,1,1,7\n", "pitch_px"},
                                          {"center,1,2,3.5,4.5,6,20,2,1,7\n", "visible"},
                                          {"center,1,2,3.5,4.5,6,20,1,1,-2\n", "vertex"}}) {
    const auto truth = ParseViewTruth(header + line, "c", "t.csv");
    EXPECT_EQ(truth.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(truth.status().message().find("t.csv: line 2"), std::string::npos);
    EXPECT_NE(truth.status().message().find(expected), std::string::npos) << truth.status();
  }
  EXPECT_FALSE(ParseViewTruth("x,y\n", "c", "t.csv").ok());
}

}  // namespace
}  // namespace weft

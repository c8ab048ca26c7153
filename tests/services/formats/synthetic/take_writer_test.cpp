#include "services/formats/synthetic/take_writer.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <map>

#include "capture/image/image_file.h"
#include "capture/take/image_folder_dump.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/simulation/tiny_take.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::StatusOr<TakeSummary> Write(SyntheticTake& take, const std::string& out,
                                  const std::function<void()>& on_view = {},
                                  const std::stop_token& stop = {}) {
  const absl::StatusOr<TakeFolder> folder = TakeFolder::Open(out, "test");
  if (!folder.ok()) return folder.status();
  return WriteSyntheticTake(take, *folder, {}, on_view, stop);
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
  SyntheticTake take = Tiny(1, 2, 3);
  const std::string out = folder / "take";
  std::atomic<int> views = 0;
  const auto summary = Write(take, out, [&views] { ++views; });
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
  const auto panels = ReadPanelMask(out + "/panels.png", board->rows, board->cols);
  ASSERT_TRUE(panels.ok()) << panels.status();
  int cells = 0;
  for (const VertexNode& cell : garment->node_of_vertex) {
    if (cell.row < 0) continue;
    ++cells;
    EXPECT_GT((*panels)[cell.row * board->cols + cell.col], 0);
  }
  EXPECT_EQ(std::ranges::count_if(*panels, [](uint8_t label) { return label > 0; }), cells);

  const auto dump = ImageFolderDump::Open(out, *rig);
  ASSERT_TRUE(dump.ok()) << dump.status();
  EXPECT_EQ((*dump)->frame_names(), (std::vector<std::string>{"0000", "0001"}));
  EXPECT_TRUE((*dump)->warnings().empty());
  const auto set = (*dump)->Read(1);
  ASSERT_TRUE(set.ok()) << set.status();
  ASSERT_EQ(set->frames.size(), 3u);
  SyntheticTake again = Tiny(1, 2, 3);
  ASSERT_TRUE(again.Next().ok());
  const auto frame = again.Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  const auto view = again.Film(*frame, 2);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_EQ(*set->frames[2].pixels, *ToFrame(*view->picture).pixels);
}

TEST(TakeWriter, TruthReadsBackAsItWas) {
  const TempFolder folder;
  SyntheticTake take = Tiny(1, 1, 2);
  const std::string out = folder / "take";
  ASSERT_TRUE(Write(take, out).ok());
  const auto frames = ListTruthFrames(out + "/truth");
  ASSERT_TRUE(frames.ok()) << frames.status();
  EXPECT_EQ(*frames, std::vector<std::string>{"0000"});
  const auto truth = ReadFrameTruth(out + "/truth/0000");
  ASSERT_TRUE(truth.ok()) << truth.status();
  SyntheticTake again = Tiny(1, 1, 2);
  const auto frame = again.Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(truth->mesh.vertices_mm, frame->scene.mesh().vertices_mm);
  EXPECT_EQ(truth->mesh.faces, frame->scene.mesh().faces);
  ASSERT_EQ(truth->views.size(), 2u);
  const auto filmed = again.Film(*frame, 1);
  ASSERT_TRUE(filmed.ok()) << filmed.status();
  const ViewTruth& expected = filmed->truth;
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
      SyntheticTake take = Tiny(seed, 1, 2);
      const auto summary = Write(take, folder / name);
      EXPECT_TRUE(summary.ok()) << summary.status();
    });
    return FilesBelow(folder / name);
  };
  const auto one = write("one", 1, 1);
  EXPECT_EQ(one.size(), 2u + 1 + 3 + 3 + 4 + 1);  // pictures, rig, board, template, truth, recipe
  EXPECT_TRUE(one == write("two", 1, 2));
  const auto other = write("other", 2, 2);
  for (const char* name : {"0000/c00.png", "rig.json", "board.png", "truth/0000/mesh.ply"})
    EXPECT_NE(one.at(name), other.at(name)) << name;
}

TEST(TakeWriter, LeavesAFullFolderAlone) {
  const TempFolder folder;
  WriteBytes(folder / "take/mine.txt", "mine");
  SyntheticTake take = Tiny(1, 1, 1);
  const auto summary = Write(take, folder / "take");
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(FilesBelow(folder.path()).size(), 1u);
}

TEST(TakeWriter, GoesOnAfterAStopWithTheSameBytes) {
  const TempFolder folder;
  SyntheticTake whole = Tiny(1, 3, 2);
  ASSERT_TRUE(Write(whole, folder / "whole").ok());

  // Stopped in the middle of the second frame.
  std::stop_source stop;
  std::atomic<int> views = 0;
  SyntheticTake stopped = Tiny(1, 3, 2);
  absl::StatusOr<TakeSummary> summary;
  tbb::task_arena(1).execute([&] {  // so that no other view is under way
    summary = Write(
        stopped, folder / "take",
        [&] {
          if (++views == 3) stop.request_stop();
        },
        stop.get_token());
  });
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kCancelled) << summary.status();
  EXPECT_TRUE(fs::exists(folder / "take/0000/c01.png"));
  EXPECT_FALSE(fs::exists(folder / "take/0001"));
  EXPECT_FALSE(fs::exists(folder / "take/truth/0001"));
  const auto first_written = fs::last_write_time(folder / "take/0000/c01.png");

  SyntheticTake again = Tiny(1, 3, 2);
  const auto rest = Write(again, folder / "take");
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(fs::last_write_time(folder / "take/0000/c01.png"), first_written);
  EXPECT_EQ(FilesBelow(folder / "take"), FilesBelow(folder / "whole"));
}

TEST(TakeWriter, LeavesNothingBehindWhenItFails) {
  const TempFolder folder;
  WriteBytes(folder / "file", "not a folder");
  SyntheticTake take = Tiny(1, 1, 1);
  EXPECT_FALSE(Write(take, folder / "file/take").ok());
  EXPECT_EQ(FilesBelow(folder.path()).size(), 1u);
}

TEST(TakeWriter, DeepPicturesAreStoredWith16BitsWhateverTheirOwn) {
  const TempFolder folder;
  SyntheticTakeOptions options = TinyOptions(1, 1, 1);
  options.camera.sensor.bits = 12;
  auto take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const auto deep_folder = TakeFolder::Open(folder / "deep", "deep");
  ASSERT_TRUE(deep_folder.ok()) << deep_folder.status();
  ASSERT_TRUE(WriteSyntheticTake(*take, *deep_folder, {.image_ending = "tif"}).ok());
  SyntheticTake shallow = Tiny(1, 1, 1);
  ASSERT_TRUE(Write(shallow, folder / "shallow").ok());
  const auto deep = ReadImageFile(folder / "deep/0000/c00.tif");
  const auto plain = ReadImageFile(folder / "shallow/0000/c00.png");
  ASSERT_TRUE(deep.ok()) << deep.status();
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_GT(fs::file_size(folder / "deep/0000/c00.tif"), 3u * 192 * 256);
  ASSERT_EQ(deep->pixels->size(), plain->pixels->size());
  for (size_t i = 0; i < plain->pixels->size(); ++i) EXPECT_NEAR((*deep->pixels)[i], (*plain->pixels)[i], 1);
}

TEST(TakeFileOptions, AreThoseThatPicturesCanHave) {
  const auto why = [](const std::string& ending, int bits, int quality = 95) {
    return std::string(
        TakeFileOptions{.image_ending = ending, .jpeg_quality = quality}.Validate(bits).message());
  };
  for (const char* ending : {"png", "tif", "jpg", "jpeg"}) EXPECT_EQ(why(ending, 8), "") << ending;
  for (const char* ending : {"png", "tif"}) EXPECT_EQ(why(ending, 9), "") << ending;
  for (const char* ending : {"jpg", "jpeg"})
    EXPECT_EQ(why(ending, 9), "pictures: JPEG holds 8 bits, not 9; choose png or tif") << ending;
  EXPECT_EQ(why("bmp", 8), "pictures: \"bmp\" is none of png, jpg, tif");
  for (const int quality : {1, 100}) EXPECT_EQ(why("jpg", 8, quality), "");
  EXPECT_EQ(why("jpg", 8, 0), "pictures: jpeg_quality is 0, expected 1 to 100");
  EXPECT_EQ(why("jpg", 8, 101), "pictures: jpeg_quality is 101, expected 1 to 100");
}

TEST(TakeWriter, LostPicturesAreMissingAndNamed) {
  const TempFolder folder;
  SyntheticTakeOptions options = TinyOptions(1, 2, 6);
  options.shutter.drop_rate = 0.4;
  auto take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const auto summary = Write(*take, folder / "take");
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_GT(summary->lost_pictures, 0);
  EXPECT_LT(summary->lost_pictures, 12);
  const std::string list = ReadBytes(folder / "take/truth/pictures.csv");
  int lost = 0;
  for (const std::string frame : {"0000", "0001"})
    for (int c = 0; c < 6; ++c) {
      const std::string name = frame + "/c0" + std::to_string(c);
      const bool there = fs::exists(folder / ("take/" + name + ".png"));
      EXPECT_EQ(there, fs::exists(folder / ("take/truth/" + name + ".truth")));
      const std::string time = frame == "0000" ? "0" : "33333333";
      EXPECT_NE(list.find(frame + ",c0" + std::to_string(c) + "," + time + (there ? ",0\n" : ",1\n")),
                std::string::npos);
      lost += there ? 0 : 1;
    }
  EXPECT_EQ(lost, summary->lost_pictures);
}

}  // namespace
}  // namespace weft

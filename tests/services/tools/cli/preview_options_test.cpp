#include "services/tools/cli/preview_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/formats/files/board_file.h"
#include "services/formats/files/template_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// What the parser says; empty where it takes the words.
std::string Parsed(const std::string& words, PreviewCommandOptions* options) {
  CLI::App app;
  AddPreviewOptions(app, *options);
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

TEST(PreviewOptions, EachNeedsTheOneThatItRefinesBeforeIt) {
  PreviewCommandOptions options;
  EXPECT_THAT(Parsed("--board b", &options), HasSubstr("--preview"));
  EXPECT_THAT(Parsed("--preview p --template t", &options), HasSubstr("--board"));
  EXPECT_THAT(Parsed("--preview p --decoded-views 3", &options), HasSubstr("--board"));
  EXPECT_THAT(Parsed("--preview-interval 2", &options), HasSubstr("--preview"));
  EXPECT_EQ(Parsed("--preview p --board b --template t --preview-interval 2.5 --decoded-views 3", &options),
            "");
  EXPECT_EQ(options.folder, "p");
  EXPECT_EQ(options.board, "b");
  EXPECT_EQ(options.garment, "t");
  EXPECT_EQ(options.interval_s, 2.5);
  EXPECT_EQ(options.decoded_views, 3);
}

TEST(PreviewOptions, NumbersStayWithinTheirLimits) {
  PreviewCommandOptions options;
  EXPECT_THAT(Parsed("--preview p --preview-interval 0.05", &options), HasSubstr("--preview-interval"));
  EXPECT_THAT(Parsed("--preview p --board b --decoded-views 1001", &options), HasSubstr("--decoded-views"));
  EXPECT_EQ(Parsed("--preview p --preview-interval 0.1", &options), "");
  EXPECT_EQ(Parsed("--preview p --board b --decoded-views 0", &options), "");
}

TEST(PreviewOptions, NoneIsStartedUnlessItIsAskedFor) {
  const auto none = StartPreview({}, "/takes/walk");
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_EQ(*none, nullptr);
}

TEST(PreviewOptions, ThePageIsCalledByTheTake) {
  const TempFolder folder;
  PreviewCommandOptions options;
  options.folder = folder / "preview";
  const auto preview = StartPreview(options, "/takes/walk-7");
  ASSERT_TRUE(preview.ok()) << preview.status();
  ASSERT_NE(*preview, nullptr);
  ASSERT_TRUE((*preview)->Finish().ok());
  EXPECT_THAT(ReadBytes(folder / "preview/index.html"), HasSubstr("walk-7"));
}

TEST(PreviewOptions, ABoardThatIsNotThereIsNamedBeforeAPageIsWritten) {
  const TempFolder folder;
  PreviewCommandOptions options;
  options.folder = folder / "preview";
  options.board = folder / "board.json";
  const absl::Status status = StartPreview(options, "walk").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr(options.board));
  EXPECT_FALSE(std::filesystem::exists(options.folder));
}

TEST(PreviewOptions, BoardAndGarmentBelongTogether) {
  const TempFolder folder;
  const Board board = *GenerateBoard(6, 6, 1, 1);
  ASSERT_TRUE(WriteBoard(folder / "board", board).ok());
  const TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {1, -1, 0}}, {{0, 2, 1}, {2, 3, 1}}};
  const auto garment = ImportTemplate(
      "shirt", square, {{0, 0, NodeKind::kCenter}, {0, 1, NodeKind::kCenter}, {1, 0, NodeKind::kCenter}, {}},
      board);
  ASSERT_TRUE(garment.ok()) << garment.status();
  ASSERT_TRUE(WriteTemplate(folder / "shirt", *garment).ok());
  PreviewCommandOptions options;
  options.folder = folder / "preview";
  options.board = folder / "board";
  options.garment = folder / "shirt";
  const auto preview = StartPreview(options, "walk");
  ASSERT_TRUE(preview.ok()) << preview.status();
  EXPECT_TRUE((*preview)->Finish().ok());
  ASSERT_TRUE(WriteBoard(folder / "other", *GenerateBoard(6, 6, 1, 2)).ok());
  options.board = folder / "other";
  EXPECT_FALSE(StartPreview(options, "walk").ok());
}

TEST(PreviewOptions, WarnOfWhatWentWrong) {
  ::testing::internal::CaptureStderr();
  WarnOfPreview(absl::OkStatus());
  WarnOfPreview(absl::InternalError("the disk is full"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "weft: warning: the preview: the disk is full\n");
}

}  // namespace
}  // namespace weft

// weft decode: what it tells of pictures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/board_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/observations_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/board_picture.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class CommandDecode : public ::testing::Test {
 protected:
  CommandDecode() {
    EXPECT_TRUE(WriteBoard(folder_ / "board", board_).ok());
    Write("a.png", PictureOfBoard(board_, 10, 20));
  }
  void Write(const std::string& name, const Frame& picture) const {
    fs::create_directories(fs::path(folder_ / name).parent_path());
    EXPECT_TRUE(WriteImageFile(folder_ / name, picture).ok());
  }
  CommandRun Decode(const std::vector<std::string>& pictures, const std::vector<std::string>& options = {},
                    bool is_quiet = false) const {
    std::vector<std::string> words = {"decode",    "--board", folder_ / "board", "--out", out_,
                                      "--threads", "1"};
    words.insert(words.end(), options.begin(), options.end());
    for (const std::string& picture : pictures) words.push_back(folder_ / picture);
    return RunCommand(AddDecodeCommand, std::move(words), is_quiet);
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "o.csv";
  const Board board_ = *GenerateBoard(8, 10, 2.7, 1);
};

TEST_F(CommandDecode, TheTableHasALineForEachPictureAndTheirSums) {
  Write("camera-one.png", PictureOfBoard(board_, 12, 20));
  WriteBytes(folder_ / "broken.png", "no picture");
  const CommandRun run = Decode({"a.png", "broken.png", "camera-one.png"});
  const std::string why = folder_ / "broken.png";
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(),
              StartsWith("1 of 3 images could not be decoded, " + out_ + " holds the others: " + why));
  EXPECT_THAT(run.err, StartsWith("weft: warning: " + why));
  const std::string rejected = " +[0-9]+  [0-9]+(: [^\n]+ [0-9]+)?\n";
  EXPECT_THAT(run.out,
              MatchesRegex("usable: 1 of 3 images could not be decoded\n"
                           "  remedy: Mend or replace the images that the warnings name.\n"
                           "image                px    cells  corners       ms  accepted  rejected patches\n"
                           "a               140x120       80       63 +[0-9]+" +
                           rejected +
                           "broken      failed: [^\n]*\n"
                           "camera-one      160x136       80       63 +[0-9]+" +
                           rejected + "total          2 images      160      126 +[0-9]+" + rejected +
                           "[^\n]*o.csv: written in [0-9]+\\.[0-9] s\n"));
  // Patches accepted and rejected: those of both pictures together.
  int accepted[3] = {}, others[3] = {}, i = 0;
  for (const char* line : {"\na  ", "\ncamera-one  ", "\ntotal  "}) {
    std::istringstream words(run.out.substr(run.out.find(line) + 1));
    std::string word;
    for (int k = line[1] == 't' ? 6 : 5; k > 0; --k) words >> word;
    words >> accepted[i] >> others[i];
    ++i;
  }
  EXPECT_GT(accepted[0], 0);
  EXPECT_EQ(accepted[2], accepted[0] + accepted[1]);
  EXPECT_EQ(others[2], others[0] + others[1]);
  EXPECT_EQ(Decode({"a.png"}, {}, true).err, "");
}

TEST_F(CommandDecode, TheReportHasEveryMeasure) {
  const CommandRun run = Decode({"a.png", "none.png"}, {"--json", "--set", "decode.levels=2"});
  v1::DecodeReport report;
  ASSERT_TRUE(ParseJson(run.out, "report", report).ok()) << run.out;
  EXPECT_EQ(report.observations(), out_);
  EXPECT_EQ(report.images_decoded(), 1);
  EXPECT_EQ(report.images_failed(), 1);
  EXPECT_EQ(report.options().decode().levels(), 2);
  ASSERT_EQ(report.images_size(), 2);
  const v1::DecodedImage& image = report.images(0);
  EXPECT_EQ(image.path(), folder_ / "a.png");
  EXPECT_EQ(image.width_px(), 140);
  EXPECT_EQ(image.height_px(), 120);
  EXPECT_EQ(image.view().camera(), "a");
  EXPECT_EQ(image.view().missing_reason(), "");
  EXPECT_GT(image.view().read_ms(), 0);
  EXPECT_GT(image.total_ms(), image.view().read_ms());
  EXPECT_GE(report.wall_ms(), image.total_ms());
  const auto read = ReadObservations(out_);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(static_cast<size_t>(report.centers() + report.corners()), (*read)[0].observations.size());
  EXPECT_EQ(report.centers(), image.view().centers());
  EXPECT_EQ(report.corners(), image.view().corners());
  EXPECT_THAT(report.images(1).view().missing_reason(), HasSubstr("none.png: no such file"));
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_USABLE);
}

TEST_F(CommandDecode, PicturesOfAnotherBoardAreBad) {
  const Frame other = PictureOfBoard(*GenerateBoard(8, 10, 2.7, 77), 10, 20);
  Write("other.png", other);
  const CommandRun run = Decode({"other.png", "other.png"});
  EXPECT_THAT(run.message(), HasSubstr("is given twice"));
  const CommandRun one = Decode({"other.png"});
  EXPECT_EQ(one.status.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(one.out,
              StartsWith("bad: no cell of the board was decoded, 0 in 1 images: is it the right board?\n"));
}

TEST_F(CommandDecode, NothingReadableIsBad) {
  const CommandRun run = Decode({"x.png", "y.png"}, {"--json"});
  EXPECT_THAT(run.message(),
              HasSubstr("2 of 2 images could not be decoded, " + out_ +
                        " was not written; the first: " + (folder_ / "x.png") + ": no such file"));
  v1::DecodeReport report;
  ASSERT_TRUE(ParseJson(run.out, "report", report).ok()) << run.out;
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(report.observations(), "");
  EXPECT_EQ(Decode({"x.png"}).out, "");
}

TEST_F(CommandDecode, PicturesOfAnExplanationHaveNamesOfTheirOwn) {
  const auto names = [this] {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_ / "why"))
      found.push_back(entry.path().filename());
    std::ranges::sort(found);
    fs::remove_all(folder_ / "why");
    return found;
  };
  const std::vector<std::string> explain = {"--explain", folder_ / "why"};
  ASSERT_TRUE(Decode({"a.png"}, explain).status.ok());
  const auto drawn = ReadImageFile(folder_ / "why/a.png");
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_THAT(names(), ElementsAre("a.png"));
  for (const char* name : {"dump/0000/c1.png", "dump/0001/c1.png"})
    Write(name, PictureOfBoard(board_, 10, 20));
  ASSERT_TRUE(Decode({"dump/0000/c1.png", "dump/0001/c1.png"}, explain).status.ok());
  EXPECT_THAT(names(), ElementsAre("1_c1.png", "2_c1.png"));
  ASSERT_TRUE(Decode({"dump"}, explain).status.ok());
  EXPECT_THAT(names(), ElementsAre("0000_c1.png", "0001_c1.png"));
  ASSERT_TRUE(Decode({"dump"}, {"--frames", "0001", "--explain", folder_ / "why"}).status.ok());
  EXPECT_THAT(names(), ElementsAre("c1.png"));
}

TEST_F(CommandDecode, OutIsAFile) {
  fs::create_directories(folder_ / "o.csv");
  EXPECT_EQ(Decode({"a.png"}).status,
            absl::InvalidArgumentError(out_ + ": --out names a folder; give the name of a file in it"));
}

}  // namespace
}  // namespace weft

#include "services/formats/files/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/formats/files/json_file.h"
#include "services/formats/files/observations_file.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/rig.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(PlainLines, TextIsTheSameWhateverEditorSavedIt) {
  for (const char* bytes : {"a b\nc\n", "a b\r\nc\r\n", "a b\rc\r",
                            "\xEF\xBB\xBF"
                            "a b\r\nc\r\n"}) {
    const auto text = PlainLines(bytes, "cells.txt");
    ASSERT_TRUE(text.ok()) << text.status();
    EXPECT_EQ(*text, "a b\nc\n");
  }
  EXPECT_EQ(PlainLines("", "x").value(), "");
  EXPECT_EQ(PlainLines("\xEF\xBB\xBF", "x").value(), "");
  EXPECT_EQ(PlainLines("a\xEF\xBB\xBF"
                       "b",
                       "x")
                .value(),
            "a\xEF\xBB\xBF"
            "b");
}

TEST(PlainLines, OtherEncodingsAreNamed) {
  using std::string_literals::operator""s;
  for (const std::string& bytes : {"\xFF\xFE"
                                   "a\0b\0"s,
                                   "\xFE\xFF\0a"s, "\0\0\xFE\xFF\0\0\0a"s, "\xFF\xFE\0\0"s}) {
    const absl::Status status = PlainLines(bytes, "cells.txt").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message(), "cells.txt: is text in UTF-16 or UTF-32; save it as UTF-8");
  }
}

TEST(ReadTextFile, FilesAreReadBehindTheirMark) {
  const TempFolder folder;
  const std::string mark = "\xEF\xBB\xBF";
  WriteBytes(folder / "rig.json", mark + "{\"id\": \"studio\"}\r\n");
  v1::Rig rig;
  EXPECT_TRUE(ReadJsonFile(folder / "rig.json", rig).ok());
  EXPECT_EQ(rig.id(), "studio");
  WriteBytes(folder / "o.csv", mark +
                                   "image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px\r\n"
                                   "c1,1,2,3,4,center,1,0.1\r\n");
  const auto observations = ReadObservations(folder / "o.csv");
  ASSERT_TRUE(observations.ok()) << observations.status();
  EXPECT_EQ((*observations)[0].image, "c1");
  WriteBytes(folder / "wide.json", std::string("\xFF\xFE{\0", 4));
  EXPECT_THAT(std::string(ReadJsonFile(folder / "wide.json", rig).message()), HasSubstr("save it as UTF-8"));
}

}  // namespace
}  // namespace weft

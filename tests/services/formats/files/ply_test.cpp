#include "services/formats/files/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "services/formats/files/ply_points.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Bytes(std::initializer_list<int> values) {
  std::string out;
  for (const int v : values) out += static_cast<char>(v);
  return out;
}

// A vertex of every type, one value each.
const char kAllTypes[] =
    "element vertex 1\nproperty char a\nproperty uchar b\nproperty short c\nproperty ushort d\nproperty int "
    "e\n"
    "property uint f\nproperty float g\nproperty double h\nend_header\n";

void ExpectAllTypes(const absl::StatusOr<Ply>& ply) {
  ASSERT_TRUE(ply.ok()) << ply.status();
  const PlyElement* vertex = ply->Find("vertex");
  ASSERT_NE(vertex, nullptr);
  const std::vector<std::pair<const char*, double>> expected = {
      {"a", -2},        {"b", 254},        {"c", -258}, {"d", 65279},
      {"e", -16909060}, {"f", 4278190081}, {"g", 1.5},  {"h", -0.75}};
  for (const auto& [name, value] : expected) {
    ASSERT_NE(vertex->Find(name), nullptr) << name;
    EXPECT_THAT(vertex->Find(name)->values, ElementsAre(value)) << name;
  }
}

std::string PlyErrorOf(const std::string& bytes) {
  const auto ply = ParsePly(bytes, "scan.ply");
  EXPECT_EQ(ply.status().code(), absl::StatusCode::kInvalidArgument) << bytes;
  return std::string(ply.status().message());
}

TEST(ParsePly, ReadsLittleEndianBytes) {
  ExpectAllTypes(
      ParsePly(std::string("ply\nformat binary_little_endian 1.0\n") + kAllTypes +
                   Bytes({0xfe, 0xfe, 0xfe, 0xfe, 0xff, 0xfe, 0xfc, 0xfc, 0xfd, 0xfe, 0x01, 0,    0,
                          0xff, 0,    0,    0xc0, 0x3f, 0,    0,    0,    0,    0,    0,    0xe8, 0xbf}),
               "scan.ply"));
}

TEST(ParsePly, ReadsBigEndianBytes) {
  ExpectAllTypes(ParsePly(std::string("ply\nformat binary_big_endian 1.0\n") + kAllTypes +
                              Bytes({0xfe, 0xfe, 0xfe, 0xfe, 0xfe, 0xff, 0xfe, 0xfd, 0xfc, 0xfc, 0xff, 0, 0,
                                     0x01, 0x3f, 0xc0, 0,    0,    0xbf, 0xe8, 0,    0,    0,    0,    0, 0}),
                          "scan.ply"));
}

TEST(ParsePly, ReadsAsciiWithWindowsLineEndings) {
  std::string text = std::string("ply\nformat ascii 1.0\ncomment made by hand\n") + kAllTypes +
                     "-2 254 -258 65279 -16909060 4278190081 1.5 -7.5e-1\n";
  ExpectAllTypes(ParsePly(text, "scan.ply"));
  std::string windows;
  for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  ExpectAllTypes(ParsePly(windows, "scan.ply"));
  text.pop_back();  // the last number may end the file
  ExpectAllTypes(ParsePly(text, "scan.ply"));
}

TEST(ParsePly, ReadsHeadersAsProgramsWriteThem) {
  const std::string body =
      Bytes({0x0a, 0x0a, 0x0a, 0x0a, 0x20, 0x0d, 0x0a, 0x09});  // blanks of text are numbers here
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty int x\nend_header\n";
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string out;
    for (const char c : head) out += std::string(1, c) == from ? to : std::string(1, c);
    return out;
  };
  for (const std::string& header :
       {head, replaced("\n", "\r\n"), replaced("\n", "\r"), replaced("\n", " \n"), replaced("\n", " \t\r\n"),
        replaced(" ", "\t"), replaced(" ", "   "), "\xEF\xBB\xBF" + head}) {
    const auto ply = ParsePly(header + body, "scan.ply");
    ASSERT_TRUE(ply.ok()) << ply.status() << header;
    EXPECT_THAT(ply->elements[0].Find("x")->values, ElementsAre(0x0a0a0a0a, 0x090a0d20)) << header;
  }
}

constexpr char kThreeFloats[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\nend_header\n";

TEST(ParsePly, TextWithColumnsThatTheHeaderLeavesOutIsRefused) {
  const std::string head = kThreeFloats;
  EXPECT_THAT(
      PlyErrorOf(head + "1 2 3 0.5\n4 5 6 0.5\n7 8 9 0.5\n"),
      HasSubstr("element vertex, row 0: has 4 numbers on its line, the properties of the header make 3"));
  EXPECT_THAT(PlyErrorOf(head + "1 2 3 0 0 1\n4 5 6 0 0 1\n7 8 9 0 0 1\n"),
              HasSubstr("has 6 numbers on its line"));
  EXPECT_THAT(PlyErrorOf(head + "1 2 3\n4 5 6 0.5\n7 8 9\n"), HasSubstr("row 1: has 4 numbers"));
  EXPECT_THAT(PlyErrorOf(head + "1 2 3\n4 5\n7 8 9 10\n"), HasSubstr("row 1: has 2 numbers"));
  EXPECT_THAT(
      PlyErrorOf("ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                 "3 0 1 2 255\n"),
      HasSubstr("element face, row 0: has 5 numbers"));
}

TEST(ParsePly, TextMayBreakRowsOrJoinThemFromTheFirstOn) {
  const std::string head = kThreeFloats;
  for (const char* body : {"1 2 3 4 5 6 7 8 9\n", "1 2\n3\n4 5\n6\n7 8\n9\n", "1 2 3 4 5 6\n7 8 9\n",
                           "\n1 2 3  \n\n4 5 6\t\n7 8 9\n\n", "1 2 3\r4 5 6\r7 8 9\r"}) {
    const auto ply = ParsePly(head + body, "scan.ply");
    ASSERT_TRUE(ply.ok()) << ply.status() << body;
    EXPECT_THAT(ply->elements[0].Find("y")->values, ElementsAre(2, 5, 8)) << body;
  }
}

TEST(ParsePly, DataAfterTheLastRowAreRefused) {
  EXPECT_THAT(PlyErrorOf(std::string(kThreeFloats) + "1 2 3\n4 5 6\n7 8 9\n10 11 12\n"),
              HasSubstr("10 bytes follow the last row"));
  const std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty int x\nend_header\n";
  EXPECT_THAT(PlyErrorOf(binary + Bytes({1, 0, 0, 0, 2, 0, 0, 0})), HasSubstr("4 bytes follow the last row"));
  // Some programs end with a new line, or fill a block.
  EXPECT_TRUE(ParsePly(binary + Bytes({1, 0, 0, 0, '\n'}), "scan.ply").ok());
  EXPECT_TRUE(ParsePly(binary + Bytes({1, 0, 0, 0}) + std::string(100, '\0'), "scan.ply").ok());
}

TEST(DropUnmeasured, RemovesVerticesWithoutAPlace) {
  auto ply = ParsePly(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property list uchar int tags\nproperty float nx\nend_header\n"
      "1 2 3 1 7 nan\nnan 2 3 2 8 8 0\n4 5 6 0 1\n1 2 inf 1 9 0\n",
      "scan.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  EXPECT_EQ(DropUnmeasured(*ply), 2u);
  const PlyElement& vertex = ply->elements[0];
  EXPECT_EQ(vertex.rows, 2u);
  EXPECT_THAT(vertex.Find("x")->values, ElementsAre(1, 4));
  EXPECT_THAT(vertex.Find("tags")->values, ElementsAre(7));
  EXPECT_THAT(vertex.Find("tags")->list_start, ElementsAre(0, 1, 1));
  EXPECT_TRUE(std::isnan(vertex.Find("nx")->values[0]));
  EXPECT_TRUE(SerializePly(*ply).ok());
  EXPECT_EQ(DropUnmeasured(*ply), 0u);
}

TEST(ParsePly, ReadsListsOfDifferentLengths) {
  const auto ply = ParsePly(
      "ply\nformat ascii 1.0\nelement face 3\nproperty list uchar int vertex_index\nproperty uchar "
      "red\nend_header\n"
      "3 0 1 2 255\n0 7\n1 9 8\n",
      "scan.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  const PlyElement& face = ply->elements[0];
  EXPECT_THAT(face.Find("vertex_index")->values, ElementsAre(0, 1, 2, 9));
  EXPECT_THAT(face.Find("vertex_index")->list_start, ElementsAre(0, 3, 3, 4));
  EXPECT_THAT(face.Find("red")->values, ElementsAre(255, 7, 8));
}

TEST(ParsePly, KeepsNumbersThatAreNotFinite) {
  const auto ply = ParsePly(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\nnan -inf\n",
      "scan.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  EXPECT_TRUE(std::isnan(ply->elements[0].Find("x")->values[0]));
  EXPECT_EQ(ply->elements[0].Find("y")->values[0], -std::numeric_limits<double>::infinity());
}

TEST(ParsePly, HeaderThatAnnouncesFourBillionRowsIsRefusedBeforeAnythingIsAllocated) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string head = std::string("ply\nformat ") + format + " 1.0\n";
    EXPECT_THAT(
        PlyErrorOf(head + "element vertex 4294967295\nproperty float x\nend_header\n1 2 3"),
        AllOf(HasSubstr("scan.ply: element vertex"), HasSubstr("4294967295 rows"), HasSubstr("truncated")));
    EXPECT_THAT(PlyErrorOf(head + "element vertex 18446744073709551615\nproperty float x\nend_header\n1 2 3"),
                HasSubstr("18446744073709551615 rows"));
  }
  EXPECT_THAT(
      PlyErrorOf("ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int vertex_index\n"
                 "end_header\n" +
                 Bytes({0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0})),
      AllOf(HasSubstr("element face, row 0, property vertex_index"), HasSubstr("4294967295")));
}

TEST(ParsePly, RowsWithoutPropertiesNameTheFile) {
  for (const char* format : {"ascii", "binary_little_endian"}) {
    EXPECT_THAT(PlyErrorOf(std::string("ply\nformat ") + format +
                           " 1.0\nelement vertex 1000000000000000000\nend_header\n"),
                AllOf(HasSubstr("scan.ply: element vertex"), HasSubstr("1000000000000000000 rows")));
  }
}

TEST(ParsePly, EveryTruncationIsAnError) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nelement face 1\n"
      "property list uchar int vertex_index\nend_header\n";
  const std::string bytes = head + std::string(8, '\0') + Bytes({2, 1, 0, 0, 0, 1, 0, 0, 0});
  ASSERT_TRUE(ParsePly(bytes, "scan.ply").ok());
  for (size_t size = 0; size < bytes.size(); ++size) PlyErrorOf(bytes.substr(0, size));
}

TEST(ParsePly, NamesHeaderLineOrElementRowAndProperty) {
  EXPECT_THAT(PlyErrorOf("solid cube\n"),
              AllOf(HasSubstr("scan.ply: header line 1"), HasSubstr("not a PLY file")));
  EXPECT_THAT(PlyErrorOf("ply\nformat text 1.0\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("binary_little_endian")));
  EXPECT_THAT(PlyErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n1\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("property x: unknown type")));
  EXPECT_THAT(
      PlyErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\nend_header\n1\n"),
      HasSubstr("unknown type"));
  EXPECT_THAT(
      PlyErrorOf(
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int x\nend_header\n1 1\n"),
      HasSubstr("property x occurs twice"));
  EXPECT_THAT(PlyErrorOf("ply\nelement vertex 1\nproperty int x\nend_header\n1\n"),
              HasSubstr("no format line"));
  EXPECT_THAT(PlyErrorOf("ply\nformat ascii 1.0\nelement vertex 2\nproperty uchar x\nend_header\n1\n256\n"),
              HasSubstr("element vertex, row 1, property x: \"256\" is no uchar"));
  EXPECT_THAT(PlyErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1e39\n"),
              HasSubstr("\"1e39\" is no float"));
  EXPECT_THAT(PlyErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\none\n"),
              HasSubstr("\"one\" is not a number"));
  EXPECT_THAT(
      PlyErrorOf("ply\nformat ascii 1.0\nelement face 1\nproperty list char int i\nend_header\n-1 0\n"),
      HasSubstr("list length -1 is negative"));
}

TEST(WritePly, WhatIsWrittenReadsBackTheSame) {
  PlyElement vertex;
  vertex.name = "vertex";
  vertex.rows = 2;
  vertex.properties = {
      PlyColumn("x", PlyType::kFloat32, {0.1f, -1e30f}), PlyColumn("h", PlyType::kFloat64, {0.1, 1e-300}),
      PlyColumn("n", PlyType::kUint32, {0, 4294967295.0}), PlyColumn("s", PlyType::kInt8, {-128, 127})};
  PlyElement face;
  face.name = "face";
  face.rows = 2;
  PlyProperty list = PlyColumn("vertex_indices", PlyType::kInt32, {5, 6, 7});
  list.is_list = true;
  list.list_start = {0, 0, 3};
  face.properties = {list};
  const Ply ply{{"two words"}, {vertex, face}};
  const TempFolder folder;
  ASSERT_TRUE(WritePly(folder / "a.ply", ply).ok());
  const auto back = ReadPly(folder / "a.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_THAT(back->comments, ElementsAre("two words"));
  for (const PlyProperty& property : vertex.properties) {
    EXPECT_EQ(back->Find("vertex")->Find(property.name)->values, property.values) << property.name;
  }
  EXPECT_EQ(back->Find("face")->Find("vertex_indices")->list_start, list.list_start);
}

TEST(WritePly, RefusesValuesThatTheTypeCannotHold) {
  const TempFolder folder;
  const auto error = [&](PlyType type, double value) {
    PlyElement element{"vertex", 1, {PlyColumn("x", type, {value})}};
    return std::string(WritePly(folder / "a.ply", Ply{{}, {element}}).message());
  };
  EXPECT_THAT(error(PlyType::kUint8, 256),
              AllOf(HasSubstr("a.ply"), HasSubstr("row 0, property x"), HasSubstr("uchar")));
  EXPECT_THAT(error(PlyType::kInt32, 0.5), HasSubstr("int"));
  EXPECT_THAT(error(PlyType::kFloat32, 1e39), HasSubstr("float"));
  const PlyElement uneven{"vertex", 2, {PlyColumn("x", PlyType::kInt8, {1})}};
  EXPECT_THAT(SerializePly(Ply{{}, {uneven}}).status().message(), HasSubstr("1 values do not make 2 rows"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.ply"));
}

TEST(ParsePly, NamesMayBeInCapitals) {
  const auto ply = ParsePly(
      "ply\nformat ascii 1.0\nelement Vertex 1\nproperty float X\nproperty float x\n"
      "property float Y\nproperty float NX\nend_header\n1 2 3 4\n",
      "scan.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  const PlyElement* vertex = ply->Find("vertex");
  ASSERT_NE(vertex, nullptr);
  EXPECT_THAT(vertex->Find("x")->values, ElementsAre(2));
  EXPECT_THAT(vertex->Find("X")->values, ElementsAre(1));
  EXPECT_THAT(vertex->Find("y")->values, ElementsAre(3));
  EXPECT_THAT(vertex->Find("nx")->values, ElementsAre(4));
  EXPECT_EQ(vertex->Find("ny"), nullptr);
}

}  // namespace
}  // namespace weft

#include "services/formats/files/ply_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Between the first two lines and the last one.
std::string HeaderWith(const std::string& lines) {
  return "ply\nformat ascii 1.0\n" + lines + "end_header\n";
}

std::string HeaderFault(const std::string& text) {
  const absl::Status status = ParsePlyHeader(text, "a.ply").status();
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status << "\n" << text;
  EXPECT_THAT(std::string(status.message()), StartsWith("a.ply: header line "));
  return std::string(status.message());
}

TEST(PlyHeader, HasElementsAndProperties) {
  const std::string text = HeaderWith(
      "comment made by hand\ncomment\nobj_info nothing\nelement vertex 12\nproperty float32 x\n"
      "property\tdouble  y \nelement face 3\nproperty list uchar int vertex_indices\n");
  const auto header = ParsePlyHeader(text + "1 2 3", "a.ply");
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->format, PlyFormat::kAscii);
  EXPECT_EQ(header->body_begin, text.size());
  EXPECT_THAT(header->layout.comments, ElementsAre("made by hand", ""));
  ASSERT_EQ(header->layout.elements.size(), 2u);
  const PlyElement& vertex = header->layout.elements[0];
  EXPECT_EQ(vertex.name, "vertex");
  EXPECT_EQ(vertex.rows, 12u);
  ASSERT_EQ(vertex.properties.size(), 2u);
  EXPECT_EQ(vertex.properties[0].type, PlyType::kFloat32);
  EXPECT_FALSE(vertex.properties[0].is_list);
  EXPECT_EQ(vertex.properties[1].name, "y");
  EXPECT_EQ(vertex.properties[1].type, PlyType::kFloat64);
  const PlyProperty& list = header->layout.elements[1].properties[0];
  EXPECT_TRUE(list.is_list);
  EXPECT_EQ(list.count_type, PlyType::kUint8);
  EXPECT_EQ(list.type, PlyType::kInt32);
  EXPECT_EQ(list.name, "vertex_indices");
}

TEST(PlyHeader, KnowsBothNamesAndTheSizeOfEveryType) {
  struct Named {
    PlyType type;
    int bytes;
    const char *name, *alias;
  };
  for (const Named& named :
       {Named{PlyType::kInt8, 1, "char", "int8"}, Named{PlyType::kUint8, 1, "uchar", "uint8"},
        Named{PlyType::kInt16, 2, "short", "int16"}, Named{PlyType::kUint16, 2, "ushort", "uint16"},
        Named{PlyType::kInt32, 4, "int", "int32"}, Named{PlyType::kUint32, 4, "uint", "uint32"},
        Named{PlyType::kFloat32, 4, "float", "float32"}, Named{PlyType::kFloat64, 8, "double", "float64"}}) {
    EXPECT_EQ(PlyTypeName(named.type), named.name);
    EXPECT_EQ(PlyTypeSize(named.type), named.bytes);
    for (const char* name : {named.name, named.alias}) {
      const auto header =
          ParsePlyHeader(HeaderWith(std::string("element v 1\nproperty ") + name + " x\n"), "a.ply");
      ASSERT_TRUE(header.ok()) << header.status();
      EXPECT_EQ(header->layout.elements[0].properties[0].type, named.type);
    }
  }
}

TEST(PlyHeader, KnowsThreeFormats) {
  for (const auto& [name, format] :
       {std::pair{"ascii", PlyFormat::kAscii}, std::pair{"binary_little_endian", PlyFormat::kLittleEndian},
        std::pair{"binary_big_endian", PlyFormat::kBigEndian}}) {
    const auto header = ParsePlyHeader(std::string("ply\nformat ") + name + " 1.0\nend_header\n", "a.ply");
    ASSERT_TRUE(header.ok()) << header.status();
    EXPECT_EQ(header->format, format);
  }
  EXPECT_THAT(HeaderFault("ply\nformat zip 1.0\nend_header\n"), HasSubstr("line 2: unknown format \"zip\""));
  EXPECT_THAT(HeaderFault("ply\nformat\nend_header\n"), HasSubstr("line 2: format names no encoding"));
  EXPECT_THAT(HeaderFault("ply\nend_header\n"), HasSubstr("line 2: the header has no format line"));
}

// The first byte of a binary body may be a line feed.
TEST(PlyHeader, EndsWhereItsFirstLineSaysThatLinesEnd) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string text = "ply" + end + "format binary_little_endian 1.0" + end + "end_header" + end;
    const auto header = ParsePlyHeader(text + "\nbody", "a.ply");
    ASSERT_TRUE(header.ok()) << header.status();
    EXPECT_EQ(header->body_begin, text.size());
  }
  EXPECT_THAT(HeaderFault("ply\nformat ascii 1.0\rend_header\n"), HasSubstr("do its lines end in one way?"));
  const std::string marked = "\xef\xbb\xbf" + HeaderWith("");
  EXPECT_EQ(ParsePlyHeader(marked, "a.ply")->body_begin, marked.size());
}

TEST(PlyHeader, NamesTheLineThatIsWrong) {
  EXPECT_THAT(HeaderFault(""), HasSubstr("not a PLY file"));
  EXPECT_THAT(HeaderFault("plx\n"), HasSubstr("line 1: not a PLY file"));
  EXPECT_THAT(HeaderFault("ply\nformat ascii 1.0\n"), HasSubstr("line 2: the header has no end_header line"));
  EXPECT_THAT(HeaderFault(HeaderWith("elemnt v 1\n")), HasSubstr("line 3: unknown keyword \"elemnt\""));
  EXPECT_THAT(HeaderFault(HeaderWith("\n" + std::string(50, 'k') + "\n")),
              HasSubstr("line 4: unknown keyword \"" + std::string(40, 'k') + "\""));
  for (const char* element : {"element v\n", "element v -1\n", "element v 1 2\n", "element v many\n"})
    EXPECT_THAT(HeaderFault(HeaderWith(element)), HasSubstr("expected `element NAME COUNT`"));
  EXPECT_THAT(HeaderFault(HeaderWith("element v 1\nelement v 2\n")),
              HasSubstr("line 4: element v occurs twice"));
  EXPECT_THAT(HeaderFault(HeaderWith("property int x\n")),
              HasSubstr("a property precedes the first element"));
  for (const char* property : {"property\n", "property int\n", "property int x y\n", "property list int x\n"})
    EXPECT_THAT(HeaderFault(HeaderWith(std::string("element v 1\n") + property)),
                HasSubstr("expected `property TYPE NAME`"));
  for (const char* property :
       {"property long x\n", "property list float int x\n", "property list double int x\n",
        "property list long int x\n", "property list uchar long x\n"})
    EXPECT_THAT(HeaderFault(HeaderWith(std::string("element v 1\n") + property)),
                HasSubstr("element v, property x: unknown type"));
  EXPECT_THAT(HeaderFault(HeaderWith("element v 1\nproperty int x\nproperty float x\n")),
              HasSubstr("line 5: element v: property x occurs twice"));
}

TEST(PlyHeader, IsBounded) {
  const auto with = [](int elements, int properties) {
    std::string lines;
    for (int i = 0; i < elements; ++i) lines += "element e" + std::to_string(i) + " 1\n";
    for (int i = 0; i < properties; ++i) lines += "property int p" + std::to_string(i) + "\n";
    return HeaderWith(lines);
  };
  EXPECT_TRUE(ParsePlyHeader(with(64, 256), "a.ply").ok());
  EXPECT_THAT(HeaderFault(with(65, 0)), HasSubstr("too many elements"));
  EXPECT_THAT(HeaderFault(with(1, 257)), HasSubstr("too many properties"));
  const std::string comment = "comment " + std::string((1 << 20) - 8 - 21 - 12, 'c') + "\n";
  EXPECT_THAT(HeaderFault(HeaderWith(comment + "comment\n")), HasSubstr("has no end_header line"));
}

TEST(PlyHeader, IsWrittenAsItIsRead) {
  Ply ply;
  ply.comments = {"made by hand"};
  ply.elements.resize(2);
  ply.elements[0] = {"vertex", 2, {PlyColumn("x", PlyType::kFloat32, {1, 2})}};
  PlyProperty list = PlyColumn("vertex_indices", PlyType::kInt32, {});
  list.is_list = true;
  list.count_type = PlyType::kUint16;
  ply.elements[1] = {"face", 0, {list}};
  EXPECT_EQ(WritePlyHeader(ply),
            "ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement vertex 2\nproperty float x\n"
            "element face 0\nproperty list ushort int vertex_indices\nend_header\n");
}

}  // namespace
}  // namespace weft

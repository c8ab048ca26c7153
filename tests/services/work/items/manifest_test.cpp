// Which manifests are taken, and which id they give.
#include "services/work/items/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/work/items/item_words.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::ItemManifest ManifestOf(const std::vector<std::string>& paths) {
  v1::ItemManifest manifest;
  for (const std::string& path : paths) {
    v1::ItemFile& file = *manifest.add_files();
    file.set_path(path);
    file.set_bytes(3);
    file.set_sha256(Sha256().Add("abc").Hex());
  }
  return manifest;
}

TEST(Sha256, GivesTheKnownHash) {
  EXPECT_EQ(Sha256().Add("a").Add("bc").Hex(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(ItemManifest, HasAnIdThatDependsOnContentNotOnOrder) {
  EXPECT_EQ(ItemIdOf(ManifestOf({"a", "b/c"})), ItemIdOf(ManifestOf({"b/c", "a"})));
  EXPECT_NE(ItemIdOf(ManifestOf({"a", "b/c"})), ItemIdOf(ManifestOf({"a", "b/d"})));
}

TEST(ItemManifest, RefusesPathsThatLeadElsewhere) {
  EXPECT_TRUE(CheckManifest(ManifestOf({"0001/400 1.png", "0001/..png", "ä"})).ok());
  const std::string deep = "a/b/c/d/e/f/g/h/i";
  for (const std::string& path :
       {std::string(), std::string("/etc/passwd"), std::string(".."), std::string("../a"),
        std::string("a/../b"), std::string("a/./b"), std::string("a//b"), std::string("a/"),
        std::string("a\nb"), std::string("a\0b", 3), std::string("\xff"), std::string(201, 'x'),
        std::string(2000, 'x'), deep}) {
    const absl::Status status = CheckManifest(ManifestOf({"good", path}));
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << path;
    EXPECT_THAT(std::string(status.message()), HasSubstr("manifest.files"));
  }
}

TEST(ItemManifest, RefusesFilesThatCannotStandSideBySide) {
  EXPECT_THAT(std::string(CheckManifest(ManifestOf({"a", "a"})).message()), HasSubstr("twice"));
  EXPECT_THAT(std::string(CheckManifest(ManifestOf({"a/b", "a"})).message()),
              HasSubstr("a file and a folder"));
  EXPECT_FALSE(CheckManifest({}).ok());
  v1::ItemManifest negative = ManifestOf({"a"}), hash = ManifestOf({"a"}), huge = ManifestOf({"a", "b"});
  negative.mutable_files(0)->set_bytes(-1);
  hash.mutable_files(0)->set_sha256("abc");
  for (v1::ItemFile& file : *huge.mutable_files()) file.set_bytes(INT64_MAX);
  for (const v1::ItemManifest& manifest : {negative, hash, huge}) EXPECT_FALSE(CheckManifest(manifest).ok());
}

TEST(ItemReference, IsANameAVersionOrAHash) {
  EXPECT_EQ(ParseItemReference("shirt")->name, "shirt");
  EXPECT_EQ(ParseItemReference("shirt@12")->version, 12);
  EXPECT_EQ(ParseItemReference("sha256:" + std::string(64, 'a'))->id, std::string(64, 'a'));
  for (const char* text : {"", "shirt@", "shirt@0", "shirt@x", "a b", "../a", "sha256:", "sha256:AB", ".a"}) {
    EXPECT_EQ(ParseItemReference(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(ItemManifest, HasAnIdThatAnybodyCanCompute) {
  // Of "ba78...15ad 3 a\nba78...15ad 3 b/c\n", by sha256sum.
  EXPECT_EQ(ItemIdOf(ManifestOf({"b/c", "a"})),
            "f4b79bb3a9f9c9afb4fe46229d83c1ba88b1059433489000437c5b65cc8be6cb");
}

TEST(ItemManifest, CountsBytesAndFindsFiles) {
  v1::ItemManifest manifest = ManifestOf({"a", "b/c"});
  manifest.mutable_files(1)->set_bytes(int64_t{1} << 40);
  EXPECT_EQ(BytesOf(manifest), 3 + (int64_t{1} << 40));
  ASSERT_NE(FindFile(manifest, "b/c"), nullptr);
  EXPECT_EQ(FindFile(manifest, "b/c"), &manifest.files(1));
  EXPECT_EQ(FindFile(manifest, "b"), nullptr);
}

TEST(ItemManifest, PathsHaveLimits) {
  const std::string part(199, 'x');
  const std::string long_path =
      part + "/" + part + "/" + part + "/" + part + "/" + part + "/";  // 1,000 bytes
  EXPECT_TRUE(CheckItemPath(long_path + std::string(24, 'y')).ok());
  EXPECT_THAT(std::string(CheckItemPath(long_path + std::string(25, 'y')).message()),
              HasSubstr("has 1025 bytes, at most 1024"));
  EXPECT_TRUE(CheckItemPath(std::string(200, 'x')).ok());
  EXPECT_THAT(std::string(CheckItemPath(std::string(201, 'x')).message()), HasSubstr("more than 200 bytes"));
  EXPECT_TRUE(CheckItemPath("a/b/c/d/e/f/g/h").ok());
  EXPECT_THAT(std::string(CheckItemPath("a/b/c/d/e/f/g/h/i").message()),
              HasSubstr("lies 9 folders deep, at most 8"));
}

TEST(ItemManifest, NumbersHaveLimits) {
  v1::ItemManifest manifest = ManifestOf({"a", "b"});
  manifest.mutable_files(0)->set_bytes((int64_t{1} << 50) - 3);
  EXPECT_TRUE(CheckManifest(manifest).ok()) << CheckManifest(manifest);
  manifest.mutable_files(1)->set_bytes(4);
  EXPECT_THAT(std::string(CheckManifest(manifest).message()), HasSubstr("impossible size, 4 bytes"));
  manifest.mutable_files(1)->set_bytes(0);
  EXPECT_TRUE(CheckManifest(manifest).ok());
  v1::ItemManifest many;
  for (int k = 0; k < kMaxItemFiles; ++k) *many.add_files() = ManifestOf({std::to_string(k)}).files(0);
  EXPECT_TRUE(CheckManifest(many).ok());
  *many.add_files() = ManifestOf({"more"}).files(0);
  EXPECT_THAT(std::string(CheckManifest(many).message()), HasSubstr("100001 files, at most 100000"));
}

TEST(ItemManifest, AFileIsNoFolderAtAnyDepth) {
  for (const char* file : {"a", "a/b", "a/b/c"})
    EXPECT_THAT(std::string(CheckManifest(ManifestOf({"a/b/c/d", file})).message()),
                HasSubstr(std::string("\"") + file + "\" is a file and a folder"));
  EXPECT_TRUE(CheckManifest(ManifestOf({"a/b/c/d", "ab", "a/bc", "a/b/cd"})).ok());
}

}  // namespace
}  // namespace weft

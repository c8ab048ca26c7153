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

}  // namespace
}  // namespace weft
